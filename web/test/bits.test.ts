// 100 gait steps of every preset, and of the scenes of studies, have the bits of the native engine.
import { expect, test } from "vitest";
import { ACCURACIES } from "../src/engine";
import { SCENES, engine, native, toml } from "./files";
import { STEPS, replay } from "./replay";

const expectedOf = native();
const loaded = await engine();

for (const scene of SCENES) {
  for (const accuracy of ACCURACIES) {
    test(`${scene} ${accuracy}`, { timeout: 300_000 }, () => {
      const { seconds, ...own } = replay(loaded, toml(scene), accuracy, STEPS);
      const { seconds: nativeSeconds, ...expected } = expectedOf[`${scene} ${accuracy}`]!;
      const speed = (own.time / seconds).toFixed(0);
      console.log(`${scene} ${accuracy}: ${speed} times real time, native ${(seconds / nativeSeconds).toFixed(2)} times as fast`);
      expect(own).toEqual(expected);
    });
  }
}
