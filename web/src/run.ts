// A run: one simulation with everything that is needed to look back.
import { type Engine, Refused, type SceneEdit, type Simulation, type State } from "./engine";
import type { Motion } from "./motion";

export interface Kick {
  /** Number of actions before it. */
  action: number;
  /** [m/s] */
  speed: number;
}

/** What sets the residual torques. */
export interface Driver {
  /** Residual torques of the action after so many actions, one per joint [N m]. */
  torques(sim: Simulation, action: number): Float64Array;
  /** Why it cannot drive a simulation, or null. */
  refuses?(sim: Simulation): string | null;
}

/** Actions between two snapshots. */
const SNAPSHOT_INTERVAL = 50;
/** Longest recording [actions]. */
export const LONGEST = 20_000;

/**
 * States after 0, 1, 2, ... actions of a scene under kicks. Equal scenes, kicks and drivers give equal
 * states, bit for bit, whether they were reached at once or by looking back.
 */
export class Run implements Motion {
  readonly sim: Simulation;
  readonly period: number;
  readonly states: State[] = [];
  private snapshots: Uint8Array[] = [];
  /** Sorted by action. */
  readonly kicks: Kick[];
  /** Spent in the engine [ms]. */
  engineTime = 0;

  constructor(engine: Engine, edit: SceneEdit, kicks: readonly Kick[] = [], private readonly driver: Driver | null = null) {
    this.sim = engine.create(edit);
    const refused = driver?.refuses?.(this.sim);
    if (refused != null) {
      this.sim.remove();
      throw new Refused(refused);
    }
    this.period = this.sim.description.scene.control.action_period;
    this.kicks = [...kicks].sort((a, b) => a.action - b.action);
    this.record();
  }

  /** Index of the newest state. */
  get last(): number {
    return this.states.length - 1;
  }

  get termination(): string | null {
    return this.sim.termination(this.at(this.last));
  }

  get finished(): boolean {
    return this.at(this.last).termination !== 0 || this.last >= LONGEST;
  }

  at(action: number): State {
    const state = this.states[Math.min(Math.max(action, 0), this.last)];
    if (state === undefined) throw new RangeError(`no state ${action}`);
    return state;
  }

  /** Simulate until a state exists, the run ends, or this time is over [ms]. */
  extend(action: number, budget = Infinity): void {
    const until = performance.now() + budget;
    while (this.last < action && !this.finished && performance.now() < until) this.advance();
  }

  /** Kick the robot at a state; what came later is forgotten. */
  kick(action: number, speed: number): void {
    this.rewind(action);
    this.extend(action);
    this.sim.kick(speed);
    this.kicks.push({ action: this.last, speed });
    this.states.pop();
    this.store();
  }

  remove(): void {
    this.sim.remove();
  }

  private advance(): void {
    const started = performance.now();
    if (this.driver !== null) this.sim.hold(this.driver.torques(this.sim, this.last));
    this.sim.step();
    this.engineTime += performance.now() - started;
    this.record();
  }

  /** Make the kicks that are due, and store the present state. */
  private record(): void {
    const action = this.states.length;
    for (const kick of this.kicks) {
      if (kick.action === action) this.sim.kick(kick.speed);
    }
    this.store();
  }

  private store(): void {
    const action = this.states.length;
    if (action % SNAPSHOT_INTERVAL === 0) this.snapshots[action / SNAPSHOT_INTERVAL] = this.sim.snapshot();
    this.states.push(this.sim.state());
  }

  /** Go back to the last snapshot before a state, and forget the kicks after that state. */
  private rewind(action: number): void {
    if (action >= this.last) return;
    const from = Math.floor(Math.max(action, 0) / SNAPSHOT_INTERVAL);
    const snapshot = this.snapshots[from];
    if (snapshot === undefined) throw new RangeError(`no snapshot ${from}`);
    this.sim.restore(snapshot);
    this.snapshots.length = from + 1;
    this.states.length = from * SNAPSHOT_INTERVAL + 1;
    this.kicks.splice(this.kicks.findLastIndex((kick) => kick.action <= action) + 1);
  }
}
