// What effects and accuracies cost.
import { ACCURACIES, type Accuracy, type Engine, type SceneEdit } from "./engine";
import { type Kick, Run } from "./run";

/** What a scene costs. */
export interface Cost {
  /** Evaluations of the equations of motion per second of computing. */
  perSecond: number;
  /** Time per action [us]. */
  microseconds: number;
  evaluationsPerAction: number;
}

/** An accuracy beside `reference`. */
export interface Comparison {
  accuracy: Accuracy;
  cost: Cost;
  /** Root mean square of the joint angles' errors after each action; NaN if the other leg supports [rad]. */
  errors: number[];
  termination: string | null;
}

/** Actions of one measurement, and how often it is repeated; the fastest counts. */
const ACTIONS = 100;
const REPEATS = 8;
/** Coordinates before the joints: y0, z0, q1. */
const ROOT = 3;

/** Costs of scenes, measured in turns, so that a slow moment of the machine meets all of them. */
export function costs(engine: Engine, edits: readonly SceneEdit[]): Cost[] {
  const sims = edits.map((edit) => engine.create(edit));
  const starts = sims.map((sim) => sim.snapshot());
  const best = sims.map(() => Infinity);
  const done = sims.map(() => 0);
  for (let repeat = 0; repeat < REPEATS; repeat++) {
    sims.forEach((sim, i) => {
      sim.restore(starts[i] as Uint8Array);
      const started = performance.now();
      done[i] = Math.max(sim.step(ACTIONS), 1);
      best[i] = Math.min(best[i] as number, performance.now() - started);
    });
  }
  return sims.map((sim, i) => {
    const { evaluations } = sim.state();
    sim.remove();
    const milliseconds = Math.max(best[i] as number, 1e-3);
    const actions = done[i] as number;
    return {
      perSecond: (1e3 * evaluations) / milliseconds,
      microseconds: (1e3 * milliseconds) / actions,
      evaluationsPerAction: evaluations / actions,
    };
  });
}

export function compare(engine: Engine, edit: SceneEdit, kicks: Kick[], actions: number): Comparison[] {
  const edits = ACCURACIES.map((accuracy) => ({ ...edit, accuracy }));
  const runs = edits.map((edit) => {
    const run = new Run(engine, edit, kicks);
    run.extend(actions);
    return run;
  });
  // After the runs: the browser compiles a function well only after many calls.
  const measured = costs(engine, edits);
  const reference = runs[ACCURACIES.indexOf("reference")] as Run;
  const rows = runs.map((run, i) => {
    const errors = [];
    for (let action = 0; action <= Math.min(run.last, reference.last); action++) {
      const [own, exact] = [run.at(action), reference.at(action)];
      errors.push(own.supportLeg === exact.supportLeg ? distance(own.q, exact.q) : Number.NaN);
    }
    return { accuracy: ACCURACIES[i] as Accuracy, cost: measured[i] as Cost, errors, termination: run.termination };
  });
  for (const run of runs) run.remove();
  return rows;
}

function distance(a: Float64Array, b: Float64Array): number {
  let sum = 0;
  for (let i = ROOT; i < a.length; i++) sum += ((a[i] ?? 0) - (b[i] ?? 0)) ** 2;
  return Math.sqrt(sum / (a.length - ROOT));
}
