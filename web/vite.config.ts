import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { defineConfig } from "vitest/config";

/** The notice of the one library in the page; `licences.txt` has those of the engine, too. */
export const notice = readFileSync(new URL("node_modules/three/LICENSE", import.meta.url), "utf8").trim();

/** The page is part of the Python package, whose command `skate-env view` serves it. */
export const built = fileURLToPath(new URL("../skate_env/web", import.meta.url));
export const TARGET = "es2023";

export default defineConfig({
  // Relative addresses: the page works in any folder of a server.
  base: "./",
  build: {
    outDir: built,
    emptyOutDir: true,
    target: TARGET,
    chunkSizeWarningLimit: 1000,
    rolldownOptions: { output: { postBanner: `/*! With three.js:\n${notice}\n*/` } },
  },
  test: { include: ["test/*.test.ts"], fileParallelism: false, hookTimeout: 60_000 },
});
