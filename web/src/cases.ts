// Hard cases of the Python package (skate_env/studies/hardcases): its list, and how the page plays a case.
import catalogue from "./cases.json";
import { sin } from "./elementary";
import type { Accuracy, Simulation } from "./engine";
import type { Driver } from "./run";

/** A hard case as web/catalogue.py describes it; numbers by the accuracies that support it. */
export interface HardCase {
  name: string;
  kind: string;
  setup: string;
  law: string;
  criterion: string;
  unit: string;
  /** Largest value that passes. */
  limits: Partial<Record<Accuracy, number>>;
  /** Value that the Python package measures. */
  measured: Partial<Record<Accuracy, number>>;
  /** Why the other accuracies do not support the case. */
  excluded: string;
  /** The played scene as TOML; null where the page cannot play the case. */
  scene: string | null;
}

export const CASES: readonly HardCase[] = catalogue;

/** Torques that a case applies to the joints with these indices [N m]. */
interface Torques {
  /** Action period [s]; without it, that of the scene. */
  period?: number;
  /** For an action, counted from 1. */
  of(action: number, sim: Simulation): Record<number, number>;
}

/** Share of each leg joint in bending both knees. */
const BEND = [-0.5, 1, -0.5, 0.5, -1, 0.5];

/** Torques that stretch both knees. */
function jump(torque: number): Record<number, number> {
  return { 1: -torque, 4: torque };
}

const TORQUES: Record<string, Torques> = {
  no_creep: { of: (action) => ({ 4: 6 * sin(0.7 * action) }) },
  reversal: { of: (action) => ({ 0: 15 * sin(0.2 * Math.PI * action) }) },
  through_straight: { of: (action) => ({ ...BEND.map((share) => share * 30 * sin(0.9 * (action - 1))) }) },
  edge_of_the_sole: { period: 1e-3, of: (action) => ({ 0: 100 * sin((Math.PI * action) / 50) }) },
  legs_take_turns: { period: 1e-3, of: (action) => ({ 0: 60 * (-1) ** action, 5: -60 * (-1) ** action }) },
  lift_off: { period: 1e-3, of: (_, sim) => jump(sim.state().contactState === 0 ? 0 : 400) },
};

/** What changes in the scene of a case, by dotted names, and what sets its torques. */
export function playOf({ name }: HardCase): { values: Record<string, number>; driver: Driver | null } {
  const applied = TORQUES[name];
  if (applied === undefined) return { values: {}, driver: null };
  const driver: Driver = {
    torques(sim, action) {
      const all = new Float64Array(sim.description.coordinates.length - 3);
      for (const [joint, torque] of Object.entries(applied.of(action + 1, sim))) all[Number(joint)] = torque;
      return all;
    },
  };
  return { values: applied.period === undefined ? {} : { "control.action_period": applied.period }, driver };
}
