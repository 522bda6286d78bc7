// Recordings of the Python package, whole and as packed into an HTML file; damaged ones are refused.
import { expect, test } from "vitest";
import { contactState } from "../src/contact";
import { openFile } from "../src/files";
import { Damaged } from "../src/npz";
import { poseOf } from "../src/pose";
import { type Receipt, verify } from "../src/receipt";
import { Recording } from "../src/recording";
import { engine, read, text } from "./files";

const whole = read("web/recording/recording.npz");
const html = text("web/recording/recording.html");
const packed = new Uint8Array(Buffer.from(/id="recording">([^<]*)</.exec(html)?.[1] ?? "", "base64"));
const [full, small] = await Promise.all([whole, packed].map((bytes) => Recording.read(bytes))) as [Recording, Recording];

test("the packed recording is the whole one, rounded to 0.07 mm and 0.04 N", () => {
  expect(small.last).toBe(full.last);
  expect(small.period).toBeCloseTo(0.01, 12);
  for (let i = 0; i <= full.last; i++) {
    const [a, b] = [full.at(i), small.at(i)];
    expect([b.time, b.contactState, b.supportLeg, b.gaitSteps]).toEqual([a.time, a.contactState, a.supportLeg, a.gaitSteps]);
    Array.from(a.links).forEach((x, k) => expect(Math.abs(x - (b.links[k] ?? NaN))).toBeLessThan(7e-5));
    Array.from(a.contactForces).forEach((x, k) => expect(Math.abs(x - (b.contactForces[k] ?? NaN))).toBeLessThan(0.04));
  }
});

test("a gait of three steps: legs alternate, and a flat foot is on the ice", () => {
  expect(full.at(full.last).gaitSteps).toBe(3);
  expect(full.termination).toBe(null);
  for (let i = 0; i <= full.last; i++) {
    const sample = small.at(i);
    const { support } = contactState(sample.contactState);
    if (support.slip === "air" || support.edge) continue;
    const { heel, toe } = poseOf(sample).legs[sample.supportLeg === "right" ? 0 : 1];
    expect(Math.abs(heel[2])).toBeLessThan(1e-6);
    expect(Math.abs(toe[2])).toBeLessThan(1e-6);
  }
});

test("the engine takes the recording's scene, and starts where the recording starts", async () => {
  const { toml, recording } = await openFile("recording.npz", whole);
  expect(recording).toBeInstanceOf(Recording);
  const sim = (await engine()).create({ toml });
  expect(sim.description.scene.name).toBe(small.fields?.name);
  expect(sim.description.scene.control.lifting).toMatchObject({ ...small.fields?.control.lifting });
  const [own, other] = [sim.state().links, full.at(0).links];
  own.forEach((x, k) => expect(Math.abs(x - (other[k] ?? NaN))).toBeLessThan(1e-6));
  sim.remove();
});

test("the motion has the bits of the native engine, and every change of it is found", async () => {
  const receipt = full.receipt as Receipt;
  const loaded = await engine();
  const count = full.last;
  expect(await verify(loaded, receipt)).toEqual({ actions: count, difference: null });
  expect(small.receipt).toBe(null);
  const with1 = (numbers: Float64Array, place: number, x: number) => Float64Array.from(numbers, (y, i) => (i === place ? x : y));
  const { q, actions } = receipt;
  const n = q.length / (count + 1);
  const bent = await verify(loaded, { ...receipt, q: with1(q, 20 * n + 7, (q[20 * n + 7] ?? 0) + 1e-15) });
  expect(bent.difference).toMatch(/^q6 at .* s: recorded .*, now /);
  expect(bent.actions).toBe(20);
  expect((await verify(loaded, { ...receipt, actions: with1(actions, 5, 1e-6) })).actions).toBe(1);
  expect((await verify(loaded, { ...receipt, checksum: "0" })).difference).toMatch(/^the checksum of/);
  await expect(verify(loaded, { ...receipt, start: receipt.start.slice(1) })).rejects.toThrow("snapshot");
});

test("truncated files are refused; a changed byte is refused or changes nothing", async () => {
  const bad = [new Uint8Array(), new Uint8Array(500).fill(80), packed.slice(100), read("web/package.json")];
  for (const share of [0.1, 0.5, 0.9, 0.999]) bad.push(packed.slice(0, Math.floor(share * packed.length)));
  for (const bytes of bad) await expect(openFile("x.npz", bytes)).rejects.toThrow(Damaged);
  const numbers = ({ last, ...rest }: Recording) => JSON.stringify([last, rest]);
  const places = Array.from({ length: 200 }, (_, i) => Math.floor((i * packed.length) / 200));
  for (const place of places) {
    const bent = packed.slice();
    bent[place] = (bent[place] ?? 0) ^ 0x10;
    // Changed times and attributes of the archive's entries do not matter.
    const found = await Recording.read(bent).catch((error: unknown) => error);
    if (found instanceof Recording) expect(numbers(found)).toBe(numbers(small));
    else expect(found).toBeInstanceOf(Damaged);
  }
});

test("a policy is no recording, and other archives are neither", async () => {
  await expect(Recording.read(read("skate_env/policies/paper_printed.npz"))).rejects.toThrow("metadata is missing");
  expect((await openFile("paper_printed.npz", read("skate_env/policies/paper_printed.npz"))).policy).toBeDefined();
});
