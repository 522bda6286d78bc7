// The page's side of the measurements' thread.
import type { SceneEdit } from "./engine";
import type { Comparison, Cost } from "./measure";
import type { Receipt, Verification } from "./receipt";
import type { Kick } from "./run";
import type { Answer, Request } from "./worker";

type Waiting = { resolve: (result: unknown) => void; reject: (why: Error) => void };

export class Meter {
  private readonly worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
  private readonly waiting = new Map<number, Waiting>();
  private count = 0;

  constructor() {
    this.worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      const waiting = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if ("error" in data) waiting?.reject(new Error(data.error));
      else waiting?.resolve(data.result);
    };
    this.worker.onerror = (event) => {
      for (const { reject } of this.waiting.values()) reject(new Error(event.message));
      this.waiting.clear();
    };
  }

  costs(edits: SceneEdit[]): Promise<Cost[]> {
    return this.ask({ kind: "costs", edits }) as Promise<Cost[]>;
  }

  /** All accuracies, from the scene's start. */
  compare(edit: SceneEdit, kicks: Kick[], actions: number): Promise<Comparison[]> {
    return this.ask({ kind: "compare", edit, kicks, actions }) as Promise<Comparison[]>;
  }

  /** Repeat a recorded motion. */
  verify(receipt: Receipt): Promise<Verification> {
    return this.ask({ kind: "verify", receipt }) as Promise<Verification>;
  }

  private ask(request: Request): Promise<unknown> {
    const id = ++this.count;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage({ ...request, id });
    });
  }
}
