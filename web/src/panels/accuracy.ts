// Panel: accuracies, each with its error against `reference` and its cost, from the start to the shown time.
import type { App } from "../app";
import { element, short } from "../dom";
import { ACCURACIES, type Accuracy } from "../engine";
import { messageOf } from "../errors";
import { editOf } from "../link";
import type { Comparison } from "../measure";
import type { Meter } from "../meter";

/** Shortest and longest compared motion [actions]. */
const SHORTEST = 200;
const LONGEST = 1600;
const COLOURS: Record<Accuracy, string> = { fast: "#D55E00", balanced: "#009E73", reference: "#0072B2" };
const WORDS: Record<Accuracy, string> = {
  fast: "time stepping, steps of 5 ms",
  balanced: "events located, tolerance 5e-6",
  reference: "events located, tolerance 1e-11",
};
/** Range of errors in the chart, decades. */
const [LOWEST, HIGHEST] = [-14, 1];

export function accuracyPanel(app: App, meter: Meter, isOpen: () => boolean): { panel: HTMLElement; opened: () => void } {
  const rows = ACCURACIES.map((accuracy) => {
    const radio = element("input", { type: "radio", name: "accuracy", value: accuracy });
    radio.onchange = () => app.change({ accuracy });
    const [error, cost] = [element("td"), element("td")];
    const name = element("label", { title: WORDS[accuracy] }, radio, ` ${accuracy}`);
    name.style.setProperty("--mark", COLOURS[accuracy]);
    const row = element("tr", {}, element("th", { scope: "row" }, name), error, cost);
    row.dataset.name = accuracy;
    return { accuracy, radio, error, cost, row };
  });
  const head = element("tr", {}, ...["accuracy", "error [rad]", "µs per action"].map((name) => element("th", { scope: "col", textContent: name })));
  const table = element("table", { className: "accuracies" }, element("thead", {}, head), element("tbody", {}, ...rows.map(({ row }) => row)));
  const chart = element("canvas", { className: "chart" });
  chart.setAttribute("role", "img");
  chart.setAttribute("aria-label", "error of the joint angles over time, logarithmic");
  const note = element("p", { className: "description", id: "accuracy-note" });

  let asked = false;
  let compared: Comparison[] = [];
  let comparedActions = -1;

  const compare = async () => {
    if (asked || !isOpen()) return;
    const { run, settings, toml } = app;
    if (app.cursor <= comparedActions || comparedActions === LONGEST) return;
    // Doubled, so that a long motion is not compared again and again.
    const actions = Math.min(Math.max(2 * Math.ceil(app.cursor), SHORTEST), LONGEST);
    asked = true;
    try {
      const found = await meter.compare(editOf(settings, toml), [...run.kicks], actions);
      if (run !== app.run) return;
      compared = found;
      comparedActions = actions;
      show();
    } catch (error) {
      note.textContent = messageOf(error);
      comparedActions = actions;
    } finally {
      asked = false;
    }
  };

  const show = () => {
    const at = Math.min(Math.floor(app.cursor), comparedActions);
    for (const { accuracy, error, cost } of rows) {
      const found = compared.find((row) => row.accuracy === accuracy);
      const own = found?.errors[at];
      error.textContent = accuracy === "reference" ? "0" : own === undefined ? "ended" : short(own, 2);
      cost.textContent = found === undefined ? "…" : short(found.cost.microseconds);
    }
    if (comparedActions >= 0) {
      note.textContent = `Root mean square over the joint angles at ${short(at * app.run.period, 4)} s, from the scene's start and without a policy; – where another leg supports.`;
    }
    draw(chart, compared, at, app.run.period);
  };

  const update = () => {
    compared = [];
    comparedActions = -1;
    const { accuracy } = app.settings;
    for (const { radio } of rows) radio.checked = radio.value === (accuracy ?? "balanced");
    show();
  };
  app.on("run", update);
  update();
  setInterval(() => {
    if (!isOpen()) return;
    void compare();
    show();
  }, 500);
  return { panel: element("div", {}, table, chart, note), opened: () => void compare() };
}

/** Errors over time: a line for each accuracy, a mark at the shown action. */
function draw(canvas: HTMLCanvasElement, compared: Comparison[], at: number, period: number): void {
  const pen = canvas.getContext("2d");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (pen === null || width === 0) return;
  const ratio = Math.min(window.devicePixelRatio, 2);
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  pen.scale(ratio, ratio);
  const style = getComputedStyle(canvas);
  const [ink, faint] = [style.getPropertyValue("--text"), style.getPropertyValue("--border")];
  const [left, bottom] = [38, height - 16];
  const longest = Math.max(...compared.map(({ errors }) => errors.length), 2) - 1;
  const x = (action: number) => left + (action / longest) * (width - left - 6);
  const y = (error: number) => {
    const decade = Math.min(Math.max(Math.log10(error), LOWEST), HIGHEST);
    return 6 + ((HIGHEST - decade) / (HIGHEST - LOWEST)) * (bottom - 6);
  };
  pen.font = "11px system-ui, sans-serif";
  pen.textBaseline = "middle";
  for (const decade of [-12, -8, -4, 0]) {
    pen.fillStyle = faint;
    pen.fillRect(left, y(10 ** decade), width - left - 6, 1);
    pen.fillStyle = ink;
    pen.textAlign = "right";
    pen.fillText(decade === 0 ? "1 rad" : `1e${decade}`, left - 4, y(10 ** decade));
  }
  pen.textAlign = "left";
  pen.fillText("0 s", left, bottom + 9);
  pen.textAlign = "right";
  pen.fillText(`${short(longest * period, 3)} s`, width - 6, bottom + 9);
  for (const { accuracy, errors } of compared) {
    if (accuracy === "reference") continue;
    pen.strokeStyle = COLOURS[accuracy];
    pen.lineWidth = 1.5;
    pen.beginPath();
    let drawing = false;
    errors.forEach((error, action) => {
      const known = Number.isFinite(error) && error > 0;
      if (known && drawing) pen.lineTo(x(action), y(error));
      else if (known) pen.moveTo(x(action), y(error));
      drawing = known;
    });
    pen.stroke();
  }
  pen.fillStyle = ink;
  if (at >= 0 && compared.length > 0) pen.fillRect(x(at), 6, 1, bottom - 6);
}
