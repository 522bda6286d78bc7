// Hard cases: the page plays their scenes; torques bring six of them into their situation.
import { expect, test } from "vitest";
import { CASES, playOf } from "../src/cases";
import { Run } from "../src/run";
import { engine } from "./files";

const loaded = await engine();

function play(name: string, actions: number): Run {
  const hard = CASES.find((each) => each.name === name)!;
  const { values, driver } = playOf(hard);
  const run = new Run(loaded, { toml: hard.scene!, values }, [], driver);
  run.extend(actions);
  return run;
}

// tests/test_web_catalogue.py compares the list with that of the Python package.
const played = CASES.filter(({ scene }) => scene !== null);

test.each(played.map(({ name }) => name))("%s starts", (name) => {
  const run = play(name, 2);
  expect(run.last).toBeGreaterThan(0);
  run.remove();
});

const changes = ({ states }: Run) => states.filter(({ contactState }, i) => i > 0 && contactState !== states[i - 1]?.contactState).length;
/** One leg stands flat without sliding. */
const STICKS = 1;

const SITUATIONS: Record<string, [actions: number, reached: (run: Run) => boolean]> = {
  no_creep: [10, ({ states }) => states.every(({ contactState }) => contactState === STICKS)],
  reversal: [40, ({ states }) => [-1, 1].every((sign) => states.some(({ v }) => Math.sign(v[0] ?? 0) === sign))],
  through_straight: [20, ({ states, sim }) => states.some(({ q }) => Math.abs(q[sim.description.coordinates.indexOf("q3")] ?? 0) > 0.05)],
  edge_of_the_sole: [400, (run) => run.at(0).contactState === STICKS && changes(run) > 10],
  legs_take_turns: [100, (run) => changes(run) > 10],
  lift_off: [100, ({ states }) => states.some(({ contactState }) => contactState === 0)],
};

test.each(Object.entries(SITUATIONS))("%s reaches its situation", (name, [actions, reached]) => {
  const run = play(name, actions);
  expect(reached(run)).toBe(true);
  run.remove();
});
