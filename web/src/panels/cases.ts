// Panel: hard cases by kind, each with its measured value and its limit.
import type { App } from "../app";
import type { HardCase } from "../cases/case";
import { element, short } from "../dom";
import { ACCURACIES, type Accuracy } from "../engine";
import type { Meter } from "../meter";

type Verdict = "holds" | "fails" | "unclaimed" | "elsewhere";

/** A case in the list. */
class Row {
  private readonly result = element("p", { className: "result" });
  readonly element: HTMLElement;

  constructor(readonly hard: HardCase, show: () => void) {
    const button = element("button", { type: "button", textContent: "Show" });
    button.setAttribute("aria-label", `show ${hard.name}`);
    button.onclick = show;
    const text = element("p", { className: "description", textContent: `${hard.setup.replaceAll("`", "")} ${hard.law} Measured: ${hard.criterion}.` });
    const name = element("b", { textContent: hard.name.replaceAll("_", " ") });
    this.element = element("div", { className: "case" }, name, hard.recipe === null ? "" : button, text, this.result);
    this.element.dataset.name = hard.name;
  }

  /** Without a value, what is known before a run; returns the verdict. */
  write(accuracy: Accuracy, measured: number | null, working = false): Verdict | null {
    const { hard: { limits, measured: python, recipe, unit, excluded }, result } = this;
    const limit = limits[accuracy];
    const compared = (x: number) => `${short(x)}, limit ${short(limit ?? Number.NaN)} ${unit}`.trimEnd();
    let verdict: Verdict | null = null;
    if (limit === null) {
      verdict = "unclaimed";
      result.textContent = `not supported by ${accuracy}: ${excluded}`;
    } else if (recipe === null) {
      verdict = "elsewhere";
      result.textContent = `in the Python package only: ${compared(python[accuracy] ?? Number.NaN)}`;
    } else if (measured === null) result.textContent = working ? "running …" : "";
    else {
      verdict = measured <= limit ? "holds" : "fails";
      result.textContent = `${verdict === "holds" ? "✓" : "✗"} ${compared(measured)}`;
    }
    result.dataset.outcome = verdict ?? "";
    return verdict;
  }

  fail(error: unknown): void {
    this.result.textContent = error instanceof Error ? error.message : String(error);
    this.result.dataset.outcome = "fails";
  }
}

export function casesPanel(app: App, meter: Meter): HTMLElement {
  const select = element("select", { id: "case-accuracy" }, ...ACCURACIES.map((name) => element("option", { value: name, textContent: name })));
  select.value = "balanced";
  select.setAttribute("aria-label", "accuracy of the hard cases");
  const run = element("button", { type: "button", id: "run-cases", textContent: "Run all" });
  const sum = element("p", { className: "description", id: "cases-sum" });
  const rows = app.cases.map((hard) => new Row(hard, () => app.show(hard)));
  const here = rows.filter(({ hard }) => hard.recipe !== null);
  const accuracy = () => select.value as Accuracy;
  const forget = () => {
    for (const row of rows) row.write(accuracy(), null);
    sum.textContent = `${here.length} of ${rows.length} cases run in this page.`;
  };
  select.onchange = forget;
  run.onclick = async () => {
    forget();
    run.disabled = select.disabled = true;
    const counts = { holds: 0, fails: 0 };
    for (const row of here) {
      if (row.write(accuracy(), null, true) !== null) continue;
      try {
        const verdict = row.write(accuracy(), await meter.judge(row.hard.name, accuracy()));
        counts[verdict === "holds" ? "holds" : "fails"] += 1;
      } catch (error) {
        row.fail(error);
        counts.fails += 1;
      }
      sum.textContent = `${counts.holds} hold, ${counts.fails} fail.`;
    }
    run.disabled = select.disabled = false;
  };
  forget();
  const kinds = [...new Set(rows.map(({ hard }) => hard.kind))].map((kind) => {
    const own = rows.filter(({ hard }) => hard.kind === kind);
    const summary = element("summary", { textContent: `${kind} (${own.length})` });
    return element("details", { className: "kind" }, summary, ...own.map((row) => row.element));
  });
  const intro = element("p", { className: "description", textContent: "Cases in which simulators fail, and the law that decides each." });
  return element("div", {}, intro, element("p", {}, select, " ", run), sum, ...kinds);
}
