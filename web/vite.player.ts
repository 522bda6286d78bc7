// Builds player.html: one file with its program inside, and a place for the recording.
import { readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { type Plugin, defineConfig } from "vite";
import { TARGET, built } from "./vite.config.ts";

const template = new URL("player.html", import.meta.url);

function inOneFile(): Plugin {
  return {
    name: "in-one-file",
    generateBundle(_, bundle) {
      const [program] = Object.values(bundle);
      if (program?.type !== "chunk" || Object.keys(bundle).length !== 1) throw new Error("the player must be one program");
      delete bundle[program.fileName];
      const packed = gzipSync(program.code, { level: 9 }).toString("base64");
      const source = readFileSync(template, "utf8").replace("%PROGRAM%", () => packed);
      this.emitFile({ type: "asset", fileName: "player.html", source });
    },
  };
}

export default defineConfig({
  plugins: [inOneFile()],
  publicDir: false,
  build: {
    outDir: built,
    emptyOutDir: false,
    target: TARGET,
    lib: { entry: "src/player.ts", formats: ["iife"], name: "player" },
    chunkSizeWarningLimit: 1000,
  },
});
