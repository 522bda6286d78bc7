// Hard cases: below their limits, and the values of the Python package.
import { expect, test } from "vitest";
import { hardCases, judge } from "../src/cases";
import { ACCURACIES, type Accuracy } from "../src/engine";
import { engine, toml } from "./files";

const loaded = await engine();

// Measured by `skate-env hardcases`, native, without the feature portable-math.
const PYTHON: Record<string, Record<Accuracy, number>> = {
  no_creep: { fast: 0, balanced: 0, reference: 0 },
  reversal: { fast: 3.2831e-4, balanced: 2.8433e-8, reference: 1.3499e-13 },
  standing_still: { fast: 0, balanced: 0, reference: 0 },
  subnormal_speed: { fast: 2.5e-33, balanced: 9.9849e-14, reference: 2.9698e-15 },
  no_friction: { fast: Number.NaN, balanced: 3.2453e-8, reference: 1.2197e-12 },
  capture: { fast: Number.NaN, balanced: 2.2501e-7, reference: 2.8230e-11 },
  stiff_head: { fast: 1.1427e-6, balanced: 7.2166e-7, reference: 7.2817e-7 },
};

for (const hard of hardCases(toml("blade"))) {
  for (const accuracy of ACCURACIES) {
    test(`${hard.name} ${accuracy}`, { timeout: 60_000 }, () => {
      const { measured, limit } = judge(loaded, hard, accuracy);
      const python = PYTHON[hard.name]![accuracy];
      if (limit === null) return expect(python).toBeNaN();
      expect(measured).toBeLessThanOrEqual(limit);
      // Rounding decides the small ones.
      if (python > 1e-9) expect(Math.abs(measured / python - 1)).toBeLessThan(0.02);
      else expect(measured).toBeLessThanOrEqual(Math.max(100 * python, 0));
    });
  }
}
