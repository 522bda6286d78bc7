// Invalid and extreme input: skate_env/studies/hardcases/numbers.py.
import { Refused, type SceneEdit } from "../engine";
import { type Bench, type Recipe, randomTorques, refuses, sequence } from "./case";

/** Is a start refused with a message that contains these words? */
function startRefused(bench: Bench, edit: SceneEdit, says: string): boolean {
  try {
    bench.start(edit);
  } catch (error) {
    return error instanceof Refused && error.message.includes(says);
  }
  return false;
}

const SHORT = [0, 5e-324, 1e-300, 1e-15, 1e-12, 1e-9];
const ODD = [-1, Number.NaN, Infinity, -Infinity, 1e300];

export const INPUT: Record<string, Recipe> = {
  odd_steps: {
    actions: 100,
    measure(bench) {
      const sim = bench.start();
      const now = () => sim.state().time;
      let wrong = 0;
      for (const short of SHORT) {
        for (let i = 0; i < 50; i++) {
          const until = now() + short;
          wrong += sim.advance(until) && now() === until ? 0 : 1;
        }
      }
      for (const odd of ODD) wrong += refuses(sim, () => sim.advance(now() + odd)) ? 0 : 1;
      return wrong + (sim.advance(now() + 10) ? 0 : 1);
    },
  },
  tiny_calls: {
    actions: 100,
    measure(bench) {
      const sim = bench.start();
      const next = sequence(9);
      let wrong = 0;
      for (let part = 1; part <= 5000; part++) {
        sim.hold(randomTorques(sim, next, 1));
        wrong += sim.advance(1e-6 * part) ? 0 : 1;
      }
      return wrong;
    },
  },
  damaged_snapshots: {
    actions: 25,
    measure(bench) {
      const sim = bench.start();
      sim.advance(0.2);
      const whole = sim.snapshot();
      sim.advance(0.25);
      const next = sequence(10);
      const damaged = Array.from({ length: 200 }, () => whole.slice(0, Math.floor(next() * whole.length)));
      for (let i = 0; i < 2000; i++) {
        const turned = whole.slice();
        const place = Math.floor(next() * 8 * whole.length);
        turned[place >> 3] = (turned[place >> 3] ?? 0) ^ (1 << (place % 8));
        damaged.push(turned);
      }
      return damaged.filter((bytes) => !refuses(sim, () => sim.restore(bytes))).length;
    },
  },
  inconsistent_starts: {
    actions: 10,
    measure(bench) {
      const fine = [0, 1, 2].filter((index) => bench.start(bench.edit(index)).state().termination !== 0).length;
      const rotated: SceneEdit = bench.edit(0, { effects: [["foot_rotation", false]], values: { "start.q.q1": 0.1 } });
      const broken: [SceneEdit, string][] = [
        [bench.edit(3), "above the ice"],
        [bench.edit(4), "below the ice"],
        [bench.edit(5), "below the ice"],
        [rotated, "q1"],
        [bench.edit(6), "below the ice"],
      ];
      return fine + broken.filter(([edit, says]) => !startRefused(bench, edit, says)).length;
    },
  },
};
