// A replay of a scene, as in rust/skate-web/examples/checksums.rs.
import type { Accuracy, Engine } from "../src/engine";

export const STEPS = 100;
/** Time in which a run is repeated for its time [ms]. */
const REPEATED = 500;

export interface Replay {
  actions: number;
  time: number;
  steps: number;
  termination: number;
  evaluations: number;
  checksum: string;
  /** Least time of a run. */
  seconds: number;
}

/** Run until a number of gait steps or the end. The checksum is that of q and v after every action. */
export function replay(engine: Engine, toml: string, accuracy: Accuracy, steps: number): Replay {
  const sim = engine.create({ toml, accuracy });
  const rows: Float64Array[] = [];
  let actions = 0;
  let state = sim.state();
  for (;;) {
    rows.push(state.q, state.v);
    if (state.gaitSteps >= steps || state.termination !== 0 || sim.step() === 0) break;
    actions += 1;
    state = sim.state();
  }
  sim.remove();
  const numbers = new Float64Array(rows.flatMap((row) => [...row]));
  const begun = performance.now();
  let seconds = Infinity;
  do {
    const again = engine.create({ toml, accuracy });
    const started = performance.now();
    again.step(actions);
    seconds = Math.min(seconds, (performance.now() - started) / 1000);
    again.remove();
  } while (performance.now() - begun < REPEATED);
  return {
    actions,
    time: state.time,
    steps: state.gaitSteps,
    termination: state.termination,
    evaluations: state.evaluations,
    checksum: engine.checksum(numbers),
    seconds,
  };
}
