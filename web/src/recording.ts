// Recordings of the Python package (`Recording.save`, `viewer.for_page`), played back without the engine.
import type { SceneFields } from "./engine";
import type { Motion, Sample } from "./motion";
import { Damaged, numbersOf, objectOf, readNpz } from "./npz";
import type { Receipt } from "./receipt";

const ARRAYS = ["t", "state_number", "right_support", "contact_forces", "head", "segments"];
/** What repeats the motion; packed recordings are without it. */
const RECEIPT = ["start", "actions", "q", "v"];
const METADATA = "metadata";
const LINK_NUMBERS = 17 * 2 * 3;
const LAST_STATE = 20;

type Numbers = Float64Array;

export class Recording implements Motion {
  readonly finished = true;
  readonly period: number;
  /** Number of leg swaps until each sample. */
  private readonly steps: Int32Array;

  private constructor(
    private readonly times: Numbers,
    private readonly states: Numbers,
    private readonly right: Numbers,
    private readonly forces: Numbers,
    private readonly heads: Numbers,
    private readonly segments: Numbers,
    readonly termination: string | null,
    /** The simulated scene, as TOML. */
    readonly scene: string,
    /** Its fields, as far as the file has them. */
    readonly fields: SceneFields | null,
    readonly hasPolicy: boolean,
    readonly receipt: Receipt | null,
  ) {
    this.period = times.length > 1 ? (times[1] ?? 0) - (times[0] ?? 0) : 1;
    this.steps = new Int32Array(times.length);
    for (let i = 1; i < times.length; i++) {
      this.steps[i] = (this.steps[i - 1] ?? 0) + (right[i] === right[i - 1] ? 0 : 1);
    }
  }

  static async read(bytes: Uint8Array<ArrayBuffer>): Promise<Recording> {
    const entries = await readNpz(bytes, new Set([...ARRAYS, ...RECEIPT, METADATA]));
    const { scene, fields, termination, policy, checksum } = objectOf(entries, METADATA);
    if (typeof scene !== "string") throw new Damaged("not a recording: it has no scene");
    const times = numbersOf(entries, "t", [-1]);
    const n = times.length;
    if (n === 0) throw new Damaged("a recording without samples");
    if (times.some((t, i) => i > 0 && t <= (times[i - 1] ?? t))) throw new Damaged("times of samples must increase");
    const states = numbersOf(entries, "state_number", [n]);
    if (!states.every((state) => state >= 0 && state <= LAST_STATE)) throw new Damaged(`contact states must lie in 0 to ${LAST_STATE}`);
    return new Recording(
      times,
      states,
      numbersOf(entries, "right_support", [n]),
      // At the end of a motion that has left the finite numbers there may be others.
      numbersOf(entries, "contact_forces", [n, 2, 4], false).map((x) => (Number.isFinite(x) ? x : 0)),
      numbersOf(entries, "head", [n, 3]),
      numbersOf(entries, "segments", [n, 17, 2, 3]),
      typeof termination === "string" ? termination : null,
      scene,
      typeof fields === "object" ? (fields as SceneFields | null) : null,
      policy !== null && policy !== undefined,
      typeof checksum !== "string" ? null : {
        scene,
        start: Uint8Array.from(numbersOf(entries, "start", [-1])),
        actions: numbersOf(entries, "actions", [-1, -1]),
        times,
        q: numbersOf(entries, "q", [n, -1]),
        v: numbersOf(entries, "v", [n, -1]),
        checksum,
      },
    );
  }

  get last(): number {
    return this.times.length - 1;
  }

  /** For example "9.82 s, 9 steps, ended by fall". */
  get summary(): string {
    const { last, times, steps, termination } = this;
    const duration = ((times[last] ?? 0) - (times[0] ?? 0)).toFixed(2);
    const who = this.hasPolicy ? "learned policy, " : "";
    return `${who}${duration} s, ${steps[last]} steps${termination === null ? "" : `, ended by ${termination}`}`;
  }

  at(index: number): Sample {
    const i = Math.min(Math.max(index, 0), this.last);
    return {
      time: this.times[i] ?? 0,
      contactState: this.states[i] ?? 0,
      supportLeg: this.right[i] === 1 ? "right" : "left",
      head: this.heads.subarray(3 * i, 3 * i + 3),
      contactForces: this.forces.subarray(8 * i, 8 * i + 8),
      links: this.segments.subarray(LINK_NUMBERS * i, LINK_NUMBERS * (i + 1)),
      gaitSteps: this.steps[i] ?? 0,
      speed: Number.NaN,
    };
  }
}
