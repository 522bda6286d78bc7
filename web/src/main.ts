// Loads the engine, puts the parts together, and draws.
import { App } from "./app";
import { CASES } from "./cases";
import { connectKicks, connectPlayback, showEngine, showSample } from "./controls";
import { byId, element, giveUp } from "./dom";
import { Engine } from "./engine";
import { OPENABLE, type Opened, openFile } from "./files";
import { everyFrame } from "./frames";
import { DEFAULTS, entries, read, write } from "./link";
import { Meter } from "./meter";
import { accuracyPanel } from "./panels/accuracy";
import { casesPanel } from "./panels/cases";
import { effectsPanel } from "./panels/effects";
import { helpPanel } from "./panels/help";
import { numbersPanel } from "./panels/numbers";
import { scenePanel } from "./panels/scene";
import { connectPointer } from "./pointer";
import { Policy } from "./policy";
import { Stage } from "./stage";
import { Timeline } from "./timeline";

const files = import.meta.glob<string>("../../skate_env/scenes/*.toml", { query: "?raw", import: "default", eager: true });
const presets = Object.fromEntries(
  Object.entries(files).map(([path, text]) => [path.replace(/^.*\/|\.toml$/g, ""), text]),
);
// The policy for any ice belongs to no preset.
const policyFiles = import.meta.glob<string>(["../../skate_env/policies/*.npz", "!../../skate_env/policies/any_ice.npz"], { query: "?url", import: "default", eager: true });
/** Does the address ask for a policy? */
const skates = entries(location.hash).get("policy") === "1";
/** Time between two writes of the address [ms]. */
const LINK_INTERVAL = 400;

const load = () => Engine.fetch(document.baseURI);

/** The shipped policies by preset. */
async function loadPolicies(): Promise<Map<string, Policy>> {
  const read = async ([path, address]: [string, string]): Promise<[string, Policy]> => {
    const reply = await fetch(new URL(address, document.baseURI));
    return [path.replace(/^.*\/|\.npz$/g, ""), await Policy.read(new Uint8Array(await reply.arrayBuffer()))];
  };
  return new Map(await Promise.all(Object.entries(policyFiles).map(read)));
}

/** A section of the side that opens and shuts. */
function section(title: string, id: string, content: (isOpen: () => boolean) => HTMLElement | { panel: HTMLElement; opened: () => void }, open = false): HTMLElement {
  const details = element("details", { id, open }, element("summary", { textContent: title }));
  const made = content(() => details.open);
  if (made instanceof HTMLElement) details.append(made);
  else {
    details.append(made.panel);
    details.addEventListener("toggle", () => { if (details.open) made.opened(); });
  }
  return details;
}

/** The file that the address names as its scene, from the page's folder; null without one. */
async function loadFile(): Promise<{ name: string; file: Opened | Error } | null> {
  const name = entries(location.hash).get("scene") ?? "";
  if (!OPENABLE.test(name)) return null;
  try {
    const reply = await fetch(new URL(encodeURIComponent(name), document.baseURI));
    if (!reply.ok) throw new Error(`${reply.status} ${reply.statusText}`);
    return { name, file: await openFile(name, new Uint8Array(await reply.arrayBuffer())) };
  } catch (error) {
    return { name, file: error instanceof Error ? error : new Error(String(error)) };
  }
}

function start([engine, policies, named]: [Engine, Map<string, Policy>, Awaited<ReturnType<typeof loadFile>>]): void {
  const early: string[] = [];
  const names = () => [...Object.keys(presets), ...CASES.filter(({ scene }) => scene !== null).map(({ name }) => name)];
  const opened = new Map<string, Opened>();
  const settings = read(location.hash, [...names(), ...(named === null ? [] : [named.name])], (message) => early.push(message));
  if (named?.file instanceof Error) {
    early.push(`${named.name}: ${named.file.message}.`);
    Object.assign(settings, { preset: DEFAULTS.preset, policy: false });
  } else if (named !== null) opened.set(named.name, named.file);
  const app = new App(presets, engine, load, policies, settings, opened);
  const stage = new Stage(byId<HTMLCanvasElement>("view"), byId("notes"));
  const strip = new Timeline(byId<HTMLCanvasElement>("strip"), app);
  const meter = new Meter();
  byId("panels").append(
    section("Scene", "scene-panel", () => scenePanel(app, meter), true),
    section("Ice, body, controller", "numbers-panel", () => numbersPanel(app), true),
    section("Accuracy and its cost", "accuracy-panel", (isOpen) => accuracyPanel(app, meter, isOpen)),
    section("Effects and their cost", "effects-panel", (isOpen) => effectsPanel(app, meter, isOpen)),
    section("Hard cases", "cases-panel", () => casesPanel(app)),
    section("Keys", "help-panel", () => helpPanel()),
  );
  connectPlayback(app, stage);
  connectKicks(app);
  connectPointer(stage, byId<HTMLCanvasElement>("view"), (speed) => app.kick(speed));
  for (const message of early) app.report(message);
  // Most visits begin without a policy: the picture does not wait for them.
  if (!skates) void loadPolicies().then((found) => app.learn(found));

  addEventListener("hashchange", () => {
    const settings = read(location.hash, names(), (message) => app.report(message));
    const { messages } = app;
    if (app.change(settings)) {
      app.seek(settings.action);
      app.set({ playing: settings.playing });
      for (const message of messages) app.report(message);
    }
  });
  let linked = 0;
  const draw = () => {
    const { sample, pose } = app.shown();
    stage.draw(pose, sample, app.run.sim.description.scene.control.lifting, app.shownBaseline()?.pose ?? null);
    strip.draw();
    showSample(app, sample);
    showEngine(app);
  };
  everyFrame(app, stage, draw, (now) => {
    if (now - linked > LINK_INTERVAL) {
      linked = now;
      // While it plays, the address keeps the start, so that a link shows the whole motion.
      const action = app.settings.playing ? 0 : Math.round(app.cursor);
      const link = write({ ...app.settings, action });
      if (location.hash.slice(1) !== link) history.replaceState(null, "", `#${link}`);
    }
  });
  document.documentElement.dataset.ready = "true";
  document.documentElement.dataset.startTime = performance.now().toFixed(0);
}

Promise.all([load(), skates ? loadPolicies() : new Map<string, Policy>(), loadFile()]).then(start).catch((error: unknown) => giveUp("The page cannot start", error));
