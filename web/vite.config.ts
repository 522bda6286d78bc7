import { defineConfig } from "vitest/config";

export default defineConfig({
  // Relative addresses: the page works in any folder of a server.
  base: "./",
  build: { target: "es2023", chunkSizeWarningLimit: 1000 },
  test: { include: ["test/*.test.ts"], fileParallelism: false, hookTimeout: 60_000 },
});
