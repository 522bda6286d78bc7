// The page's side of the measurements' thread.
import type { Accuracy, SceneEdit } from "./engine";
import type { Comparison, Cost } from "./measure";
import type { Kick } from "./run";
import type { Answer, Request } from "./worker";

type Waiting = { resolve: (answer: Answer) => void; reject: (why: Error) => void };
type Unnumbered = Request extends infer R ? (R extends Request ? Omit<R, "id"> : never) : never;

export class Meter {
  private readonly worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
  private readonly waiting = new Map<number, Waiting>();
  private count = 0;

  constructor() {
    this.worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      this.waiting.get(data.id)?.resolve(data);
      this.waiting.delete(data.id);
    };
    this.worker.onerror = (event) => {
      for (const { reject } of this.waiting.values()) reject(new Error(event.message));
      this.waiting.clear();
    };
  }

  async costs(edits: SceneEdit[]): Promise<Cost[]> {
    const answer = await this.ask({ kind: "costs", edits });
    if (answer.kind !== "costs") throw new Error(answer.kind === "error" ? answer.message : answer.kind);
    return answer.costs;
  }

  /** All accuracies, from the scene's start. */
  async compare(edit: SceneEdit, kicks: Kick[], actions: number): Promise<Comparison[]> {
    const answer = await this.ask({ kind: "compare", edit, kicks, actions });
    if (answer.kind !== "compare") throw new Error(answer.kind === "error" ? answer.message : answer.kind);
    return answer.rows;
  }

  /** The measured value of a hard case. */
  async judge(name: string, accuracy: Accuracy): Promise<number> {
    const answer = await this.ask({ kind: "judge", name, accuracy });
    if (answer.kind !== "judge") throw new Error(answer.kind === "error" ? answer.message : answer.kind);
    return answer.measured;
  }

  private ask(request: Unnumbered): Promise<Answer> {
    const id = ++this.count;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage({ ...request, id });
    });
  }
}
