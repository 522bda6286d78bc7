// A run is the same motion however it was reached, and the engine refuses what is not valid.
import { expect, test } from "vitest";
import { type Engine, Refused } from "../src/engine";
import { compare, costs } from "../src/measure";
import { Run } from "../src/run";
import { engine, toml } from "./files";

const loaded = await engine();

function sums(run: Run): string[] {
  return run.states.map((state) => loaded.checksum(new Float64Array([...state.q, ...state.v])));
}

test("a kick after looking back gives the bits of a run with that kick", () => {
  for (const preset of ["paper_printed", "push_only", "blade"]) {
    const back = new Run(loaded, { toml: toml(preset) });
    back.kick(20, 0.1);
    back.extend(170);
    back.kick(133, -0.4);
    back.extend(200);
    const direct = new Run(loaded, { toml: toml(preset) }, [{ action: 20, speed: 0.1 }, { action: 133, speed: -0.4 }]);
    direct.extend(200);
    expect(sums(back), preset).toEqual(sums(direct));
    expect(back.kicks).toEqual(direct.kicks);
  }
});

test("looking back without a kick gives the first motion again", () => {
  const run = new Run(loaded, { toml: toml("paper_printed") });
  run.extend(120);
  const before = sums(run);
  run.kick(60, 0);
  run.extend(120);
  expect(sums(run)).toEqual(before);
});

test("a run ends at a fall", () => {
  const run = new Run(loaded, { toml: toml("push_only") });
  run.extend(1e4);
  expect(run.termination).toBe("fall");
  expect(run.at(run.last).time).toBeLessThan(6);
});

test("changes of a scene arrive in it", () => {
  const sim = loaded.create({
    toml: toml("paper_printed"),
    effects: [["coulomb_friction", true], ["arms", false]],
    values: { "ice.gravity": 1.62 },
    accuracy: "reference",
  });
  const { effects, parameters, coordinates, scene } = sim.description;
  expect(effects.find(({ name }) => name === "coulomb_friction")?.on).toBe(true);
  expect(effects.find(({ name }) => name === "arms")?.on).toBe(false);
  expect(coordinates).toHaveLength(13);
  expect(parameters.find(({ name }) => name === "ice.gravity")?.value).toBe(1.62);
  expect(scene.name).toBe("paper_printed");
  sim.remove();
});

const REFUSED: [string, (engine: Engine) => void, RegExp][] = [
  ["no scene", (engine) => engine.create({ toml: "name = 3" }), /name/],
  ["no number", (engine) => engine.create({ toml: "", values: { "ice.gravity": Number.NaN } }), /not an edit/],
  ["too much gravity", (engine) => engine.create({ toml: "", values: { "ice.gravity": 1e9 } }), /ice.gravity = .*must lie in \[0, 100\] m\/s2/],
  ["an unknown number", (engine) => engine.create({ toml: "", values: { "ice.age": 1 } }), /ice.age/],
  ["an unknown effect", (engine) => engine.create({ toml: "", effects: [["magic", true]] }), /"magic": unknown/],
  ["an unknown accuracy", (engine) => engine.create({ toml: "", accuracy: "perfect" as "fast" }), /must be fast, balanced/],
  ["a kick too strong", (engine) => engine.create({ toml: toml("paper_printed") }).kick(11), /must lie in \[-10, 10\] m\/s/],
  ["a kick that is no number", (engine) => engine.create({ toml: toml("paper_printed") }).kick(Number.NaN), /speed/],
  ["a damaged snapshot", (engine) => engine.create({ toml: toml("paper_printed") }).restore(new Uint8Array(100)), /not a snapshot/],
  ["the snapshot of another scene", (engine) => engine.create({ toml: toml("blade") }).restore(engine.create({ toml: toml("paper_printed") }).snapshot()), /not a snapshot of this scene/],
  ["too few torques", (engine) => engine.create({ toml: toml("paper_printed") }).hold(new Float64Array(3)), /3 residual torques/],
  ["an infinite torque", (engine) => engine.create({ toml: toml("paper_printed") }).hold(new Float64Array(16).fill(Infinity)), /residual torque/],
  ["no simulation", (engine) => { const sim = engine.create({ toml: "" }); sim.remove(); sim.step(); }, /no simulation/],
];

for (const [name, task, message] of REFUSED) {
  test(`the engine refuses ${name}, and goes on`, () => {
    expect(() => task(loaded)).toThrowError(Refused);
    expect(() => task(loaded)).toThrowError(message);
    const sim = loaded.create({ toml: toml("paper_printed") });
    expect(sim.step(3)).toBe(3);
    sim.remove();
  });
}

test("a residual torque changes the motion, zero does not", () => {
  const after = (torque: number) => {
    const sim = loaded.create({ toml: toml("paper_printed") });
    sim.hold(new Float64Array(16).fill(torque));
    sim.step(20);
    const sum = loaded.checksum(sim.state().q.slice());
    sim.remove();
    return sum;
  };
  const plain = loaded.create({ toml: toml("paper_printed") });
  plain.step(20);
  expect(after(0)).toBe(loaded.checksum(plain.state().q.slice()));
  expect(after(5)).not.toBe(after(0));
});

test("costs and errors of accuracies are in order", () => {
  const [full, without] = costs(loaded, [{ toml: toml("paper_printed") }, { toml: toml("paper_printed"), effects: [["arms", false]] }]);
  expect(full?.perSecond).toBeGreaterThan(1e4);
  expect(full?.evaluationsPerAction).toBeGreaterThan(1);
  expect(without?.perSecond).toBeGreaterThan(1e4);
  const [fast, balanced, reference] = compare(loaded, { toml: toml("paper_printed") }, [], 20);
  expect(fast?.cost.evaluationsPerAction).toBeLessThan(balanced!.cost.evaluationsPerAction);
  expect(balanced?.cost.evaluationsPerAction).toBeLessThan(reference!.cost.evaluationsPerAction);
  expect(balanced?.errors.at(-1)).toBeLessThan(1e-5);
  expect(fast?.errors.at(-1)).toBeGreaterThan(balanced!.errors.at(-1)!);
  expect(reference?.errors.at(-1)).toBe(0);
});
