// A hard case of skate_env/studies/hardcases, and what its measurement uses.
import { type Accuracy, type Engine, Refused, type SceneEdit, type Simulation, type State } from "../engine";
import { type Driver, Run } from "../run";

/** The Python package's description of a case, as web/catalogue.py writes it. */
export interface Entry {
  name: string;
  kind: string;
  setup: string;
  law: string;
  criterion: string;
  unit: string;
  /** Largest value that passes; null where an accuracy does not support the case. */
  limits: Record<Accuracy, number | null>;
  /** Value of the Python package. */
  measured: Record<Accuracy, number | null>;
  /** Why an accuracy does not support the case. */
  excluded: string;
  /** Scenes in the order in which the Python package builds them, as TOML. */
  scenes: string[];
}

/** How the page runs a case. */
export interface Recipe {
  /** Largest number of actions of each run. */
  actions: number;
  /** Where a run ends earlier. */
  until?: (state: State) => boolean;
  /** Action period [s]; without one, that of the scene. */
  period?: number;
  driver?: Driver;
  /** Index of the scene that is shown; without it the first. */
  scene?: number;
  /** NaN where the motion does not reach the situation that is measured. */
  measure(bench: Bench): number;
}

export interface HardCase extends Entry {
  /** Null where the page does not run the case. */
  recipe: Recipe | null;
}

/** The shown scene of a case. */
export function editOf({ scenes, recipe }: HardCase, index = recipe?.scene ?? 0): SceneEdit {
  const period = recipe?.period;
  return { toml: scenes[index] ?? "", values: period === undefined ? {} : { "control.action_period": period } };
}

/** Builds the simulations of a case at one accuracy. */
export class Bench {
  private readonly sims: Simulation[] = [];

  constructor(private readonly engine: Engine, private readonly hard: HardCase, readonly accuracy: Accuracy) {}

  get count(): number {
    return this.hard.scenes.length;
  }

  edit(index?: number, changes: Omit<SceneEdit, "toml"> = {}): SceneEdit {
    const { values, ...edit } = editOf(this.hard, index);
    return { ...edit, ...changes, values: { ...values, ...changes.values }, accuracy: this.accuracy };
  }

  /** A simulation at the start of a scene. */
  start(edit = this.edit()): Simulation {
    const sim = this.engine.create(edit);
    this.sims.push(sim);
    return sim;
  }

  /** A simulation of a scene after a time [s], in one call. */
  after(time: number, index?: number): Simulation {
    const sim = this.start(this.edit(index));
    sim.advance(time);
    return sim;
  }

  /** A run of a scene with the case's driver, to the case's end. */
  run(index?: number, changes?: Omit<SceneEdit, "toml">): Run {
    const { actions = 0, driver = null, until = () => false } = this.hard.recipe ?? {};
    const run = new Run(this.engine, this.edit(index, changes), [], driver);
    this.sims.push(run.sim);
    while (run.last < actions && !run.finished && !until(run.at(run.last))) run.extend(run.last + 1);
    return run;
  }

  /** Runs of all scenes. */
  runs(): Run[] {
    return Array.from({ length: this.count }, (_, index) => this.run(index));
  }

  remove(): void {
    for (const sim of this.sims) sim.remove();
  }
}

/** Torques of some joints, by the number of the action, counted from 1. */
export function torques(of: (part: number) => Record<number, number>): Driver {
  return {
    torques(sim, action) {
      const all = new Float64Array(sim.description.coordinates.length - 3);
      for (const [joint, torque] of Object.entries(of(action + 1))) all[Number(joint)] = torque;
      return all;
    },
  };
}

/** A repeatable sequence of numbers in [0, 1): a linear congruential generator (Numerical Recipes). */
export function sequence(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** Torques between two limits, one per joint [N m]. */
export function randomTorques(sim: Simulation, next: () => number, limit: number): Float64Array {
  return Float64Array.from({ length: sim.description.coordinates.length - 3 }, () => limit * (2 * next() - 1));
}

/** Is a call refused with a message, and no bit of the simulation changed? */
export function refuses(sim: Simulation, call: () => unknown): boolean {
  const before = sim.snapshot();
  try {
    call();
  } catch (error) {
    return error instanceof Refused && error.message !== "" && differ(before, sim.snapshot()) === 0;
  }
  return false;
}

/** Number of bytes that differ. */
export function differ(one: Uint8Array, other: Uint8Array): number {
  return one.reduce((sum, byte, i) => sum + (byte === other[i] ? 0 : 1), Math.max(other.length - one.length, 0));
}

/** The next floating-point number above a positive one, or below it. */
export function nextTo(x: number, by: 1 | -1): number {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, x);
  view.setBigInt64(0, view.getBigInt64(0) + BigInt(by));
  return view.getFloat64(0);
}

/** NaN unless a condition holds. */
export function given(condition: boolean, value: number): number {
  return condition ? value : Number.NaN;
}

export function largest(states: readonly State[], measure: (state: State) => number): number {
  return states.reduce((most, state) => Math.max(most, measure(state)), 0);
}

/** Largest unaccounted energy in the largest kinetic energy. */
export function unaccounted({ states }: Run): number {
  return largest(states.slice(1), (state) => Math.abs(state.energyResidual)) / largest(states, (state) => state.kineticEnergy);
}

/** Kinetic and potential energy [J]. */
export function energy(state: State): number {
  return state.kineticEnergy + state.potentialEnergy;
}

/** Depth of the lowest sole end below the ice [m]; 0 above it. */
export function depth(state: State): number {
  return Math.max(0, -Math.min(...state.heights));
}

/** Largest difference of two lists. */
export function gap(a: Float64Array, b: Float64Array): number {
  return a.reduce((most, x, i) => Math.max(most, Math.abs(x - (b[i] ?? Number.NaN))), 0);
}

/** Largest difference of two states [rad, m; rad/s, m/s]; infinite in other contact states. */
export function apart(one: State, other: State): number {
  const same = one.contactState === other.contactState && one.supportLeg === other.supportLeg && one.termination === other.termination;
  return same ? Math.max(gap(one.q, other.q), gap(one.v, other.v)) : Infinity;
}

export function termination(sim: Simulation): string | null {
  return sim.termination(sim.state());
}

export function end(run: Run): State {
  return run.at(run.last);
}

/** Are all numbers of a state finite? */
export function finite(state: State): boolean {
  return [state.q, state.v, state.contactForces, state.head].every((list) => list.every(Number.isFinite));
}
