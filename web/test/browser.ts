// The built page in headless Chromium.
import { existsSync, mkdirSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { type Browser, type Page, chromium } from "playwright-core";
import { type PreviewServer, preview } from "vite";

const CHROMIUM = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"]
  .find((path) => path !== undefined && existsSync(path));
const SHOTS = fileURLToPath(new URL("shots/", import.meta.url));

export function launch(): Promise<Browser> {
  if (CHROMIUM === undefined) throw new Error("no Chromium: install it, or name it in CHROMIUM");
  // Software drawing: test machines have no graphics card.
  const args = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"];
  return chromium.launch({ executablePath: CHROMIUM, args });
}

export class Visit {
  private constructor(
    readonly server: PreviewServer,
    readonly browser: Browser,
    readonly address: string,
  ) {}

  static async begin(): Promise<Visit> {
    mkdirSync(SHOTS, { recursive: true });
    const root = fileURLToPath(new URL("../", import.meta.url));
    const server = await preview({ root, preview: { port: 0, host: "127.0.0.1" }, logLevel: "error" });
    const browser = await launch();
    return new Visit(server, browser, server.resolvedUrls?.local[0] ?? "");
  }

  /** Open the page at a state of its address. `errors` collects what the console reports. */
  async open(hash = "", size = { width: 1280, height: 800 }): Promise<{ page: Page; errors: string[] }> {
    const page = await this.browser.newPage({ viewport: size });
    const errors: string[] = [];
    page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
    page.on("pageerror", (error) => errors.push(error.message));
    await page.goto(`${this.address}#${hash}`);
    await page.waitForSelector("html[data-ready]");
    return { page, errors };
  }

  async end(): Promise<void> {
    await this.browser.close();
    await this.server.close();
  }
}

export async function shoot(page: Page, name: string): Promise<void> {
  await page.screenshot({ path: `${SHOTS}${name}.png` });
}
