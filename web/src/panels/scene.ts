// Panel: presets and the scene's text.
import type { App } from "../app";
import { element } from "../dom";
import { messageOf } from "../errors";
import type { Meter } from "../meter";

export function scenePanel(app: App, meter: Meter): HTMLElement {
  const buttons = element("div", { className: "presets" });
  const file = element("input", { type: "file", accept: ".npz,.toml", id: "file" });
  file.onchange = async () => {
    const [chosen] = file.files ?? [];
    if (chosen !== undefined) await app.open(chosen.name, new Uint8Array(await chosen.arrayBuffer()));
    // So that the same file can be chosen again.
    file.value = "";
  };
  const open = element("label", { className: "file" }, "Open a recording, a policy (.npz) or a scene (.toml) ", file);
  const skates = element("input", { type: "checkbox", id: "policy" });
  skates.onchange = () => app.change({ policy: skates.checked, playing: true });
  const policy = element("label", {}, skates, " learned policy, the baseline beside it");
  const text = element("p", { className: "description", id: "description" });
  const repeat = element("button", { type: "button", id: "verify", textContent: "Repeat the motion: are its bits the same here?" });
  const repeated = element("p", { id: "verified" });
  repeat.onclick = async () => {
    const { recording } = app;
    if (recording === null || recording.receipt === null) return;
    repeated.textContent = "The motion is repeated.";
    const answer = await meter.verify(recording.receipt).then(
      ({ actions, difference }) => difference === null ? `Yes: the same bits in ${actions} actions.` : `No: ${difference}.`,
      (error: unknown) => `It cannot be repeated: ${messageOf(error)}.`,
    );
    if (app.recording === recording) repeated.textContent = answer;
  };
  const changes = element("p", { className: "changes", id: "changes" });
  const reset = element("button", { type: "button", id: "reset", textContent: "Undo all changes" });
  reset.onclick = () => app.reset();
  const update = () => {
    const { settings, run, recording } = app;
    const names = Object.keys(app.presets);
    if ([...buttons.children].map(({ textContent }) => textContent).join() !== names.join()) {
      buttons.replaceChildren(...names.map((preset) => {
        const button = element("button", { type: "button", className: "preset", textContent: preset });
        button.onclick = () => app.choose(preset, app.isOpenedPolicy(preset));
        return button;
      }));
    }
    for (const button of buttons.children) button.setAttribute("aria-pressed", String(button.textContent === settings.preset));
    skates.checked = settings.policy;
    policy.hidden = !app.policies.has(settings.preset);
    const { name, description } = run.sim.description.scene;
    text.textContent = recording === null ? description : `Recording of ${name}: ${recording.summary}. A change simulates its scene.`;
    repeat.hidden = (recording?.receipt ?? null) === null;
    const made = [
      ...settings.effects.map(([name, on]) => `${name} ${on ? "on" : "off"}`),
      ...Object.entries(settings.values).map(([name, x]) => `${name} = ${x}`),
      ...(settings.accuracy === null ? [] : [`accuracy ${settings.accuracy}`]),
    ];
    changes.textContent = made.length > 0 ? `Changed: ${made.join(", ")}.` : "";
    reset.hidden = made.length === 0;
  };
  app.on("run", () => {
    repeated.textContent = "";
    update();
  });
  app.on("settings", update);
  update();
  return element("div", {}, buttons, open, text, repeat, repeated, policy, changes, reset);
}
