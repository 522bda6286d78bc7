// Sliding and sticking: skate_env/studies/hardcases/friction.py.
import type { State } from "../engine";
import { type Bench, type Recipe, apart, end, given, torques, unaccounted } from "./case";

const sticksFlat = ({ contactState }: State) => contactState > 0 && (contactState - 1) % 4 === 0;
const slidesFlat = ({ contactState }: State) => contactState > 0 && (contactState - 1) % 4 === 2;

/** The state 1 ns after the start under a torque of the ankle [N m]. */
function afterAnkle(bench: Bench, torque: number): State {
  const sim = bench.start();
  const all = new Float64Array(sim.description.coordinates.length - 3);
  all[0] = torque;
  sim.hold(all);
  sim.advance(1e-9);
  return sim.state();
}

export const FRICTION: Record<string, Recipe> = {
  no_creep: {
    actions: 100,
    driver: torques((part) => ({ 4: 6 * Math.sin(0.7 * part) })),
    measure(bench) {
      const { states, events } = bench.run();
      const crept = states.slice(1).map((state, i) => {
        const before = states[i] as State;
        const quiet = !events.some(({ t }) => t > before.time && t <= state.time);
        return sticksFlat(before) && sticksFlat(state) && quiet ? Math.abs((state.q[0] ?? 0) - (before.q[0] ?? 0)) : 0;
      });
      return given(states.length > 11, Math.max(...crept));
    },
  },
  at_the_limit: {
    actions: 1,
    measure(bench) {
      let [low, high] = [0, 20];
      const slides = (torque: number) => slidesFlat(afterAnkle(bench, torque));
      if (slides(low) || !slides(high)) return Number.NaN;
      while (high - low > 1e-10 * high) {
        const middle = 0.5 * (low + high);
        if (slides(middle)) high = middle;
        else low = middle;
      }
      const outside = afterAnkle(bench, high * (1 + 1e-7));
      return given(!slides(low * (1 - 1e-7)) && slidesFlat(outside), Math.abs(outside.acceleration));
    },
  },
  reversal: {
    actions: 100,
    driver: torques((part) => ({ 0: 15 * Math.sin(0.2 * Math.PI * part) })),
    measure(bench) {
      const run = bench.run();
      return given(run.events.some(({ what }) => what.includes("stops")), unaccounted(run));
    },
  },
  subnormal_speed: {
    actions: 10,
    scene: 1,
    measure(bench) {
      const [rest, ...others] = bench.runs().map(end);
      return rest === undefined ? Number.NaN : Math.max(...others.map((other) => apart(other, rest)));
    },
  },
  no_friction: {
    actions: 50,
    measure(bench) {
      const run = bench.run();
      return given(run.termination === null && end(run).events >= 2, Math.abs(end(run).speed / run.at(0).speed - 1));
    },
  },
  capture: { actions: 30, measure: (bench) => unaccounted(bench.run()) },
};
