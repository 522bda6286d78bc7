// A replay of a scene, as in rust/skate-web/examples/checksums.rs.
import type { Accuracy, Engine } from "../src/engine";

export const STEPS = 100;

export interface Replay {
  actions: number;
  time: number;
  steps: number;
  termination: number;
  evaluations: number;
  checksum: string;
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
  const again = engine.create({ toml, accuracy });
  const started = performance.now();
  again.step(actions);
  const seconds = (performance.now() - started) / 1000;
  again.remove();
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
