// Long simulations: skate_env/studies/hardcases/long_runs.py.
import type { State } from "../engine";
import type { Run } from "../run";
import { type Recipe, end, given, largest } from "./case";

const STEPS = 100;
/** Longest time of 100 steps [actions]. */
const ACTIONS = 20_000;
/**
 * Presets that may fall before. `push_only` does; the gait of `blade` is chaotic: of 60 native runs at `reference` from
 * starts that differ by 1e-13 rad one falls, and with the sines of this engine 2 of 14.
 */
const FALLING = new Set(["push_only", "blade"]);
const madeAll = ({ gaitSteps }: State) => gaitSteps >= STEPS;

/** Largest unaccounted energy of a gait step in the largest kinetic energy. */
function energyOfSteps({ states, last }: Run): number {
  let [before, worst] = [0, 0];
  states.forEach((state, i) => {
    const done = i > 0 && state.gaitSteps > (states[i - 1]?.gaitSteps ?? 0);
    if (!done && i < last) return;
    worst = Math.max(worst, Math.abs(state.energyResidual - before));
    before = state.energyResidual;
  });
  return worst / largest(states, ({ kineticEnergy }) => kineticEnergy);
}

function gait(preset: string): [string, Recipe][] {
  const recipe = (measure: (run: Run) => number): Recipe => ({
    actions: ACTIONS,
    until: madeAll,
    measure(bench) {
      const run = bench.run();
      const falls = FALLING.has(preset) && run.termination !== null;
      return given(falls || madeAll(end(run)), measure(run));
    },
  });
  return [
    [`energy_of_${preset}`, recipe(energyOfSteps)],
    [`drift_of_${preset}`, recipe(({ states }) => largest(states, ({ violation }) => violation))],
  ];
}

export const LONG: Record<string, Recipe> = {
  ...Object.fromEntries(["paper", "paper_printed", "paper_damped", "paper_arms", "blade", "push_only"].flatMap(gait)),
  standing_still: {
    actions: 500,
    measure(bench) {
      const run = bench.run();
      return given(run.termination === null, Math.abs(end(run).q[0] ?? Number.NaN));
    },
  },
};
