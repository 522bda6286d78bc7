// The state of the page in the URL, after the #: what differs from the defaults.
import { ACCURACIES, type Accuracy, type SceneEdit } from "./engine";
import { type Kick, LONGEST } from "./run";

export const SPEEDS = [0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10] as const;

export interface Settings {
  preset: string;
  /** Null: that of the preset. */
  accuracy: Accuracy | null;
  /** Effects that were switched, in order. */
  effects: [name: string, on: boolean][];
  /** Numbers that were changed. */
  values: Record<string, number>;
  kicks: Kick[];
  /** Does the shipped policy skate, with the baseline beside it? */
  policy: boolean;
  /** Shown action. */
  action: number;
  playing: boolean;
  /** Times real time. */
  speed: number;
  forces: boolean;
  camera: CameraName;
  theme: Theme;
}

/** Settings that do not concern the scene. */
export type Look = Pick<Settings, "playing" | "speed" | "forces" | "camera" | "theme">;

export const CAMERAS = ["angle", "side", "front", "above"] as const;
export type CameraName = (typeof CAMERAS)[number];
export const THEMES = ["auto", "light", "dark"] as const;
export type Theme = (typeof THEMES)[number];

export const DEFAULTS: Readonly<Settings> = {
  preset: "paper",
  accuracy: null,
  effects: [],
  values: {},
  kicks: [],
  policy: false,
  action: 0,
  playing: true,
  speed: 1,
  forces: true,
  camera: "angle",
  theme: "auto",
};

export function editOf(settings: Settings, toml: string): SceneEdit {
  const { effects, values, accuracy } = settings;
  return { toml, effects, values, ...(accuracy === null ? {} : { accuracy }) };
}

export function write(settings: Settings): string {
  const out = new URLSearchParams();
  const set = (key: string, value: string, standard: string) => {
    if (value !== standard) out.set(key, value);
  };
  set("scene", settings.preset, DEFAULTS.preset);
  set("accuracy", settings.accuracy ?? "", "");
  set("effects", settings.effects.map(([name, on]) => (on ? "+" : "-") + name).join(","), "");
  set("set", Object.entries(settings.values).map(([name, x]) => `${name}:${x}`).join(","), "");
  set("kicks", settings.kicks.map(({ action, speed }) => `${action}:${speed}`).join(","), "");
  set("policy", settings.policy ? "1" : "0", "0");
  set("action", String(settings.action), "0");
  set("play", settings.playing ? "1" : "0", "1");
  set("speed", String(settings.speed), "1");
  set("forces", settings.forces ? "1" : "0", "1");
  set("camera", settings.camera, DEFAULTS.camera);
  set("theme", settings.theme, DEFAULTS.theme);
  return out.toString().replaceAll("+", "%20").replaceAll("%2C", ",").replaceAll("%3A", ":").replaceAll("%2B", "+");
}

/** Entries of an address. A plus stands for itself. */
export function entries(hash: string): URLSearchParams {
  return new URLSearchParams(hash.replace(/^#/, "").replaceAll("+", "%2B"));
}

/** The first ten of a list. */
function some(names: readonly string[]): string {
  return names.length > 10 ? `${names.slice(0, 10).join(", ")} and ${names.length - 10} more` : names.join(", ");
}

/** Read settings. What is not valid keeps its default and is reported. */
export function read(hash: string, presets: readonly string[], report: (message: string) => void): Settings {
  const given = entries(hash);
  const settings: Settings = structuredClone(DEFAULTS) as Settings;
  const choose = <T extends string>(key: string, known: readonly T[], use: (x: T) => void) => {
    const text = given.get(key);
    if (text === null) return;
    const found = known.find((x) => x === text);
    if (found === undefined) report(`Address: ${key} = "${text}" is unknown; known are ${some(known)}.`);
    else use(found);
  };
  const number = (name: string, text: string | undefined, low: number, high: number): number | null => {
    const x = text === undefined || text.trim() === "" ? Number.NaN : Number(text);
    if (x >= low && x <= high) return x;
    report(`Address: ${name} = "${text ?? ""}" must be a number from ${low} to ${high}.`);
    return null;
  };
  const list = (key: string) => (given.get(key) ?? "").split(",").filter((part) => part !== "");

  choose("scene", presets, (x) => { settings.preset = x; });
  choose("accuracy", ACCURACIES, (x) => { settings.accuracy = x; });
  choose("camera", CAMERAS, (x) => { settings.camera = x; });
  choose("theme", THEMES, (x) => { settings.theme = x; });
  choose("play", ["0", "1"], (x) => { settings.playing = x === "1"; });
  choose("policy", ["0", "1"], (x) => { settings.policy = x === "1"; });
  choose("forces", ["0", "1"], (x) => { settings.forces = x === "1"; });
  choose("speed", SPEEDS.map(String), (x) => { settings.speed = Number(x); });
  for (const part of list("effects")) {
    if (/^[+-]\w+$/.test(part)) settings.effects.push([part.slice(1), part.startsWith("+")]);
    else report(`Address: effects: "${part}" must be an effect's name after + or -.`);
  }
  for (const part of list("set")) {
    const [name = "", text] = part.split(":");
    const x = number(`set ${name}`, text, -1e9, 1e9);
    if (x !== null) settings.values[name] = x;
  }
  for (const part of list("kicks")) {
    const [when, text] = part.split(":");
    const action = number("action of a kick", when, 0, LONGEST);
    const speed = number("speed of a kick", text, -10, 10);
    if (action !== null && speed !== null) settings.kicks.push({ action: Math.round(action), speed });
  }
  if (given.has("action")) {
    settings.action = Math.round(number("action", given.get("action") ?? "", 0, LONGEST) ?? 0);
  }
  return settings;
}
