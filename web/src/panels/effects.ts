// Panel: effects on and off, and what each costs.
import type { App } from "../app";
import { count, element, short } from "../dom";
import { messageOf } from "../errors";
import { editOf } from "../link";
import type { Cost } from "../measure";
import type { Meter } from "../meter";

/** Relative change of time per action below which the clock decides. */
const NOISE = 0.03;

export function effectsPanel(app: App, meter: Meter, isOpen: () => boolean): { panel: HTMLElement; opened: () => void } {
  const own = element("p", { className: "cost", id: "scene-cost" });
  const rows = element("div", { className: "effects" });
  let generation = 0;

  const costs = new Map<string, HTMLElement>();
  const update = () => {
    generation += 1;
    costs.clear();
    rows.replaceChildren(...app.run.sim.description.effects.map(({ name, description, on, fixed }) => {
      const box = element("input", { type: "checkbox", checked: on, disabled: fixed !== null });
      box.onchange = () => {
        if (!app.change({ effects: withEffect(app.settings.effects, name, box.checked) })) box.checked = on;
      };
      const cost = element("span", { className: "cost" });
      costs.set(name, cost);
      const words = element("span", {}, element("b", { textContent: name.replaceAll("_", " ") }), ` ${description}`);
      const row = element("label", { title: fixed ?? description }, box, words, cost);
      row.dataset.name = name;
      return row;
    }));
    if (isOpen()) void measure();
  };

  /** Measure the scene, then the scene with each effect switched. */
  const measure = async () => {
    const mine = ++generation;
    const { settings, toml } = app;
    const edit = (effects: typeof settings.effects) => editOf({ ...settings, effects }, toml);
    try {
      own.textContent = "measuring …";
      const [scene] = await meter.costs([edit(settings.effects)]);
      if (mine !== generation || scene === undefined) return;
      own.textContent = `This scene: ${sentence(scene)}. Beside each effect: what switching it changes.`;
      for (const { name, on, fixed } of app.run.sim.description.effects) {
        const at = costs.get(name);
        if (fixed !== null || at === undefined) continue;
        const edits = [edit(settings.effects), edit(withEffect(settings.effects, name, !on))];
        const [now, other] = await meter.costs(edits).catch(() => []);
        if (mine !== generation) return;
        at.textContent = now === undefined || other === undefined ? "–" : difference(now, other);
        if (other !== undefined) at.title = sentence(other);
      }
    } catch (error) {
      if (mine === generation) own.textContent = messageOf(error);
    }
  };
  app.on("run", update);
  update();
  return { panel: element("div", {}, own, rows), opened: () => void measure() };
}

/** The list of switched effects after one more. Later entries act on what earlier ones have made. */
function withEffect(effects: [string, boolean][], name: string, on: boolean): [string, boolean][] {
  return [...effects.filter(([other]) => other !== name), [name, on]];
}

function sentence({ perSecond, microseconds, evaluationsPerAction }: Cost): string {
  return `${count(perSecond)} evaluations/s, ${short(evaluationsPerAction)} evaluations and ${short(microseconds)} µs per action`;
}

function difference(now: Cost, other: Cost): string {
  const share = other.microseconds / now.microseconds - 1;
  if (Math.abs(share) < NOISE) return "± 0 %";
  return `${share > 0 ? "+" : "−"}${Math.abs(100 * share).toFixed(0)} % time`;
}
