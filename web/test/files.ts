// Files that the tests read.
import { existsSync, readFileSync, readdirSync } from "node:fs";
import { Engine } from "../src/engine";
import type { Replay } from "./replay";

const ROOT = new URL("../../", import.meta.url);
const FOLDER = new URL("skate_env/scenes/", ROOT);
/** Scenes of the Python package's studies. */
const STUDIES = new URL("skate_env/studies/scenes/", ROOT);

const scenesIn = (folder: URL) =>
  readdirSync(folder).flatMap((file) => (file.endsWith(".toml") ? [file.slice(0, -".toml".length)] : []));

export const PRESETS = scenesIn(FOLDER);
export const SCENES = [...PRESETS, ...scenesIn(STUDIES)];

export function read(path: string): Uint8Array<ArrayBuffer> {
  return new Uint8Array(readFileSync(new URL(path, ROOT)));
}

export function text(path: string): string {
  return new TextDecoder().decode(read(path));
}

/** Replays of the native engine, by scene and accuracy. */
export function native(): Record<string, Replay> {
  return JSON.parse(text("web/native.json")) as Record<string, Replay>;
}

export function toml(scene: string): string {
  const file = `${scene}.toml`;
  const [path] = [FOLDER, STUDIES].map((folder) => new URL(file, folder)).filter((path) => existsSync(path));
  return readFileSync(path ?? file, "utf8");
}

export function engine(): Promise<Engine> {
  return Engine.load(read("web/public/engine.wasm"));
}
