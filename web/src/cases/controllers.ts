// Controllers that are sampled fast or make contacts alternate: skate_env/studies/hardcases/controllers.py.
import { type Recipe, end, given, torques } from "./case";

export const CONTROLLERS: Record<string, Recipe> = {
  hasty_controller: {
    actions: 10,
    scene: 1,
    measure(bench) {
      const [slow, fast] = [bench.after(0.1, 0).state(), bench.after(0.1, 1).state()];
      return given(slow.termination === 0 && fast.termination === 0, fast.evaluations / slow.evaluations);
    },
  },
  legs_take_turns: {
    actions: 300,
    period: 1e-3,
    driver: torques((part) => ({ 0: 60 * (-1) ** part, 5: -60 * (-1) ** part })),
    measure(bench) {
      const run = bench.run(0);
      const gait = bench.after(1, 1).state();
      const usual = gait.evaluations / gait.time;
      return given([null, "fall"].includes(run.termination), end(run).evaluations / end(run).time / usual);
    },
  },
};
