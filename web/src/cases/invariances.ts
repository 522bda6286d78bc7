// Invariances: skate_env/studies/hardcases/invariances.py.
import type { Simulation } from "../engine";
import { type Recipe, differ, nextTo, randomTorques, sequence } from "./case";

const ROBOTS = 8;
const ACTIONS = 60;
/** [s] */
const RESUMED = 0.6;

/** Make an action under random torques, unless the simulation has ended. */
function push(sim: Simulation, next: () => number): void {
  sim.hold(randomTorques(sim, next, 20));
  sim.step();
}

export const INVARIANCES: Record<string, Recipe> = {
  resumed: {
    actions: RESUMED * 100,
    measure(bench) {
      const [whole, events] = [bench.start(), bench.start()];
      events.advance(RESUMED);
      const times = events.takeEvents().map(({ t }) => t);
      const next = sequence(11);
      const random = Array.from({ length: 60 }, () => RESUMED * next());
      const moments = [...times, ...times.map((t) => nextTo(t, -1)), ...random].filter((t) => t > 0 && t < RESUMED).sort((a, b) => a - b);
      let parts = bench.start();
      for (const moment of moments) {
        for (const sim of [whole, parts]) sim.advance(Math.max(moment, sim.state().time));
        const saved = parts.snapshot();
        parts = bench.start();
        parts.restore(saved);
      }
      for (const sim of [whole, parts]) sim.advance(RESUMED);
      return differ(whole.snapshot(), parts.snapshot());
    },
  },
  in_turn: {
    actions: ACTIONS,
    measure(bench) {
      const robots = Array.from({ length: ROBOTS }, (_, seed) => seed);
      const alone = robots.map((seed) => {
        const [sim, next] = [bench.start(), sequence(seed)];
        for (let i = 0; i < ACTIONS; i++) push(sim, next);
        return sim.snapshot();
      });
      const together = robots.map((seed) => ({ sim: bench.start(), next: sequence(seed) }));
      for (let i = 0; i < ACTIONS; i++) for (const { sim, next } of together) push(sim, next);
      return together.reduce((sum, { sim }, i) => sum + differ(alone[i] ?? new Uint8Array(), sim.snapshot()), 0);
    },
  },
};
