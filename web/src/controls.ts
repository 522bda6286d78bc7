// Playback, kicks, camera, keys; and the numbers over the picture.
import type { App } from "./app";
import { describe } from "./contact";
import { byId, count, element, short } from "./dom";
import type { State } from "./engine";
import { CAMERAS, SPEEDS, THEMES } from "./link";
import type { Stage } from "./stage";

/** Kick of a key or a button [m/s]. */
const KICK = 0.5;

function choices(id: string, names: readonly string[], choose: (name: string) => void): HTMLSelectElement {
  const select = byId<HTMLSelectElement>(id);
  select.append(...names.map((name) => element("option", { value: name, textContent: id === "speed" ? `${name}×` : name })));
  select.onchange = () => choose(select.value);
  return select;
}

export function connectControls(app: App, stage: Stage): void {
  const play = byId<HTMLButtonElement>("play");
  const scrub = byId<HTMLInputElement>("scrub");
  const forces = byId<HTMLInputElement>("forces");
  const toggle = () => {
    if (!app.settings.playing && app.run.finished && app.cursor >= app.run.last) app.restart();
    else app.set({ playing: !app.settings.playing });
  };
  const step = (actions: number) => app.seek(Math.round(app.cursor) + actions);
  const look = (camera: string) => app.set({ camera: CAMERAS.find((name) => name === camera) ?? "angle" });
  const speed = choices("speed", SPEEDS.map(String), (name) => app.set({ speed: Number(name) }));
  const camera = choices("camera", CAMERAS, look);
  const theme = choices("theme", THEMES, (name) => app.set({ theme: THEMES.find((x) => x === name) ?? "auto" }));
  play.onclick = toggle;
  byId("restart").onclick = () => app.restart();
  byId("back").onclick = () => step(-1);
  byId("forward").onclick = () => step(1);
  byId("kick-back").onclick = () => app.kick(-KICK);
  byId("kick-forward").onclick = () => app.kick(KICK);
  scrub.oninput = () => app.seek(Number(scrub.value));
  forces.onchange = () => app.set({ forces: forces.checked });

  const preferred = matchMedia("(prefers-color-scheme: dark)");
  let lookedAt = "";
  const update = () => {
    const { settings } = app;
    play.textContent = settings.playing ? "pause" : "play";
    speed.value = String(settings.speed);
    forces.checked = stage.showForces = settings.forces;
    camera.value = settings.camera;
    theme.value = settings.theme;
    if (lookedAt !== settings.camera) stage.look(settings.camera);
    lookedAt = settings.camera;
    const dark = settings.theme === "dark" || (settings.theme === "auto" && preferred.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    stage.recolour(dark);
  };
  preferred.addEventListener("change", update);
  app.on("settings", update);
  app.on("run", update);
  update();
  connectMessages(app);
  connectKeys({
    " ": toggle,
    r: () => app.restart(),
    j: () => app.kick(-KICK),
    k: () => app.kick(KICK),
    f: () => app.set({ forces: !app.settings.forces }),
    c: () => look(CAMERAS[(CAMERAS.indexOf(app.settings.camera) + 1) % CAMERAS.length] ?? ""),
    ",": () => shift(app, -1),
    ".": () => shift(app, 1),
    ArrowLeft: (shifted) => step(shifted ? -10 : -1),
    ArrowRight: (shifted) => step(shifted ? 10 : 1),
  });
}

/** Take the next slower or faster speed. */
function shift(app: App, by: number): void {
  const at = SPEEDS.findIndex((speed) => speed === app.settings.speed);
  app.set({ speed: SPEEDS[Math.min(Math.max(at + by, 0), SPEEDS.length - 1)] ?? 1 });
}

/** Keys act where no control has the focus that uses them itself. */
function connectKeys(keys: Record<string, (shifted: boolean) => void>): void {
  window.addEventListener("keydown", (event) => {
    const at = event.target instanceof Element ? event.target.closest("input, select, button, summary, textarea") : null;
    const typed = at instanceof HTMLInputElement && ["text", "search"].includes(at.type);
    const own = typed || at instanceof HTMLSelectElement
      || (event.key === " " && at !== null)
      || (event.key.startsWith("Arrow") && at instanceof HTMLInputElement);
    if (own || event.ctrlKey || event.metaKey || event.altKey) return;
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (act === undefined) return;
    event.preventDefault();
    act(event.shiftKey);
  });
}

function connectMessages(app: App): void {
  const box = byId("messages");
  const update = () => {
    box.hidden = app.messages.length === 0;
    const close = element("button", { type: "button", textContent: "Close" });
    close.onclick = () => app.dismiss();
    box.replaceChildren(element("ul", {}, ...app.messages.map((text) => element("li", { textContent: text }))), close);
  };
  app.on("message", update);
  update();
}

function write(id: string, text: string): void {
  const at = byId(id);
  if (at.textContent !== text) at.textContent = text;
}

/** The numbers of the shown state. */
export function showNumbers(app: App, state: State): void {
  const { run, rates } = app;
  write("state-number", String(state.contactState));
  write("state-words", describe(state.contactState));
  const otherLeg = state.supportLeg === "right" ? "left" : "right";
  write("support-leg", `${state.supportLeg} leg supports`);
  write("free-leg", `${otherLeg} leg free`);
  write("time", state.time.toFixed(2));
  write("speed-now", state.speed.toFixed(2));
  write("gait-steps", String(state.gaitSteps));
  const ended = app.cursor >= run.last && run.termination !== null;
  byId("ending").hidden = !ended;
  if (ended) write("ending", `ended: ${run.termination} at ${state.time.toFixed(2)} s`);
  const other = app.shownBaseline()?.state;
  byId("beside").hidden = other === undefined;
  if (other !== undefined) {
    const behind = state.head[1]! - other.head[1]!;
    const end = app.baseline?.finished === true && other.time === app.baseline.at(app.baseline.last).time
      ? ` (${app.baseline.termination} at ${other.time.toFixed(2)} s)` : "";
    write("beside", `baseline: ${Math.abs(behind).toFixed(1)} m ${behind < 0 ? "ahead" : "behind"}${end}`);
  }
  const scrub = byId<HTMLInputElement>("scrub");
  scrub.max = String(run.finished ? run.last : Math.max(run.last, 1000));
  if (document.activeElement !== scrub || app.settings.playing) scrub.value = String(Math.floor(app.cursor));
  const speed = rates === null ? "" : `Engine: ${count(rates.perSecond)} evaluations/s, ${short(rates.timesRealTime)} times real time. `;
  const late = app.late ? "Slower than the wanted speed. " : "";
  write("rates", `${speed}${late}Unaccounted energy ${short(state.energyResidual, 2)} J, slide under load ${state.slide.toFixed(2)} m.`);
}
