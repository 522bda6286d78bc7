// Measurements beside the page: a second engine in a thread of its own.
import { Crashed, Engine, type SceneEdit } from "./engine";
import { type Comparison, type Cost, compare, costs } from "./measure";
import type { Kick } from "./run";

export type Request =
  | { kind: "costs"; edits: SceneEdit[] }
  | { kind: "compare"; edit: SceneEdit; kicks: Kick[]; actions: number };

export type Answer = { id: number } & ({ result: Cost[] | Comparison[] } | { error: string });

let engine: Promise<Engine> | null = null;

async function load(): Promise<Engine> {
  const reply = await fetch(new URL("../engine.wasm", self.location.href));
  return Engine.load(await reply.arrayBuffer());
}

self.onmessage = async ({ data }: MessageEvent<Request & { id: number }>) => {
  const answer = (given: Answer) => self.postMessage(given);
  try {
    engine ??= load();
    const loaded = await engine;
    const result = data.kind === "costs" ? costs(loaded, data.edits) : compare(loaded, data.edit, data.kicks, data.actions);
    answer({ id: data.id, result });
  } catch (error) {
    // A crashed engine is of no use any more.
    if (error instanceof Crashed) engine = null;
    answer({ id: data.id, error: error instanceof Error ? error.message : String(error) });
  }
};
