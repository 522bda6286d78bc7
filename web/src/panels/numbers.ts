// Panel: sliders for the numbers that matter most, and a field for every number of the scene.
import type { App } from "../app";
import { element, short } from "../dom";
import type { Parameter } from "../engine";

interface Slider {
  name: string;
  label: string;
  low: number;
  high: number;
}

const SLIDERS: readonly Slider[] = [
  { name: "ice.friction.mu_forward", label: "friction forward", low: 0, high: 1 },
  { name: "ice.friction.mu_backward", label: "friction backward", low: 0, high: 2 },
  { name: "ice.friction.mu", label: "friction", low: 0, high: 1 },
  { name: "ice.friction.coefficient", label: "viscous friction", low: 0, high: 100 },
  { name: "ice.gravity", label: "gravity", low: 0, high: 25 },
  { name: "body.upper_body.mass", label: "mass of the upper body", low: 1, high: 60 },
  { name: "body.head.mass", label: "mass of the head", low: 0.5, high: 20 },
  { name: "body.foot.mass", label: "mass of a foot", low: 0.2, high: 10 },
  { name: "control.lifting.height", label: "head target: height", low: 0.5, high: 3 },
  { name: "control.lifting.ahead", label: "head target: ahead of the ankle", low: -1.5, high: 2 },
  { name: "control.lifting.K_p.1", label: "K_p forward", low: 0, high: 4000 },
  { name: "control.lifting.K_p.2", label: "K_p upward", low: 0, high: 100000 },
  { name: "control.feedforward.scale", label: "scale of all torques", low: 0, high: 2 },
  { name: "control.feedforward.tau1_scale", label: "scale of the couple on the supporting foot", low: 0, high: 2 },
  { name: "control.feedforward.tau7_scale", label: "scale of the ankle's torque", low: 0, high: 2 },
];

/** Unit as people write it. */
function unitOf(unit: string): string {
  return unit === "1" ? "" : unit.replace("m/s2", "m/s²").replace("N m", "N·m");
}

export function numbersPanel(app: App): HTMLElement {
  const sliders = element("div", { className: "sliders" });
  const filter = element("input", { type: "search", placeholder: "search, for example mass", id: "filter" });
  filter.setAttribute("aria-label", "search the numbers");
  const list = element("div", { className: "numbers" });
  const all = element("details", {}, element("summary", { textContent: "All numbers" }), filter, list);
  const change = (name: string, x: number) => app.change({ values: { ...app.settings.values, [name]: x } });

  const update = () => {
    const parameters = app.run.sim.description.parameters;
    const known = new Map(parameters.map((parameter) => [parameter.name, parameter]));
    const shown = SLIDERS.filter(({ name }) => known.has(name));
    if (namesOf(sliders) !== shown.map(({ name }) => name).join()) {
      sliders.replaceChildren(...shown.map((slider) => sliderRow(slider, change)));
    }
    for (const row of sliders.children) {
      const parameter = known.get((row as HTMLElement).dataset.name ?? "");
      if (parameter !== undefined) fill(row as HTMLElement, parameter);
    }
    fillList();
  };
  const fillList = () => {
    if (!all.open) return;
    const words = filter.value.toLowerCase();
    const found = app.run.sim.description.parameters.filter(({ name }) => name.toLowerCase().includes(words));
    if (namesOf(list) !== found.map(({ name }) => name).join()) {
      list.replaceChildren(...found.map((parameter) => numberRow(parameter, change)));
    }
    // The same rows stay, with what is being typed into one of them.
    found.forEach(({ value }, at) => {
      const input = list.children[at]?.querySelector("input");
      if (input == null || input === document.activeElement) return;
      input.value = String(value);
      input.setAttribute("aria-invalid", "false");
    });
  };
  filter.oninput = fillList;
  all.ontoggle = fillList;
  app.on("run", update);
  update();
  return element("div", {}, element("p", { textContent: "A change starts the motion again." }), sliders, all);
}

/** Names of the rows of a list. */
function namesOf(list: HTMLElement): string {
  return [...list.children].map((row) => (row as HTMLElement).dataset.name).join();
}

function sliderRow({ name, label, low, high }: Slider, change: (name: string, x: number) => boolean): HTMLElement {
  const range = element("input", { type: "range", min: String(low), max: String(high), step: String((high - low) / 200) });
  const text = element("output");
  const row = element("label", { className: "slider" }, element("span", { textContent: label }), text, range);
  row.dataset.name = name;
  range.oninput = () => change(name, Number(range.value));
  return row;
}

function fill(row: HTMLElement, { value, unit }: Parameter): void {
  const range = row.querySelector("input");
  const text = row.querySelector("output");
  if (range !== null && document.activeElement !== range) range.value = String(value);
  if (text !== null) text.textContent = `${short(value, 4)} ${unitOf(unit)}`;
}

function numberRow({ name, value, low, high, unit }: Parameter, change: (name: string, x: number) => boolean): HTMLElement {
  const input = element("input", { type: "text", inputMode: "decimal", value: String(value) });
  input.title = `${short(low)} to ${short(high)} ${unitOf(unit)}`;
  input.onchange = () => {
    const x = input.value.trim() === "" ? Number.NaN : Number(input.value);
    input.setAttribute("aria-invalid", "true");
    if (Number.isFinite(x) && change(name, x)) input.setAttribute("aria-invalid", "false");
  };
  const row = element("label", { className: "number" }, element("span", { textContent: name }), input, element("span", { textContent: unitOf(unit) }));
  row.dataset.name = name;
  return row;
}
