// Panel: presets and the scene's text.
import type { App } from "../app";
import { element } from "../dom";

export function scenePanel(app: App): HTMLElement {
  const buttons = Object.keys(app.presets).map((preset) => {
    const button = element("button", { type: "button", className: "preset", textContent: preset });
    button.onclick = () => app.choose(preset);
    return button;
  });
  const skates = element("input", { type: "checkbox", id: "policy" });
  skates.onchange = () => app.change({ policy: skates.checked, playing: true });
  const policy = element("label", {}, skates, " learned policy, the baseline beside it");
  const text = element("p", { className: "description", id: "description" });
  const changes = element("p", { className: "changes", id: "changes" });
  const reset = element("button", { type: "button", id: "reset", textContent: "Undo all changes" });
  reset.onclick = () => app.reset();
  const update = () => {
    const { settings, run } = app;
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.textContent === settings.preset));
    skates.checked = settings.policy;
    policy.hidden = !app.policies.has(settings.preset);
    text.textContent = run.sim.description.scene.description;
    const made = [
      ...settings.effects.map(([name, on]) => `${name} ${on ? "on" : "off"}`),
      ...Object.entries(settings.values).map(([name, x]) => `${name} = ${x}`),
      ...(settings.accuracy === null ? [] : [`accuracy ${settings.accuracy}`]),
    ];
    changes.textContent = made.length > 0 ? `Changed: ${made.join(", ")}.` : "";
    reset.hidden = made.length === 0;
  };
  app.on("run", update);
  update();
  return element("div", {}, element("div", { className: "presets" }, ...buttons), text, policy, changes, reset);
}
