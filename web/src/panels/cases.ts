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
  verdict: Verdict | null = null;
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

  /** Without a value, what is known before a run. */
  write(accuracy: Accuracy, measured: number | null, working = false): void {
    const { hard: { limits, measured: python, recipe, unit, excluded }, result } = this;
    const limit = limits[accuracy];
    const compared = (x: number) => `${short(x)}, limit ${short(limit ?? Number.NaN)} ${unit}`.trimEnd();
    this.verdict = null;
    if (limit === null) {
      this.verdict = "unclaimed";
      result.textContent = `not supported by ${accuracy}: ${excluded}`;
    } else if (recipe === null) {
      this.verdict = "elsewhere";
      result.textContent = `in the Python package only: ${compared(python[accuracy] ?? Number.NaN)}`;
    } else if (measured === null) result.textContent = working ? "running …" : "";
    else {
      this.verdict = measured <= limit ? "holds" : "fails";
      result.textContent = `${this.verdict === "holds" ? "✓" : "✗"} ${compared(measured)}`;
    }
    result.dataset.outcome = this.verdict ?? "";
  }

  fail(error: unknown): void {
    this.verdict = "fails";
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
  const kinds = [...new Set(rows.map(({ hard }) => hard.kind))].map((kind) => {
    const own = rows.filter(({ hard }) => hard.kind === kind);
    const summary = element("summary");
    return { kind, own, summary, element: element("details", { className: "kind" }, summary, ...own.map((row) => row.element)) };
  });
  const accuracy = () => select.value as Accuracy;
  const count = (which: Row[]) => {
    const number = (verdict: Verdict) => which.filter((row) => row.verdict === verdict).length;
    return number("holds") + number("fails") === 0 ? "" : `: ${number("holds")} hold, ${number("fails")} fail`;
  };
  const showCounts = () => {
    sum.textContent = `${here.length} of ${rows.length} cases run in this page${count(rows)}.`;
    for (const { kind, own, summary } of kinds) summary.textContent = `${kind} (${own.length})${count(own)}`;
  };
  const forget = () => {
    for (const row of rows) row.write(accuracy(), null);
    showCounts();
  };
  select.onchange = forget;
  run.onclick = async () => {
    forget();
    run.disabled = select.disabled = true;
    for (const row of here.filter(({ verdict }) => verdict === null)) {
      row.write(accuracy(), null, true);
      try {
        row.write(accuracy(), await meter.judge(row.hard.name, accuracy()));
      } catch (error) {
        row.fail(error);
      }
      showCounts();
    }
    run.disabled = select.disabled = false;
  };
  forget();
  const intro = element("p", { className: "description", textContent: "Cases in which simulators fail, and the law that decides each." });
  return element("div", {}, intro, element("p", {}, select, " ", run), sum, ...kinds.map((kind) => kind.element));
}
