// Panel: keys.
import { element } from "../dom";

const KEYS: readonly [string, string][] = [
  ["space", "play, pause"],
  ["← →", "one state back, forward; with shift ten"],
  ["R", "to the start"],
  ["J K", "kick backward, forward at 0.5 m/s"],
  [", .", "slower, faster"],
  ["C", "next camera"],
  ["F", "forces on, off"],
];

export function helpPanel(): HTMLElement {
  const rows = KEYS.flatMap(([keys, words]) => [
    element("dt", {}, element("kbd", { textContent: keys })),
    element("dd", { textContent: words }),
  ]);
  return element(
    "div",
    {},
    element("dl", {}, ...rows),
    element("p", { className: "description", textContent: "Drag the skater along the ice to kick it. Drag beside it to turn the camera, use the wheel to come closer. The address of the page holds everything that you have set: copy it to show somebody what you see." }),
  );
}
