// Colours of the drawing. Feet and forces have those of the Python figures (Okabe and Ito's palette).

export interface Palette {
  sky: string;
  ice: string;
  line: string;
  text: string;
  halo: string;
}

export const SUPPORT = "#D55E00";
export const FREE = "#0072B2";
export const PUSH = "#009E73";
export const PULL = "#CC79A7";
export const TARGET = "#F0E442";
/** Of a robot that another is compared with. */
export const HAZE = "#AFC0D0";

export const LIGHT: Palette = { sky: "#EEF3F8", ice: "#DCE8F2", line: "#9DB4C8", text: "#1E2A38", halo: "#FFFFFF" };
export const DARK: Palette = { sky: "#10161E", ice: "#1B2733", line: "#48617A", text: "#E4ECF4", halo: "#10161E" };
