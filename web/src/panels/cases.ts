// Panel: hard cases, each with its measured value and its limit.
import type { App } from "../app";
import { element, short } from "../dom";
import { ACCURACIES, type Accuracy } from "../engine";
import type { Meter } from "../meter";

export function casesPanel(app: App, meter: Meter): HTMLElement {
  const select = element("select", { id: "case-accuracy" }, ...ACCURACIES.map((name) => element("option", { value: name, textContent: name })));
  select.value = "balanced";
  const run = element("button", { type: "button", id: "run-cases", textContent: "Run all" });
  const rows = app.cases.map((hard) => {
    const result = element("p", { className: "result" });
    const show = element("button", { type: "button", textContent: "Show" });
    show.setAttribute("aria-label", `show ${hard.name}`);
    show.onclick = () => app.show(hard);
    const text = element("p", { className: "description", textContent: `${hard.setup} ${hard.law} Measured: ${hard.criterion}.` });
    const row = element("div", { className: "case" }, element("b", { textContent: hard.name.replaceAll("_", " ") }), show, text, result);
    row.dataset.name = hard.name;
    return { hard, result, row };
  });
  const forget = () => {
    for (const { result } of rows) {
      result.textContent = "";
      result.removeAttribute("data-outcome");
    }
  };
  select.onchange = forget;
  run.onclick = async () => {
    forget();
    run.disabled = true;
    const accuracy = select.value as Accuracy;
    for (const { hard, result } of rows) {
      result.textContent = "running …";
      try {
        const { measured, limit } = await meter.judge(app.presets.blade ?? "", hard.name, accuracy);
        const holds = limit !== null && measured <= limit;
        result.dataset.outcome = limit === null ? "unclaimed" : holds ? "holds" : "fails";
        result.textContent = limit === null
          ? `not claimed with ${accuracy}`
          : `${holds ? "✓" : "✗"} ${short(measured)}, limit ${short(limit)} ${hard.unit}`;
      } catch (error) {
        result.textContent = error instanceof Error ? error.message : String(error);
      }
    }
    run.disabled = false;
  };
  const intro = element("p", { className: "description", textContent: "Cases in which simulators fail, and the law that decides each." });
  return element("div", {}, intro, element("p", {}, select, " ", run), ...rows.map(({ row }) => row));
}
