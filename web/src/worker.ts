// Measurements beside the page: a second engine in a thread of its own.
import { Crashed, Engine, type SceneEdit } from "./engine";
import { messageOf } from "./errors";
import { type Comparison, type Cost, compare, costs } from "./measure";
import { type Receipt, type Verification, verify } from "./receipt";
import type { Kick } from "./run";

export type Request =
  | { kind: "costs"; edits: SceneEdit[] }
  | { kind: "compare"; edit: SceneEdit; kicks: Kick[]; actions: number }
  | { kind: "verify"; receipt: Receipt };

export type Answer = { id: number } & ({ result: Cost[] | Comparison[] | Verification } | { error: string });

let engine: Promise<Engine> | null = null;

self.onmessage = async ({ data }: MessageEvent<Request & { id: number }>) => {
  const answer = (given: Answer) => self.postMessage(given);
  try {
    // The page's folder is above that of this program.
    engine ??= Engine.fetch(new URL("..", self.location.href).href);
    const loaded = await engine;
    answer({ id: data.id, result: await resultOf(loaded, data) });
  } catch (error) {
    // A crashed engine is of no use any more.
    if (error instanceof Crashed) engine = null;
    answer({ id: data.id, error: messageOf(error) });
  }
};

function resultOf(engine: Engine, request: Request): Cost[] | Comparison[] | Promise<Verification> {
  switch (request.kind) {
    case "costs":
      return costs(engine, request.edits);
    case "compare":
      return compare(engine, request.edit, request.kicks, request.actions);
    case "verify":
      return verify(engine, request.receipt);
  }
}
