import { fileURLToPath } from "node:url";
import { defineConfig } from "vitest/config";

/** The page is part of the Python package, whose command `skate-env view` serves it. */
export const built = fileURLToPath(new URL("../skate_env/web", import.meta.url));
export const TARGET = "es2023";

export default defineConfig({
  // Relative addresses: the page works in any folder of a server.
  base: "./",
  build: { outDir: built, emptyOutDir: true, target: TARGET, chunkSizeWarningLimit: 1000 },
  test: { include: ["test/*.test.ts"], fileParallelism: false, hookTimeout: 60_000 },
});
