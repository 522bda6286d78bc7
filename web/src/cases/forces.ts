// Contact forces that are not unique or very large: skate_env/studies/hardcases/forces.py.
import { type Recipe, end, given, largest, torques } from "./case";

const GRAVITY = 9.81;
/** Row of Table 2: both feet stick flat. */
const BOTH_STICK = 17;
const BEND = [-0.5, 1, -0.5, 0.5, -1, 0.5];

export const FORCES: Record<string, Recipe> = {
  pressed_foot: {
    actions: 30,
    measure(bench) {
      const sim = bench.start();
      const heavy = (sim.state().contactForces[1] ?? 0) > 100 * GRAVITY * sim.description.mass;
      sim.advance(1e-5);
      return given(heavy, 1 - (sim.state().v[0] ?? 0));
    },
  },
  straight_legs: {
    actions: 5,
    measure(bench) {
      const run = bench.run();
      const weight = GRAVITY * run.sim.description.mass;
      const [, normal = 0, , , , other = 0] = run.at(0).contactForces;
      const bounded = Math.max(...end(run).contactForces.map(Math.abs)) < 2 * weight;
      return given(run.termination === null && bounded, Math.abs((normal + other) / weight - 1));
    },
  },
  nearly_straight: {
    actions: 10,
    scene: 10,
    measure(bench) {
      const ends = Array.from({ length: bench.count }, (_, index) => {
        const state = bench.after(0.1, index).state();
        const still = state.termination === 0 && state.violation < 1e-11 && state.contactState === BOTH_STICK;
        return given(still, Math.max(...state.v.map(Math.abs)));
      });
      const last = ends.length - 1;
      // Angles of the knees: 1e-12 to 1e-2 rad, a decade apart.
      return Math.max(...ends.map((speed, i) => Math.abs(speed - (ends[last] ?? Number.NaN) * 10 ** (i - last))));
    },
  },
  through_straight: {
    actions: 20,
    driver: torques((part) => Object.fromEntries(BEND.map((share, joint) => [joint, 30 * Math.sin(0.9 * (part - 1)) * share]))),
    measure(bench) {
      const run = bench.run();
      return given([null, "fall", "singular"].includes(run.termination), largest(run.states.slice(1), ({ violation }) => violation));
    },
  },
};
