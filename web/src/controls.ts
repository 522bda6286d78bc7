// Playback, kicks, camera, keys; and the numbers over the picture.
import type { App } from "./app";
import { describe } from "./contact";
import { byId, count, element, short } from "./dom";
import { CAMERAS, SPEEDS, THEMES } from "./link";
import type { Motion, Sample } from "./motion";
import type { Playback } from "./playback";
import type { Stage } from "./stage";

/** Kick of a key or a button [m/s]. */
const KICK = 0.5;

function choices(id: string, names: readonly string[], choose: (name: string) => void): HTMLSelectElement {
  const select = byId<HTMLSelectElement>(id);
  select.append(...names.map((name) => element("option", { value: name, textContent: id === "speed" ? `${name}×` : name })));
  select.onchange = () => choose(select.value);
  return select;
}

/** Playback, camera, forces, theme, messages, and their keys. */
export function connectPlayback(playback: Playback, stage: Stage): void {
  const play = byId<HTMLButtonElement>("play");
  const scrub = byId<HTMLInputElement>("scrub");
  const forces = byId<HTMLInputElement>("forces");
  const toggle = () => {
    const { motion, settings } = playback;
    if (!settings.playing && motion.finished && playback.cursor >= motion.last) playback.restart();
    else playback.set({ playing: !settings.playing });
  };
  const step = (actions: number) => playback.seek(Math.round(playback.cursor) + actions);
  const look = (camera: string) => playback.set({ camera: CAMERAS.find((name) => name === camera) ?? "angle" });
  const speed = choices("speed", SPEEDS.map(String), (name) => playback.set({ speed: Number(name) }));
  const camera = choices("camera", CAMERAS, look);
  const theme = choices("theme", THEMES, (name) => playback.set({ theme: THEMES.find((x) => x === name) ?? "auto" }));
  play.onclick = toggle;
  byId("restart").onclick = () => playback.restart();
  byId("back").onclick = () => step(-1);
  byId("forward").onclick = () => step(1);
  scrub.oninput = () => playback.seek(Number(scrub.value));
  forces.onchange = () => playback.set({ forces: forces.checked });

  const preferred = matchMedia("(prefers-color-scheme: dark)");
  let lookedAt = "";
  const update = () => {
    const { settings } = playback;
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
  playback.on("settings", update);
  playback.on("run", update);
  update();
  connectMessages(playback);
  connectKeys({
    " ": toggle,
    r: () => playback.restart(),
    f: () => playback.set({ forces: !playback.settings.forces }),
    c: () => look(CAMERAS[(CAMERAS.indexOf(playback.settings.camera) + 1) % CAMERAS.length] ?? ""),
    ",": () => shift(playback, -1),
    ".": () => shift(playback, 1),
    ArrowLeft: (shifted) => step(shifted ? -10 : -1),
    ArrowRight: (shifted) => step(shifted ? 10 : 1),
  });
}

/** Kicks by button and key. */
export function connectKicks(app: App): void {
  byId("kick-back").onclick = () => app.kick(-KICK);
  byId("kick-forward").onclick = () => app.kick(KICK);
  connectKeys({ j: () => app.kick(-KICK), k: () => app.kick(KICK) });
}

/** Take the next slower or faster speed. */
function shift(playback: Playback, by: number): void {
  const at = SPEEDS.findIndex((speed) => speed === playback.settings.speed);
  playback.set({ speed: SPEEDS[Math.min(Math.max(at + by, 0), SPEEDS.length - 1)] ?? 1 });
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

function connectMessages(playback: Playback): void {
  const box = byId("messages");
  const update = () => {
    box.hidden = playback.messages.length === 0;
    const close = element("button", { type: "button", textContent: "Close" });
    close.onclick = () => playback.dismiss();
    box.replaceChildren(element("ul", {}, ...playback.messages.map((text) => element("li", { textContent: text }))), close);
  };
  playback.on("message", update);
  update();
}

function write(id: string, text: string): void {
  const at = byId(id);
  if (at.textContent !== text) at.textContent = text;
}

/** The numbers of the shown sample. */
export function showSample(playback: Playback, sample: Sample): void {
  const { motion, cursor } = playback;
  write("state-number", String(sample.contactState));
  write("state-words", describe(sample.contactState));
  const otherLeg = sample.supportLeg === "right" ? "left" : "right";
  write("support-leg", `${sample.supportLeg} leg supports`);
  write("free-leg", `${otherLeg} leg free`);
  write("time", sample.time.toFixed(2));
  byId("speed-now").parentElement!.hidden = Number.isNaN(sample.speed);
  write("speed-now", sample.speed.toFixed(2).replace(/^-(0.00)$/, "$1"));
  write("gait-steps", String(sample.gaitSteps));
  const ended = cursor >= motion.last && motion.termination !== null;
  byId("ending").hidden = !ended;
  if (ended) write("ending", `ended: ${motion.termination} at ${sample.time.toFixed(2)} s`);
  const scrub = byId<HTMLInputElement>("scrub");
  scrub.max = String(lastKnown(motion));
  if (document.activeElement !== scrub || playback.settings.playing) scrub.value = String(Math.floor(cursor));
}

/** The last sample on the slider; that of a simulation that goes on is at least 1000. */
function lastKnown({ finished, last }: Motion): number {
  return finished ? last : Math.max(last, 1000);
}

/** The baseline beside a policy, and the numbers of the engine. */
export function showEngine(app: App): void {
  const { run, rates, recording } = app;
  const other = app.shownBaseline()?.state;
  byId("beside").hidden = other === undefined;
  const state = run.at(Math.floor(app.cursor));
  if (other !== undefined) {
    const behind = state.head[1]! - other.head[1]!;
    const end = app.baseline?.finished === true && other.time === app.baseline.at(app.baseline.last).time
      ? ` (${app.baseline.termination} at ${other.time.toFixed(2)} s)` : "";
    write("beside", `baseline: ${Math.abs(behind).toFixed(1)} m ${behind < 0 ? "ahead" : "behind"}${end}`);
  }
  if (recording !== null) {
    write("rates", `Recording, not simulated here: ${recording.summary}.`);
    return;
  }
  const speed = rates === null ? "" : `Engine: ${count(rates.perSecond)} evaluations/s, ${short(rates.timesRealTime)} times real time. `;
  const late = app.late ? "Slower than the wanted speed. " : "";
  write("rates", `${speed}${late}Unaccounted energy ${short(state.energyResidual, 2)} J, slide under load ${state.slide.toFixed(2)} m.`);
}
