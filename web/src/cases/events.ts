// Landings and other events: skate_env/studies/hardcases/events.py.
import type { Accuracy, Simulation, State } from "../engine";
import { type Recipe, apart, depth, end, given, largest, nextTo, sequence, termination, torques } from "./case";

const HEEL_LANDS = "free heel lands";
/** [N] */
const PAPER_WEIGHT = 627;
/** [m] */
const HEAD_LIMIT = 1.2;

/** How far above or below the ice the toe's lowest point is [m]: the tolerance. */
const NEAR: Partial<Record<Accuracy, number>> = { balanced: 1e-6, reference: 1e-10 };
/** Distance of two samples of a height [s]. */
const SPACING = 1e-4;

/** Lowest value of a parabola by least squares through samples around the lowest one. */
function lowestOf(heights: number[]): number {
  const low = heights.indexOf(Math.min(...heights));
  const [a = NaN, b = NaN, c = NaN, d = NaN, e = NaN] = heights.slice(low - 2, low + 3);
  const square = (2 * a - b - 2 * c - d + 2 * e) / 14;
  const slope = (-2 * a - b + d + 2 * e) / 10;
  return (-3 * a + 12 * b + 17 * c + 12 * d - 3 * e) / 35 - slope ** 2 / (4 * square);
}

/** [s] */
const FLIGHT = 0.05;

/** Torques at both knees as long as a foot is on the ice. */
function jump(sim: Simulation): Float64Array<ArrayBuffer> {
  const all = new Float64Array(sim.description.coordinates.length - 3);
  if (sim.state().contactState !== 0) [all[1], all[4]] = [-400, 400];
  return all;
}

export const EVENTS: Record<string, Recipe> = {
  grazing: {
    actions: 15,
    measure(bench) {
      const free = bench.start(bench.edit(1));
      const heights = Array.from({ length: 201 }, (_, i) => {
        free.advance(0.09 + SPACING * i);
        return Math.min(...free.state().heights);
      });
      const near = NEAR[bench.accuracy] ?? Number.NaN;
      const lands = [near, -near].map((under) => {
        const sim = bench.start(bench.edit(0, { values: { "start.q.z0": 1 - lowestOf(heights) - under } }));
        sim.advance(0.15);
        return sim.state().events > 0;
      });
      return (lands[0] === true ? 0 : 1) + (lands[1] === false ? 0 : 1);
    },
  },
  heel_and_toe_at_once: {
    actions: 1,
    period: 0.013,
    measure(bench) {
      const [level, ...rotated] = bench.runs().map(end);
      if (level === undefined || level.events === 0) return Number.NaN;
      return Math.max(...rotated.map((other) => apart(other, level)));
    },
  },
  both_feet_at_once: {
    actions: 1,
    period: 0.015,
    measure(bench) {
      const ends = bench.runs().map(end);
      // Each level landing, and after it the two with a rotated foot.
      return Math.max(...ends.map((other, i) => {
        const level = ends[i - (i % 3)] as State;
        return given(level.events > 0, apart(other, level));
      }));
    },
  },
  rattling_sole: {
    actions: 5,
    measure: (bench) => Math.max(...bench.runs().map((run) => given(run.termination === null, end(run).events))),
  },
  event_at_the_start: {
    actions: 10,
    period: 1e-3,
    measure(bench) {
      const run = bench.run();
      return given(run.at(0).energyResidual < 1e-9, largest(run.states, depth));
    },
  },
  closer_than_a_step: {
    actions: 20,
    period: 1e-3,
    measure: (bench) => Math.max(...bench.runs().map((run) => given(run.termination === null, largest(run.states, depth)))),
  },
  event_at_the_end_of_a_call: {
    actions: 40,
    measure(bench) {
      const first = bench.start();
      first.advance(0.25);
      const time = first.takeEvents().find(({ what }) => what === HEEL_LANDS)?.t ?? Number.NaN;
      const whole = bench.start();
      whole.advance(time + 0.05);
      return Math.max(...[nextTo(time, -1), time, nextTo(time, 1)].map((until) => {
        const sim = bench.start();
        for (const at of [until, nextTo(until, 1), time + 0.05]) sim.advance(Math.max(at, sim.state().time));
        const landed = sim.takeEvents().filter(({ what }) => what === HEEL_LANDS).length;
        return given(landed === 1, apart(sim.state(), whole.state()));
      }));
    },
  },
  in_a_thousand_parts: {
    actions: 30,
    measure(bench) {
      const [whole, parts] = [bench.start(), bench.start()];
      whole.advance(0.3);
      const next = sequence(7);
      const lengths = Array.from({ length: 1000 }, () => 10 ** (10 * next() - 12));
      const sum = lengths.reduce((total, length) => total + length, 0);
      let until = 0;
      for (const length of lengths) {
        until += (0.3 * length) / sum;
        parts.advance(Math.min(until, 0.3));
      }
      parts.advance(Math.max(0.3, parts.state().time));
      const [seen, other] = [whole, parts].map((sim) => sim.takeEvents().map(({ t: _, ...event }) => JSON.stringify(event)));
      if (seen === undefined || other === undefined) return Number.NaN;
      const same = seen.filter((event, i) => event === other[i]).length;
      return Math.max(seen.length, other.length) - same;
    },
  },
  fall_on_the_limit: {
    actions: 300,
    measure(bench) {
      const sim = bench.after(3);
      return given(termination(sim) === "fall", Math.abs((sim.state().head[2] ?? 0) - HEAD_LIMIT));
    },
  },
  lift_off: {
    actions: 200,
    period: 1e-3,
    driver: { torques: jump },
    measure(bench) {
      const sim = bench.start();
      sim.hold(jump(sim));
      while (sim.state().contactState !== 0 && sim.state().time < 0.5) sim.advance(sim.state().time + 1e-3);
      const before = sim.state();
      sim.hold(jump(sim));
      sim.advance(before.time + FLIGHT);
      const after = sim.state();
      const flies = before.contactState === 0 && after.contactState === 0;
      return given(flies, Math.abs(after.speed - before.speed) * sim.description.mass);
    },
  },
  edge_of_the_sole: {
    actions: 400,
    period: 1e-3,
    driver: torques((part) => ({ 0: 100 * Math.sin((Math.PI * part) / 50) })),
    measure(bench) {
      const { states, events } = bench.run();
      const pull = ({ contactForces: f }: State) => -Math.min(f[2] ?? 0, f[3] ?? 0, f[6] ?? 0, f[7] ?? 0);
      const tips = events.filter(({ what }) => what.includes("lifts")).length;
      return given(tips >= 2, largest(states.slice(1), pull) / PAPER_WEIGHT);
    },
  },
};
