// Hard cases of skate_env/studies/hardcases that the page can run: the same scenes, measures and limits.
import type { Accuracy, Engine, SceneEdit, State } from "./engine";
import { type Driver, Run } from "./run";

export interface HardCase {
  name: string;
  setup: string;
  law: string;
  criterion: string;
  unit: string;
  /** Largest allowed value; null where an accuracy does not claim the case. */
  limits: Record<Accuracy, number | null>;
  edit: SceneEdit;
  /** Number of actions. */
  actions: number;
  driver?: Driver;
  measure(run: Run, other: (edit: SceneEdit) => Run): number;
}

export interface Outcome {
  name: string;
  /** NaN where the motion took a turn for which there is no number. */
  measured: number;
  /** Null: the accuracy does not claim the case. */
  limit: number | null;
}

const ON_ONE_LEG = "[start]\nsupport_leg = \"right\"\n[start.q]\nq2 = 0.1\nq3 = -0.2\nq5 = 0.5\nq6 = -0.9\nq7 = 0.4\n";
const PUSH_ONLY = "[contact]\nlaw = \"push_only\"\n";
const DAMPINGS = {
  foot: 100, hand: 20, head: 5, lower_arm: 10, lower_body: 100, lower_leg: 100,
  middle_body: 100, upper_arm: 0.3, upper_body: 100, upper_leg: 100,
};

/** A torque on one joint, by the number of the action, counted from 1. */
function onJoint(joint: number, torque: (part: number) => number): Driver {
  return {
    torques(sim, action) {
      const torques = new Float64Array(sim.description.coordinates.length - 3);
      torques[joint] = torque(action + 1);
      return torques;
    },
  };
}

/** Largest unaccounted energy in the largest kinetic energy. */
function unaccounted({ states }: Run): number {
  const most = Math.max(...states.map((state) => state.kineticEnergy));
  return Math.max(...states.slice(1).map((state) => Math.abs(state.energyResidual))) / most;
}

/** NaN unless a condition holds. */
function given(condition: boolean, value: number): number {
  return condition ? value : Number.NaN;
}

/** Largest difference of two states [rad, m; rad/s, m/s]; infinite in other contact states. */
function apart(one: State, other: State): number {
  if (one.contactState !== other.contactState || one.supportLeg !== other.supportLeg) return Infinity;
  const gaps = (a: Float64Array, b: Float64Array) => Math.max(...a.map((x, i) => Math.abs(x - (b[i] ?? 0))));
  return Math.max(gaps(one.q, other.q), gaps(one.v, other.v));
}

const description = (name: string, setup: string) => `name = "${name}"\ndescription = "${setup}"\n`;

function hardCase(rest: Omit<HardCase, "edit"> & { scene: string; edit?: Omit<SceneEdit, "toml"> }): HardCase {
  const { scene, edit, ...own } = rest;
  return { ...own, edit: { ...edit, toml: scene } };
}

const subnormal = (speed: string) => `${ON_ONE_LEG}[start.v]\ny0 = ${speed}\n${PUSH_ONLY}`;

/** All cases; `blade` is that preset's text. */
export function hardCases(blade: string): HardCase[] {
  const head = (name: string, setup: string) => ({ name, setup, intro: description(name, setup) });
  const creep = head("no_creep", "A robot on one leg. Swinging torques push it along the ice and stay mostly inside the friction cone.");
  const reversal = head("reversal", "A foot on slippery ice. An ankle swings it forward and back ten times a second.");
  const still = head("standing_still", "Standing upright on both feet, with ten times the damping, for 5 s.");
  const small = head("subnormal_speed", "Feet that start at 5e-324 to 1e-30 m/s, forward and backward.");
  const capture = head("capture", "A foot slides to rest at the capture speed 0.01 m/s while the free leg swings.");
  const stiff = head("stiff_head", "Visual lifting with 1e9 N/m on the head, a million times the usual gain.");
  return [
    hardCase({
      ...creep,
      law: "Coulomb: a foot that sticks does not move.",
      criterion: "displacement of the sticking foot",
      unit: "m",
      limits: { fast: 0, balanced: 0, reference: 0 },
      scene: creep.intro + PUSH_ONLY + ON_ONE_LEG,
      actions: 100,
      driver: onJoint(4, (part) => 6 * Math.sin(0.7 * part)),
      measure({ states, events }) {
        const flat = (state: State) => state.contactState > 0 && (state.contactState - 1) % 4 === 0;
        const crept = states.slice(1).map((state, i) => {
          const before = states[i] as State;
          const quiet = !events.some(({ t }) => t > before.time && t <= state.time);
          return flat(before) && flat(state) && quiet ? Math.abs((state.q[0] ?? 0) - (before.q[0] ?? 0)) : 0;
        });
        return given(states.length > 11, Math.max(...crept));
      },
    }),
    hardCase({
      ...reversal,
      law: "First law of thermodynamics; friction counts as a loss.",
      criterion: "unaccounted energy over 1 s",
      unit: "kinetic energies",
      limits: { fast: 0.1, balanced: 1e-6, reference: 1e-10 },
      scene: `${reversal.intro}${PUSH_ONLY}[ice.friction]\nkind = "coulomb"\nmu = 0.02\ncapture_speed = 0.0\n${ON_ONE_LEG}`,
      actions: 100,
      driver: onJoint(0, (part) => 15 * Math.sin(0.2 * Math.PI * part)),
      measure: (run) => given(run.events.some(({ what }) => what.includes("stops")), unaccounted(run)),
    }),
    hardCase({
      ...still,
      law: "Coulomb: a foot that sticks does not move.",
      criterion: "displacement of the supporting foot",
      unit: "m",
      limits: { fast: 0, balanced: 0, reference: 0 },
      scene: still.intro + PUSH_ONLY + Object.entries(DAMPINGS).map(([link, x]) => `[body.${link}]\ndamping = ${x.toFixed(1)}\n`).join(""),
      actions: 500,
      measure: (run) => given(run.termination === null, Math.abs(run.at(run.last).q[0] ?? Number.NaN)),
    }),
    hardCase({
      ...small,
      law: "Continuity: the motion is that from rest.",
      criterion: "distance from the motion from rest after 0.1 s",
      unit: "rad, m, 1/s",
      limits: { fast: 1e-15, balanced: 1e-10, reference: 1e-12 },
      scene: small.intro + subnormal("5e-324"),
      actions: 10,
      measure(_, other) {
        const end = (speed: string) => {
          const run = other({ toml: small.intro + subnormal(speed) });
          run.extend(10);
          const state = run.at(10);
          run.remove();
          return state;
        };
        const rest = end("0.0");
        const sizes = ["5e-324", "1e-310", "2e-308", "1e-200", "1e-30"];
        return Math.max(...sizes.flatMap((size) => [size, `-${size}`]).map((speed) => apart(end(speed), rest)));
      },
    }),
    hardCase({
      name: "no_friction",
      setup: "The preset blade on dry ice without friction; feet land and slide.",
      law: "Newton: the momentum along the ice does not change, landings included.",
      criterion: "change of the momentum along the ice in 0.5 s",
      unit: "of it",
      limits: { fast: null, balanced: 1e-5, reference: 1e-9 },
      scene: blade,
      edit: {
        effects: [["fall_detection", false], ["coulomb_friction", true]],
        values: { "ice.friction.mu": 0, "ice.friction.capture_speed": 0 },
      },
      actions: 50,
      measure(run) {
        const [start, end] = [run.at(0), run.at(run.last)];
        return given(run.termination === null && end.events >= 2, Math.abs(end.speed / start.speed - 1));
      },
    }),
    hardCase({
      ...capture,
      law: "First law of thermodynamics: the impulse that captures a foot counts as a loss.",
      criterion: "unaccounted energy over 0.3 s",
      unit: "kinetic energies",
      limits: { fast: null, balanced: 1e-5, reference: 1e-9 },
      scene: `${capture.intro}${PUSH_ONLY}[start]\nsupport_leg = "right"\n[start.q]\nq2 = 0.1\nq3 = -0.2\nq5 = 0.5\nq6 = -0.9\nq7 = 0.4\n[start.v]\ny0 = 0.15\nq6 = 1.0\n`,
      actions: 30,
      measure: unaccounted,
    }),
    hardCase({
      ...stiff,
      law: "Statics: the head stays where the spring holds it.",
      criterion: "distance of the head's height from its target in 0.1 s",
      unit: "m",
      limits: { fast: 1e-4, balanced: 1e-4, reference: 1e-4 },
      scene: `${stiff.intro}[control.lifting]\nK_p = [1e9, 1e9, 1e9]\nahead = 0.08286173581686737\nheight = 1.691856789403182\n${ON_ONE_LEG}`,
      actions: 10,
      measure: (run) => given(run.termination === null, Math.max(...run.states.slice(1).map(({ head }) => Math.abs((head[2] ?? 0) - 1.691856789403182)))),
    }),
  ];
}

/** Run a case. */
export function judge(engine: Engine, hard: HardCase, accuracy: Accuracy): Outcome {
  const { name, edit, actions, driver } = hard;
  const limit = hard.limits[accuracy];
  if (limit === null) return { name, measured: Number.NaN, limit };
  const run = new Run(engine, { ...edit, accuracy }, [], driver);
  run.extend(actions);
  const measured = hard.measure(run, (other) => new Run(engine, { ...other, accuracy }));
  run.remove();
  return { name, measured, limit };
}
