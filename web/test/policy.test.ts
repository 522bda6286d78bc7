// Policies in the page: the numbers of the Python package, and gaits where the baseline falls.
import { expect, test } from "vitest";
import { Policy } from "../src/policy";
import { Run } from "../src/run";
import { engine, read, text, toml } from "./files";

const loaded = await engine();
const bytes = (scene: string) => read(`skate_env/policies/${scene}.npz`);

// From Python: p = Policy.load(...); sim = Simulator(p.scene); five times sim.step(p.residual(sim)); the
// residuals at the start and at the end, and where the head is then.
const PYTHON: Record<string, { first: number[]; last: number[]; head: number[] }> = JSON.parse(text("web/test/policies.json"));

for (const [scene, expected] of Object.entries(PYTHON)) {
  test(`${scene}: torques and motion of the Python package`, async () => {
    const policy = await Policy.read(bytes(scene));
    const run = new Run(loaded, { toml: policy.scene }, [], policy);
    const close = (own: Iterable<number>, other: number[], tolerance: number) =>
      [...own].forEach((x, i) => expect(Math.abs(x - (other[i] ?? NaN))).toBeLessThan(tolerance));
    close(policy.residual(run.sim.observation()), expected.first, 1e-3);
    run.extend(5);
    close(policy.residual(run.sim.observation()), expected.last, 1e-2);
    close(run.at(5).head, expected.head, 1e-6);
  });
}

test("on ice that only pushes it skates on where the baseline falls", { timeout: 60_000 }, async () => {
  const policy = await Policy.read(bytes("push_only"));
  const edit = { toml: toml("push_only") };
  const [baseline, learned] = [new Run(loaded, edit), new Run(loaded, edit, [], policy)];
  for (const run of [baseline, learned]) run.extend(1500);
  expect(baseline.termination).toBe("fall");
  expect(learned.termination).toBe(null);
  expect(learned.at(1500).gaitSteps).toBeGreaterThan(10);
});

test("a kick after looking back gives the same bits with a policy, too", async () => {
  const policy = await Policy.read(bytes("push_only"));
  const [back, direct] = [[], [{ action: 77, speed: 0.3 }]].map((kicks) => new Run(loaded, { toml: policy.scene }, kicks, policy)) as [Run, Run];
  back.extend(120);
  back.kick(77, 0.3);
  for (const run of [back, direct]) run.extend(160);
  expect(back.states.map(({ q }) => loaded.checksum(q.slice()))).toEqual(direct.states.map(({ q }) => loaded.checksum(q.slice())));
});

/** An archive with so many entries, each of them the first one of `file`. */
function repeated(file: Uint8Array<ArrayBuffer>, entries: number): Uint8Array<ArrayBuffer> {
  const view = new DataView(file.buffer, file.byteOffset);
  const directory = view.getUint32(file.length - 6, true);
  const length = 46 + view.getUint16(directory + 28, true) + view.getUint16(directory + 30, true) + view.getUint16(directory + 32, true);
  const made = new Uint8Array(directory + entries * length + 22);
  made.set(file.subarray(0, directory));
  for (let i = 0; i < entries; i++) made.set(file.subarray(directory, directory + length), directory + i * length);
  made.set(file.subarray(-22), made.length - 22);
  new DataView(made.buffer).setUint16(made.length - 12, entries, true);
  return made;
}

test("a damaged file is refused", async () => {
  const file = bytes("paper_printed");
  for (const bad of [new Uint8Array(), file.slice(0, 2000), file.slice(500), new Uint8Array(100).fill(80)]) {
    await expect(Policy.read(bad)).rejects.toThrow(/not an \.npz file|not a policy/);
  }
  for (const [entries, message] of [[2, "two entries have the same name"], [65535, "at most 256 are possible"]] as const) {
    await expect(Policy.read(repeated(file, entries))).rejects.toThrow(message);
  }
  for (let i = 60; i < file.length; i += 997) {
    const bent = file.slice();
    bent[i] = (bent[i] ?? 0) ^ 0x55;
    await Policy.read(bent).catch((error: Error) => expect(error).toBeInstanceOf(Error));
  }
});
