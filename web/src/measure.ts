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
const REPEATS = 3;
/** Coordinates before the joints: y0, z0, q1. */
const ROOT = 3;

export function cost(engine: Engine, edit: SceneEdit): Cost {
  const sim = engine.create(edit);
  const start = sim.snapshot();
  let best = Infinity;
  let done = 0;
  for (let i = 0; i < REPEATS; i++) {
    sim.restore(start);
    const started = performance.now();
    done = Math.max(sim.step(ACTIONS), 1);
    best = Math.min(best, performance.now() - started);
  }
  const { evaluations } = sim.state();
  sim.remove();
  const milliseconds = Math.max(best, 1e-3);
  return {
    perSecond: (1e3 * evaluations) / milliseconds,
    microseconds: (1e3 * milliseconds) / done,
    evaluationsPerAction: evaluations / done,
  };
}

export function compare(engine: Engine, edit: SceneEdit, kicks: Kick[], actions: number): Comparison[] {
  const runs = ACCURACIES.map((accuracy) => {
    const run = new Run(engine, { ...edit, accuracy }, kicks);
    run.extend(actions);
    return run;
  });
  const reference = runs[ACCURACIES.indexOf("reference")] as Run;
  const rows = runs.map((run, i) => {
    const errors = [];
    for (let action = 0; action <= Math.min(run.last, reference.last); action++) {
      const [own, exact] = [run.at(action), reference.at(action)];
      errors.push(own.supportLeg === exact.supportLeg ? distance(own.q, exact.q) : Number.NaN);
    }
    const state = run.at(run.last);
    const steps = Math.max(run.last, 1);
    const cost: Cost = {
      perSecond: (1e3 * state.evaluations) / Math.max(run.engineTime, 1e-3),
      microseconds: (1e3 * run.engineTime) / steps,
      evaluationsPerAction: state.evaluations / steps,
    };
    return { accuracy: ACCURACIES[i] as Accuracy, cost, errors, termination: run.termination };
  });
  for (const run of runs) run.remove();
  return rows;
}

function distance(a: Float64Array, b: Float64Array): number {
  let sum = 0;
  for (let i = ROOT; i < a.length; i++) sum += ((a[i] ?? 0) - (b[i] ?? 0)) ** 2;
  return Math.sqrt(sum / (a.length - ROOT));
}
