// Files that the tests read.
import { readFileSync, readdirSync } from "node:fs";
import { Engine } from "../src/engine";

const ROOT = new URL("../../", import.meta.url);
const SCENES = new URL("skate_env/scenes/", ROOT);

export const PRESETS = readdirSync(SCENES).map((file) => file.replace(".toml", ""));

export function read(path: string): Uint8Array<ArrayBuffer> {
  return new Uint8Array(readFileSync(new URL(path, ROOT)));
}

export function toml(preset: string): string {
  return readFileSync(new URL(`${preset}.toml`, SCENES), "utf8");
}

export function engine(): Promise<Engine> {
  return Engine.load(read("web/public/engine.wasm"));
}
