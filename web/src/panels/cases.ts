// Panel: hard cases by kind, each with its measured values, their limits, and its motion.
import type { App } from "../app";
import { CASES, type HardCase } from "../cases";
import { element, short } from "../dom";
import { ACCURACIES } from "../engine";

export function casesPanel(app: App): HTMLElement {
  const kinds = [...new Set(CASES.map(({ kind }) => kind))].map((kind) => {
    const own = CASES.filter((hard) => hard.kind === kind);
    return element("details", { className: "kind" }, element("summary", { textContent: `${kind} (${own.length})` }), ...own.map((hard) => row(hard, app)));
  });
  const intro = element("p", {
    className: "description",
    textContent: "Cases in which simulators fail, and the law that decides each. The values are those of the Python package.",
  });
  return element("div", {}, intro, ...kinds);
}

function row(hard: HardCase, app: App): HTMLElement {
  const { name, setup, law, criterion, unit, scene } = hard;
  const measured = unit === "" ? criterion : `${criterion} [${unit}]`;
  const text = element("p", { className: "description", textContent: plain(`${setup} ${law} Measured: ${measured}.`) });
  const title = element("b", { textContent: name.replaceAll("_", " ") });
  const made = element("div", { className: "case" }, title, scene === null ? "" : showButton(name, app), text, table(hard));
  made.dataset.name = name;
  return made;
}

/** A text without Markdown's marks for code. */
function plain(text: string): string {
  return text.replaceAll("`", "");
}

function showButton(name: string, app: App): HTMLElement {
  const button = element("button", { type: "button", textContent: "Show" });
  button.setAttribute("aria-label", `show ${name}`);
  button.onclick = () => app.choose(name);
  return button;
}

/** Measured values and limits by accuracy. */
function table({ limits, measured, excluded }: HardCase): HTMLElement {
  const head = element("tr", {}, ...["accuracy", "measured", "limit"].map((title) => element("th", { scope: "col", textContent: title })));
  const rows = ACCURACIES.map((accuracy) => {
    const [value, limit] = [measured[accuracy], limits[accuracy]];
    const cells = value === undefined || limit === undefined
      ? [element("td", { colSpan: 2, textContent: `not supported: ${plain(excluded)}` })]
      : [value, limit].map((x) => element("td", { textContent: short(x) }));
    return element("tr", {}, element("th", { scope: "row", textContent: accuracy }), ...cells);
  });
  return element("table", { className: "accuracies" }, element("thead", {}, head), element("tbody", {}, ...rows));
}
