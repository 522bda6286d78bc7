// 100 gait steps of every preset have the bits of the native engine.
import { expect, test } from "vitest";
import { ACCURACIES } from "../src/engine";
import { PRESETS, engine, read, toml } from "./files";
import { type Replay, STEPS, replay } from "./replay";

const native = JSON.parse(new TextDecoder().decode(read("web/native.json"))) as Record<string, Replay>;
const loaded = await engine();

for (const preset of PRESETS) {
  for (const accuracy of ACCURACIES) {
    test(`${preset} ${accuracy}`, { timeout: 300_000 }, () => {
      const { seconds, ...own } = replay(loaded, toml(preset), accuracy, STEPS);
      const { seconds: nativeSeconds, ...expected } = native[`${preset} ${accuracy}`]!;
      const speed = (own.time / seconds).toFixed(0);
      console.log(`${preset} ${accuracy}: ${speed} times real time, native ${(seconds / nativeSeconds).toFixed(2)} times as fast`);
      expect(own).toEqual(expected);
    });
  }
}
