// The page's address: what is written is read again; what is not valid is reported.
import { expect, test } from "vitest";
import { DEFAULTS, type Settings, read, write } from "../src/link";
import { PRESETS } from "./files";

function readAll(hash: string): { settings: Settings; messages: string[] } {
  const messages: string[] = [];
  return { settings: read(hash, PRESETS, (message) => messages.push(message)), messages };
}

test("defaults need no address", () => {
  expect(write(DEFAULTS as Settings)).toBe("");
  expect(readAll("")).toEqual({ settings: DEFAULTS, messages: [] });
});

test("all settings come back", () => {
  const settings: Settings = {
    preset: "push_only",
    accuracy: "fast",
    effects: [["arms", false], ["push_only", true]],
    values: { "ice.gravity": 1.62, "control.lifting.K_p.2": 1e-7 },
    kicks: [{ action: 12, speed: -0.5 }, { action: 300, speed: 1.25 }],
    policy: true,
    action: 42,
    playing: false,
    speed: 0.1,
    forces: false,
    camera: "above",
    theme: "dark",
  };
  expect(readAll(`#${write(settings)}`)).toEqual({ settings, messages: [] });
});

test("what is not valid keeps its default and is reported", () => {
  const bad = "scene=moon&accuracy=great&effects=arms&set=ice.gravity:heavy,x&kicks=1:99,a:1&action=-3&play=2&speed=7&camera=<b>&theme=";
  const { settings, messages } = readAll(bad);
  expect(settings).toEqual(DEFAULTS);
  expect(messages).toHaveLength(12);
  expect(messages[0]).toBe(`Address: scene = "moon" is unknown; known are ${PRESETS.join(", ")}.`);
});

test("noise is no address", () => {
  for (const noise of ["%", "%E0%A4%A", "&&&===", "scene", "\u0000", "set=".padEnd(5000, "a:1,")]) {
    expect(() => readAll(noise)).not.toThrow();
  }
});
