// Builds player.html: one file with its program inside, and a place for the recording.
import { readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { type Plugin, defineConfig } from "vite";
import { TARGET, built, notice } from "./vite.config.ts";

const read = (name: string) => readFileSync(new URL(name, import.meta.url), "utf8");

/** The picture and its controls as in the page, without the elements that need the engine, one in a line. */
function stage(): string {
  const [found] = /<section id="stage"[^]*?<\/section>/.exec(read("index.html")) ?? [];
  if (found === undefined) throw new Error("index.html has no stage");
  return found.replace(/^.* data-engine .*\n/gm, "");
}

function inOneFile(): Plugin {
  return {
    name: "in-one-file",
    generateBundle(_, bundle) {
      const [program] = Object.values(bundle);
      if (program?.type !== "chunk" || Object.keys(bundle).length !== 1) throw new Error("the player must be one program");
      delete bundle[program.fileName];
      const packed = gzipSync(program.code, { level: 9 }).toString("base64");
      const source = read("player.html").replace("%STAGE%", stage).replace("%PROGRAM%", () => packed).replace("%NOTICE%", notice);
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
