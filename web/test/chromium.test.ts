// 100 gait steps of every preset, and of the scenes of studies, have the bits of the native engine in Chromium, too.
import { fileURLToPath } from "node:url";
import { afterAll, beforeAll, expect, test } from "vitest";
import { type Browser, type Page } from "playwright-core";
import { type ViteDevServer, createServer } from "vite";
import { launch } from "./browser";
import { SCENES, native, toml } from "./files";
import type { Replay } from "./replay";

const expectedOf = native();
let server: ViteDevServer;
let browser: Browser;
let page: Page;

beforeAll(async () => {
  const root = fileURLToPath(new URL("../", import.meta.url));
  server = await createServer({ root, appType: "mpa", server: { port: 0, host: "127.0.0.1" }, logLevel: "error" });
  await server.listen();
  browser = await launch();
  page = await browser.newPage();
  // Any file of the server will do: it may import the sources.
  await page.goto(new URL("package.json", server.resolvedUrls?.local[0]).href);
}, 60_000);

afterAll(async () => {
  await browser.close();
  await server.close();
});

for (const scene of SCENES) {
  for (const accuracy of ["fast", "balanced"] as const) {
    test(`${scene} ${accuracy}`, { timeout: 120_000 }, async () => {
      // A text, because Vitest would rewrite the imports of a function.
      const { seconds, ...own } = (await page.evaluate(`(async () => {
        const { Engine } = await import("/src/engine.ts");
        const { STEPS, replay } = await import("/test/replay.ts");
        const engine = await Engine.load(await (await fetch("/engine.wasm")).arrayBuffer());
        return replay(engine, ${JSON.stringify(toml(scene))}, "${accuracy}", STEPS);
      })()`)) as Replay;
      const { seconds: nativeSeconds, ...expected } = expectedOf[`${scene} ${accuracy}`]!;
      const speed = (own.time / seconds).toFixed(0);
      // The clock of the browser has steps of 0.1 ms.
      if (seconds > 2e-3) console.log(`${scene} ${accuracy}: ${speed} times real time, native ${(seconds / nativeSeconds).toFixed(2)} times as fast`);
      expect(own).toEqual(expected);
    });
  }
}
