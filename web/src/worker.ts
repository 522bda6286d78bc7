// Measurements beside the page: a second engine in a thread of its own.
import { judge } from "./cases";
import { type Accuracy, Crashed, Engine, type SceneEdit } from "./engine";
import { type Comparison, type Cost, compare, costs } from "./measure";
import type { Kick } from "./run";

export type Request =
  | { id: number; kind: "costs"; edits: SceneEdit[] }
  | { id: number; kind: "judge"; name: string; accuracy: Accuracy }
  | { id: number; kind: "compare"; edit: SceneEdit; kicks: Kick[]; actions: number };

export type Answer = { id: number } & (
  | { kind: "costs"; costs: Cost[] }
  | { kind: "judge"; measured: number }
  | { kind: "compare"; rows: Comparison[] }
  | { kind: "error"; message: string }
);

let engine: Promise<Engine> | null = null;

async function load(): Promise<Engine> {
  const reply = await fetch(new URL("../engine.wasm", self.location.href));
  return Engine.load(await reply.arrayBuffer());
}

self.onmessage = async ({ data }: MessageEvent<Request>) => {
  const answer = (rest: object) => self.postMessage({ id: data.id, kind: data.kind, ...rest });
  try {
    engine ??= load();
    const loaded = await engine;
    if (data.kind === "costs") answer({ costs: costs(loaded, data.edits) });
    else if (data.kind === "judge") answer({ measured: judge(loaded, data.name, data.accuracy) });
    else answer({ rows: compare(loaded, data.edit, data.kicks, data.actions) });
  } catch (error) {
    // A crashed engine is of no use any more.
    if (error instanceof Crashed) engine = null;
    answer({ kind: "error", message: error instanceof Error ? error.message : String(error) });
  }
};
