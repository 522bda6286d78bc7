// Every control of the page, in headless Chromium; pictures go to test/shots.
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { CASES } from "../src/cases";
import { Visit, shoot } from "./browser";
import { PRESETS } from "./files";

let visit: Visit;
beforeAll(async () => { visit = await Visit.begin(); }, 60_000);
afterAll(() => visit.end());

const number = async (page: Page, id: string) => Number(await page.textContent(`#${id}`));
const until = (page: Page, script: string) => page.waitForFunction(script, undefined, { timeout: 20_000, polling: 50 });
const shown = (page: Page, id: string) => page.isVisible(`#${id}`);

/** Open the page, use it, and expect that the console has no errors. */
function visiting(name: string, hash: string, use: (page: Page) => Promise<void>, size?: { width: number; height: number }): void {
  test(name, { timeout: 90_000 }, async () => {
    const { page, errors } = await visit.open(hash, size);
    await use(page);
    expect(errors).toEqual([]);
    await page.close();
  });
}

visiting("starts within a second and skates", "", async (page) => {
  const start = Number(await page.getAttribute("html", "data-start-time"));
  console.log(`started after ${start} ms`);
  expect(start).toBeLessThan(3000);
  await until(page, "Number(document.getElementById('time').textContent) > 0.5");
  await until(page, "document.getElementById('rates').textContent.includes('times real time')");
  console.log(await page.textContent("#rates"));
});

visiting("play, pause, single steps, start, end of the recording", "play=0&action=20", async (page) => {
  await until(page, "document.getElementById('time').textContent === '0.20'");
  await page.click("#forward");
  await until(page, "document.getElementById('time').textContent === '0.21'");
  await page.click("#back");
  await page.click("#back");
  await until(page, "document.getElementById('time').textContent === '0.19'");
  await page.click("#play");
  expect(await page.textContent("#play")).toBe("pause");
  await until(page, "Number(document.getElementById('time').textContent) > 0.4");
  await page.click("#play");
  const time = await number(page, "time");
  await page.waitForTimeout(300);
  expect(await number(page, "time")).toBe(time);
  await page.click("#restart");
  await until(page, "Number(document.getElementById('time').textContent) < 0.4");
});

visiting("scrub bar and strip", "play=0", async (page) => {
  await page.locator("#scrub").fill("150");
  await until(page, "document.getElementById('time').textContent === '1.50'");
  await page.click("#strip", { position: { x: 200, y: 30 } });
  await until(page, "document.getElementById('time').textContent !== '1.50'");
  await shoot(page, "strip");
});

visiting("slow motion and other speeds", "speed=0.1", async (page) => {
  const before = await number(page, "time");
  await page.waitForTimeout(1500);
  const slow = (await number(page, "time")) - before;
  expect(slow).toBeLessThan(0.3);
  await page.selectOption("#speed", "2");
  await page.waitForTimeout(1500);
  expect((await number(page, "time")) - before - slow).toBeGreaterThan(slow);
});

visiting("presets", "play=0", async (page) => {
  expect(await page.locator(".preset").allTextContents()).toEqual(PRESETS);
  for (const preset of PRESETS.toReversed()) {
    await page.click(`.preset:text-is("${preset}")`);
    expect(await page.getAttribute(`.preset:text-is("${preset}")`, "aria-pressed")).toBe("true");
    await until(page, "Number(document.getElementById('time').textContent) > 0.2");
    await shoot(page, `preset-${preset}`);
  }
});

visiting("a fall ends the motion", "scene=push_only&play=0&action=9999", async (page) => {
  await until(page, "!document.getElementById('ending').hidden");
  const ending = (await page.textContent("#ending"))!.match(/^ended: fall at (\d+\.\d\d) s$/);
  // The time of the last action's end is shown.
  const shownTime = await number(page, "time");
  expect(Number(ending?.[1])).toBeGreaterThan(shownTime - 0.011);
  expect(Number(ending?.[1])).toBeLessThanOrEqual(shownTime + 0.005);
  await shoot(page, "fall");
  await page.keyboard.press("k");
  await until(page, "document.getElementById('messages').textContent.includes('has ended')");
  await page.click("#play");
  await until(page, "Number(document.getElementById('time').textContent) < 5");
});

visiting("sliders, numbers, and how to undo them", "play=0", async (page) => {
  const slider = page.locator('[data-name="ice.gravity"] input');
  await slider.fill("2");
  await until(page, "document.getElementById('changes').textContent.includes('ice.gravity = 2')");
  expect(await page.textContent('[data-name="ice.gravity"] output')).toBe("2 m/s²");
  await page.click("#numbers-panel summary:text('All numbers')");
  await page.fill("#filter", "head.mass");
  // On a busy machine the event of the opened list comes after the focus.
  await page.locator(".number input").selectText();
  await page.dispatchEvent("#numbers-panel details", "toggle");
  await page.keyboard.insertText("6");
  await page.locator(".number input").blur();
  await until(page, "document.getElementById('changes').textContent.includes('body.head.mass = 6')");
  await page.fill(".number input", "1e9");
  await page.locator(".number input").blur();
  await until(page, "document.getElementById('messages').textContent.includes('body.head.mass')");
  await shoot(page, "refused");
  await page.click("#messages button");
  expect(await shown(page, "messages")).toBe(false);
  await page.click("#reset");
  await until(page, "document.getElementById('changes').textContent === ''");
});

visiting("effects and their cost", "scene=paper_printed&play=0", async (page) => {
  await page.click("#effects-panel > summary");
  await until(page, "document.getElementById('scene-cost').textContent.includes('evaluations/s')");
  await page.uncheck('[data-name="arms"] input');
  await until(page, "document.getElementById('changes').textContent.includes('arms off')");
  await page.waitForTimeout(4000);
  await page.locator("#effects-panel").scrollIntoViewIfNeeded();
  await shoot(page, "effects");
  await page.click('[data-name="push_only"] input');
  await until(page, "document.getElementById('messages').textContent.includes('below the ice')");
  expect(await page.isChecked('[data-name="push_only"] input')).toBe(false);
});

visiting("accuracy, its error and its cost", "action=150&play=0", async (page) => {
  await page.click("#accuracy-panel > summary");
  await until(page, "/^[\\d.e-]+$/.test(document.querySelector('[data-name=balanced] td').textContent)");
  const error = Number(await page.textContent("[data-name=balanced] td"));
  expect(error).toBeGreaterThan(1e-12);
  expect(error).toBeLessThan(1e-3);
  await page.locator("#accuracy-panel").scrollIntoViewIfNeeded();
  await shoot(page, "accuracy");
  await page.check('input[value="fast"]');
  await until(page, "document.getElementById('changes').textContent.includes('accuracy fast')");
});

visiting("kicks by mouse, button and key", "scene=paper&play=0&action=100", async (page) => {
  const speed = await number(page, "speed-now");
  await page.click("#kick-forward");
  await until(page, `Number(document.getElementById('speed-now').textContent) > ${speed + 0.3}`);
  await page.keyboard.press("j");
  await until(page, `Number(document.getElementById('speed-now').textContent) < ${speed + 0.1}`);
  const box = (await page.locator("#view").boundingBox())!;
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 150, y, { steps: 4 });
  await page.waitForTimeout(300);
  expect(await page.textContent("#aim")).toMatch(/^kick [\d.]+ m\/s$/);
  await shoot(page, "kick");
  await page.mouse.up();
  await until(page, `Number(document.getElementById('speed-now').textContent) > ${speed + 0.2}`);
  await until(page, "location.hash.includes('kicks=100:0.5,100:-0.5,100:')");
});

visiting("a learned policy beside the baseline", "scene=push_only&policy=1&play=0&action=300", async (page) => {
  expect(await page.isChecked("#policy")).toBe(true);
  expect(await page.textContent("#beside")).toMatch(/^baseline: [\d.]+ m (ahead|behind)$/);
  await shoot(page, "policy");
  await page.locator("#scrub").fill("650");
  await page.locator("#scrub").fill("650");
  await until(page, "document.getElementById('beside').textContent.includes('fall at')");
  await shoot(page, "policy-later");
  await page.uncheck("#policy");
  await until(page, "document.getElementById('beside').hidden");
});

visiting("hard cases", "play=0", async (page) => {
  await page.click("#cases-panel > summary");
  for (const kind of await page.locator(".kind > summary").all()) await kind.click();
  expect(await page.locator(".case").count()).toBe(CASES.length);
  expect(await page.locator(".case button").count()).toBe(CASES.filter(({ scene }) => scene !== null).length);
  const { measured, limits } = CASES.find(({ name }) => name === "reversal")!;
  const row = page.locator('.case[data-name="reversal"] tr:has-text("balanced") td');
  expect((await row.allTextContents()).map(Number)).toEqual([Number(measured.balanced!.toPrecision(3)), limits.balanced]);
  expect(await page.textContent('.case[data-name="grazing"] tr:has-text("fast") td')).toMatch(/^not supported: it checks/);
  await page.locator('.case[data-name="letting_go"]').scrollIntoViewIfNeeded();
  await shoot(page, "cases-list");
  // Seconds after which each is shown.
  for (const [name, seconds] of [["reversal", 0.1], ["no_friction", 0.3], ["standing_still", 0.5], ["lift_off", 0.2], ["knee_stop", 0.05]]) {
    await page.click(`.case[data-name="${name}"] button`);
    await until(page, `Number(document.getElementById('time').textContent) >= ${seconds}`);
    await shoot(page, `case-${name}`);
  }
});

visiting("camera: choices, turning, zoom", "play=0&action=60", async (page) => {
  for (const camera of ["side", "front", "above", "angle"]) {
    await page.selectOption("#camera", camera);
    await page.waitForTimeout(300);
    await shoot(page, `camera-${camera}`);
  }
  await page.mouse.move(100, 500);
  await page.mouse.down();
  await page.mouse.move(200, 520);
  await page.mouse.up();
  await page.mouse.wheel(0, 300);
  await page.waitForTimeout(300);
  await shoot(page, "camera-turned");
});

visiting("keys alone", "play=0&action=30", async (page) => {
  await page.keyboard.press("ArrowRight");
  await until(page, "document.getElementById('time').textContent === '0.31'");
  await page.keyboard.press("Shift+ArrowLeft");
  await until(page, "document.getElementById('time').textContent === '0.21'");
  await page.keyboard.press("Space");
  await until(page, "Number(document.getElementById('time').textContent) > 0.3");
  await page.keyboard.press("Space");
  await page.keyboard.press(",");
  expect(await page.inputValue("#speed")).toBe("0.5");
  await page.keyboard.press("f");
  expect(await page.isChecked("#forces")).toBe(false);
  await page.keyboard.press("c");
  expect(await page.inputValue("#camera")).toBe("side");
  // Every control can have the focus.
  const controls = await page.locator("button:visible, select:visible, input:visible:not([disabled]), summary:visible").count();
  const reached = new Set<string>();
  for (let i = 0; i < controls + 10; i++) {
    await page.keyboard.press("Tab");
    reached.add(await page.evaluate("document.activeElement.id || document.activeElement.outerHTML.slice(0, 80)"));
  }
  expect(reached.size).toBeGreaterThan(25);
});

visiting("dark, and a choice that stays in the address", "play=0&action=60", async (page) => {
  await page.selectOption("#theme", "dark");
  expect(await page.getAttribute("html", "data-theme")).toBe("dark");
  await until(page, "location.hash.includes('theme=dark') && location.hash.includes('action=60')");
  await shoot(page, "dark");
});

visiting("the width of a phone", "action=80&play=0", async (page) => {
  const wide = await page.evaluate("document.documentElement.scrollWidth");
  expect(wide).toBeLessThanOrEqual(390);
  await page.waitForTimeout(500);
  await shoot(page, "phone");
}, { width: 390, height: 844 });

visiting("an address with mistakes gets messages, and the page goes on", "scene=moon&set=ice.gravity:1e7,ice.age:1&kicks=5:99&speed=x&action=10&play=0", async (page) => {
  const text = (await page.textContent("#messages")) ?? "";
  expect(text).toContain('scene = "moon" is unknown');
  expect(text).toContain("speed of a kick");
  expect(text).toMatch(/ice\.(gravity|age)/);
  await shoot(page, "bad-address");
  await page.click("#messages button");
  await page.click("#play");
  await until(page, "Number(document.getElementById('time').textContent) > 0.2");
});

const recording = fileURLToPath(new URL("../recording/recording.npz", import.meta.url));

visiting("a recording made in Python is played as it is; a change simulates its scene", "play=0", async (page) => {
  await page.setInputFiles("#file", recording);
  await until(page, "document.getElementById('rates').textContent.includes('not simulated here')");
  expect(await page.textContent("#description")).toMatch(/^Recording of paper_printed: 3\.\d\d s, 3 steps\./);
  expect(await page.getAttribute('.preset:text-is("recording.npz")', "aria-pressed")).toBe("true");
  await page.locator("#scrub").fill("150");
  await until(page, "document.getElementById('time').textContent === '1.50'");
  expect(await shown(page, "speed-now")).toBe(false);
  await page.keyboard.press("k");
  await until(page, "document.getElementById('messages').textContent.includes('cannot be kicked')");
  await page.click("#messages button");
  await page.click("#verify");
  await until(page, "document.getElementById('verified').textContent.startsWith('Yes: the same bits in ')");
  await shoot(page, "recording");
  await page.locator("#scrub").fill("9999");
  await page.locator('[data-name="ice.gravity"] input').fill("9");
  await until(page, "document.getElementById('rates').textContent.includes('Unaccounted energy')");
  await page.click("#reset");
  await until(page, "document.getElementById('rates').textContent.includes('not simulated here')");
  await page.click('.preset:text-is("push_only")');
  await until(page, "document.getElementById('rates').textContent.includes('Unaccounted energy')");
});

visiting("a policy and a scene that are opened", "play=0", async (page) => {
  await page.setInputFiles("#file", fileURLToPath(new URL("../../skate_env/policies/push_only.npz", import.meta.url)));
  await until(page, "!document.getElementById('beside').hidden");
  expect(await page.isChecked("#policy")).toBe(true);
  const toml = 'name = "moon"\ndescription = "Standing on the moon."\n[ice]\ngravity = 1.62\n';
  await page.setInputFiles("#file", { name: "moon.toml", mimeType: "text/plain", buffer: Buffer.from(toml) });
  await until(page, "document.getElementById('description').textContent === 'Standing on the moon.'");
  expect(await page.textContent('[data-name="ice.gravity"] output')).toBe("1.62 m/s²");
  await shoot(page, "opened-scene");
});

visiting("damaged files get a message, and the page goes on", "play=0", async (page) => {
  const whole = readFileSync(recording);
  const bent = Buffer.from(whole);
  // In the links, which take the last part of the file.
  bent[Math.floor(0.9 * whole.length)]! ^= 1;
  const files: [string, Buffer, RegExp][] = [
    ["bent.npz", bent, /bent\.npz: not an \.npz file of numbers/],
    ["short.npz", whole.subarray(0, 10_000), /short\.npz: .*no directory/],
    ["empty.npz", Buffer.alloc(0), /empty\.npz: .*no directory/],
    ["text.npz", Buffer.from("no archive at all, but a longer text"), /text\.npz: .*no directory/],
    ["bad.toml", Buffer.from("name = 3"), /bad\.toml: its scene cannot start/],
  ];
  for (const [name, buffer, says] of files) {
    await page.setInputFiles("#file", { name, mimeType: "application/octet-stream", buffer });
    await until(page, `${says}.test(document.getElementById('messages').textContent)`);
    expect(await page.locator(".preset").allTextContents()).not.toContain(name);
  }
  await shoot(page, "damaged-file");
  await page.click("#messages button");
  await page.click("#play");
  await until(page, "Number(document.getElementById('time').textContent) > 0.2");
});

test("the address names a file beside the page", { timeout: 60_000 }, async () => {
  const context = await visit.browser.newContext();
  await context.route("**/a%20walk.npz", (route) => route.fulfill({ body: readFileSync(recording) }));
  await context.route("**/lost.npz", (route) => route.fulfill({ status: 404, body: "" }));
  const page = await context.newPage();
  await page.goto(`${visit.address}#scene=a%20walk.npz&action=100&play=0`);
  await page.waitForSelector("html[data-ready]");
  expect(await page.textContent("#description")).toMatch(/^Recording of paper/);
  await until(page, "document.getElementById('time').textContent === '1.00' && location.hash.includes('scene=a%20walk.npz')");
  await page.reload();
  await page.waitForSelector("html[data-ready]");
  await until(page, "document.getElementById('time').textContent === '1.00'");
  const other = await context.newPage();
  await other.goto(`${visit.address}#scene=lost.npz&play=0`);
  await other.waitForSelector("html[data-ready]");
  await until(other, "document.getElementById('messages').textContent.includes('lost.npz: 404')");
  await until(other, "document.querySelector('.preset[aria-pressed=true]').textContent === 'paper'");
  await context.close();
});

test("an HTML file of the Python package plays alone, also inside another page", { timeout: 60_000 }, async () => {
  const file = fileURLToPath(new URL("../recording/recording.html", import.meta.url));
  const context = await visit.browser.newContext({ offline: true, viewport: { width: 900, height: 560 } });
  const errors: string[] = [];
  const asked: string[] = [];
  context.on("weberror", (error) => errors.push(error.error().message));
  context.on("request", (request) => asked.push(request.url()));
  const page = await context.newPage();
  await page.goto(`file://${file}`);
  await page.waitForSelector("html[data-ready]");
  expect(await page.textContent("#summary")).toMatch(/^scene paper_printed: 3\.\d\d s, 3 steps$/);
  await until(page, "Number(document.getElementById('time').textContent) > 0.3");
  await page.click("#play");
  await page.locator("#scrub").fill("150");
  await until(page, "document.getElementById('time').textContent === '1.50'");
  await page.click("#forward");
  await page.click("#back");
  await page.click("#back");
  await until(page, "document.getElementById('time').textContent === '1.49'");
  for (const [id, choice] of [["speed", "2"], ["camera", "side"], ["theme", "dark"]]) await page.selectOption(`#${id}`, choice!);
  await page.uncheck("#forces");
  await page.waitForTimeout(300);
  await shoot(page, "player-dark");
  for (const [id, choice] of [["camera", "angle"], ["theme", "light"]]) await page.selectOption(`#${id}`, choice!);
  await page.check("#forces");
  await page.waitForTimeout(300);
  await shoot(page, "player");
  await page.click("#restart");
  await until(page, "document.getElementById('play').textContent === 'play' && document.getElementById('time').textContent > '3'");
  // As `_repr_html_` in a notebook.
  const outer = await context.newPage();
  const escaped = readFileSync(file, "utf8").replaceAll("&", "&amp;").replaceAll('"', "&quot;");
  await outer.setContent(`<iframe style="width: 100%; height: 520px" srcdoc="${escaped}"></iframe>`);
  await outer.frames()[1]!.waitForSelector("html[data-ready]");
  expect(asked.filter((url) => !/^(file|data|about|blob):/.test(url))).toEqual([]);
  expect(errors).toEqual([]);
  await context.close();
});

test("a damaged HTML file says so", { timeout: 60_000 }, async () => {
  const whole = readFileSync(fileURLToPath(new URL("../recording/recording.html", import.meta.url)), "utf8");
  const page = await visit.browser.newPage();
  const at = whole.indexOf('id="recording">') + 20_000;
  await page.setContent(`${whole.slice(0, at)}AAAAAAAA${whole.slice(at + 8)}`);
  await until(page, "document.getElementById('messages').textContent.startsWith('The recording cannot be shown: ')");
  await page.close();
});
