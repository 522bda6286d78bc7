// Contact states of Table 2 in words.

export type Slip = "air" | "stick" | "slide";

export interface FootContact {
  slip: Slip;
  /** On the heel or the toe alone. */
  edge: boolean;
}

export interface ContactState {
  support: FootContact;
  free: FootContact;
}

const AIR: FootContact = { slip: "air", edge: false };

/** Both feet in state 1 to 20 of Table 2; in state 0 the supporting foot is in the air. */
export function contactState(number: number): ContactState {
  if (number === 0) return { support: AIR, free: AIR };
  const bits = (number - 1) % 4;
  const support: FootContact = { slip: bits >= 2 ? "slide" : "stick", edge: bits % 2 === 1 };
  const free = [
    AIR,
    { slip: "slide", edge: true },
    { slip: "stick", edge: true },
    { slip: "slide", edge: false },
    { slip: "stick", edge: false },
  ] satisfies FootContact[];
  return { support, free: free[Math.floor((number - 1) / 4)] ?? AIR };
}

function words({ slip, edge }: FootContact): string {
  if (slip === "air") return "in the air";
  const motion = slip === "slide" ? "slides" : "sticks";
  return edge ? `${motion} on an edge` : `${motion} flat`;
}

/** For example "supporting foot slides flat, free foot in the air". */
export function describe(number: number): string {
  const { support, free } = contactState(number);
  return number === 0
    ? "supporting foot in the air"
    : `supporting foot ${words(support)}, free foot ${words(free)}`;
}
