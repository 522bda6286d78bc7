// Receipts of recordings (skate_env/replay/receipt.py): is a recorded motion repeated bit for bit?
import type { Engine, State } from "./engine";

export interface Receipt {
  /** As TOML. */
  scene: string;
  /** Snapshot of the engine. */
  start: Uint8Array;
  /** Residual torque of each joint in each action [N m], joints next to each other. */
  actions: Float64Array;
  /** Of the samples [s]. */
  times: Float64Array;
  /** Coordinates and their rates of the samples, of one sample next to each other. */
  q: Float64Array;
  v: Float64Array;
  /** SHA-256 of t, q and v at the start and after each action. */
  checksum: string;
}

export interface Verification {
  actions: number;
  /** The first difference; null if the motion is repeated bit for bit. */
  difference: string | null;
}

/** Coordinates before the joints: y0, z0, q1. */
const ROOT = 3;

/** Repeat a recorded motion from its start with its actions; compare t, q and v. */
export async function verify(engine: Engine, receipt: Receipt): Promise<Verification> {
  const sim = engine.create({ toml: receipt.scene });
  try {
    const names = sim.description.coordinates;
    const joints = names.length - ROOT;
    const count = receipt.actions.length / joints;
    sim.restore(receipt.start);
    const states = [sim.state()];
    let difference = differenceAt(receipt, names, sim.state());
    let made = 0;
    while (made < count && difference === null && sim.state().termination === 0) {
      sim.hold(receipt.actions.slice(joints * made, joints * (made + 1)));
      sim.step();
      made += 1;
      const state = sim.state();
      states.push(state);
      difference = differenceAt(receipt, names, state);
    }
    if (difference === null && (await checksum(states)) !== receipt.checksum) {
      difference = `the checksum of ${made} actions (recorded ${count})`;
    }
    return { actions: made, difference };
  } finally {
    sim.remove();
  }
}

/** Compare with the sample at this time, if there is one; samples may be rare or dense. */
function differenceAt({ times, q, v }: Receipt, names: readonly string[], state: State): string | null {
  const row = times.indexOf(state.time);
  if (row < 0) return null;
  const n = names.length;
  for (const [what, known, own] of [["", q, state.q], ["rate of ", v, state.v]] as const) {
    for (let i = 0; i < n; i++) {
      const recorded = known[n * row + i];
      if (recorded !== own[i]) return `${what}${names[i]} at ${state.time.toPrecision(6)} s: recorded ${recorded}, now ${own[i]}`;
    }
  }
  return null;
}

async function checksum(states: readonly State[]): Promise<string> {
  const numbers = Float64Array.from(states.flatMap((state) => [state.time, ...state.q, ...state.v]));
  const sum = new Uint8Array(await crypto.subtle.digest("SHA-256", numbers));
  return [...sum].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
