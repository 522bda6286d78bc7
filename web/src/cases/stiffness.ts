// Stiff and extreme scenes: skate_env/studies/hardcases/stiffness.py.
import type { Run } from "../run";
import { type Recipe, end, energy, finite, gap, given, largest, unaccounted } from "./case";

/** Largest unaccounted energy over the total energy at the start. */
function inTotal(run: Run): number {
  const start = run.at(0);
  const whole = Math.abs(energy(start)) + start.kineticEnergy;
  return given(run.termination === null, largest(run.states.slice(1), (state) => Math.abs(state.energyResidual) / whole));
}

/** Angles that start this number of revolutions further. */
const TURNS: Record<string, number> = { q5: 1000, q6: -1000, q11: 1000, q12: 500 };

export const STIFFNESS: Record<string, Recipe> = {
  strong_damping: {
    actions: 10,
    period: 0.05,
    measure(bench) {
      const run = bench.run();
      const energies = run.states.map(energy);
      const gained = energies.slice(1).map((now, i) => now - (energies[i] ?? Number.NaN));
      return given(run.termination === null, Math.max(0, ...gained));
    },
  },
  stiff_head: {
    actions: 10,
    scene: 1,
    measure(bench) {
      const run = bench.run();
      const height = run.sim.description.scene.control.lifting?.height ?? Number.NaN;
      return given(run.termination === null, largest(run.states.slice(1), ({ head }) => Math.abs((head[2] ?? 0) - height)));
    },
  },
  stiff_gait: {
    actions: 30,
    measure(bench) {
      const run = bench.run();
      return given(run.termination === null, unaccounted(run));
    },
  },
  knee_stop: {
    actions: 50,
    period: 0.002,
    measure(bench) {
      const run = bench.run();
      const knee = run.sim.description.coordinates.indexOf("q6");
      const stopped = run.states.some(({ v }) => (v[knee] ?? 0) < 0);
      return given(stopped && run.termination === null, unaccounted(run));
    },
  },
  violent_starts: {
    actions: 2,
    measure(bench) {
      const good = (run: Run) => [end(run).q, end(run).v].every((list) => list.every(Number.isFinite)) && (finite(end(run)) || run.termination !== null);
      return bench.runs().filter((run) => !good(run)).length;
    },
  },
  mass_ratios: { actions: 10, measure: (bench) => Math.max(...bench.runs().map(inTotal)) },
  odd_lengths: { actions: 10, measure: (bench) => Math.max(...bench.runs().map(inTotal)) },
  far_away: {
    actions: 20,
    measure(bench) {
      const [near, far] = bench.runs().map(end);
      return near === undefined || far === undefined ? Number.NaN : Math.max(gap(near.q.subarray(1), far.q.subarray(1)), gap(near.v, far.v));
    },
  },
  many_turns: {
    actions: 5,
    measure(bench) {
      const plain = bench.run();
      const names = plain.sim.description.coordinates;
      const turns = Float64Array.from(names, (name) => 2 * Math.PI * (TURNS[name] ?? 0));
      const starts = names.map((name, i) => [`start.q.${name}`, (plain.at(0).q[i] ?? 0) + (turns[i] ?? 0)] as const);
      const turned = bench.run(0, { values: Object.fromEntries(starts.filter((_, i) => turns[i] !== 0)) });
      return Math.max(gap(end(turned).q.map((x, i) => x - (turns[i] ?? 0)), end(plain).q), gap(end(turned).v, end(plain).v));
    },
  },
  no_weight_and_much: {
    actions: 20,
    measure(bench) {
      const [heavy, light] = bench.runs();
      if (heavy === undefined || light === undefined) return Number.NaN;
      const residual = (run: Run) => largest(run.states.slice(1), (state) => Math.abs(state.energyResidual));
      const moving = largest(light.states.slice(1), ({ kineticEnergy }) => kineticEnergy);
      const whole = Math.max(1, Math.abs(energy(heavy.at(0))), Math.abs(energy(light.at(0))));
      const ended = heavy.termination ?? light.termination;
      return given(ended === null, Math.max(residual(heavy), residual(light), moving) / whole);
    },
  },
};
