// All hard cases of the Python package; most of them run in the page.
import type { Accuracy, Engine } from "../engine";
import { Bench, type Entry, type HardCase, type Recipe } from "./case";
import catalogue from "./catalogue.json";
import { CONTROLLERS } from "./controllers";
import { EVENTS } from "./events";
import { FORCES } from "./forces";
import { FRICTION } from "./friction";
import { INPUT } from "./input";
import { INVARIANCES } from "./invariances";
import { LONG } from "./long";
import { STIFFNESS } from "./stiffness";

const RECIPES: Record<string, Recipe> = {
  ...FORCES, ...FRICTION, ...EVENTS, ...CONTROLLERS, ...STIFFNESS, ...INPUT, ...LONG, ...INVARIANCES,
};

export const CASES: readonly HardCase[] = (catalogue as Entry[]).map((entry) => ({ ...entry, recipe: RECIPES[entry.name] ?? null }));

/** The measured value of a case that the page runs; NaN where there is no number. */
export function judge(engine: Engine, name: string, accuracy: Accuracy): number {
  const hard = CASES.find((each) => each.name === name);
  if (hard === undefined || hard.recipe === null || hard.limits[accuracy] === null) return Number.NaN;
  const bench = new Bench(engine, hard, accuracy);
  try {
    return hard.recipe.measure(bench);
  } finally {
    bench.remove();
  }
}
