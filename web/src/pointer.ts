// Mouse and touch in the picture: drag the robot to kick it, drag beside it to turn the camera.
import { byId } from "./dom";
import type { Stage } from "./stage";

/** Speed of a kick for a drag by 1 m in the picture [m/s], and its limit [m/s]. */
const PER_METRE = 2;
const STRONGEST = 3;
/** Weaker kicks are taken for clicks [m/s]. */
const WEAKEST = 0.05;
/** [rad per px] */
const TURN = 0.008;

/** Without `kick`, dragging always turns the camera. */
export function connectPointer(stage: Stage, canvas: HTMLCanvasElement, kick: ((speed: number) => void) | null): void {
  if (kick !== null) canvas.ariaLabel = "the skater on the ice; drag it to kick it, drag beside it to turn the camera";
  const hits = (event: PointerEvent) => kick !== null && stage.hits(event.clientX, event.clientY);
  const say = (text: string) => {
    if (kick === null) return;
    const aim = byId("aim");
    aim.hidden = text === "";
    aim.textContent = text;
  };
  let drag: { kicks: boolean; x: number; y: number } | null = null;

  const end = () => {
    if (drag?.kicks === true && Math.abs(stage.aimed) >= WEAKEST) kick?.(stage.aimed);
    drag = null;
    stage.aimed = 0;
    say("");
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    drag = { kicks: hits(event), x: event.clientX, y: event.clientY };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (drag === null) {
      canvas.classList.toggle("on-robot", hits(event));
      return;
    }
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    if (drag.kicks) {
      const forward = stage.forwardOnScreen();
      const length = Math.max(Math.hypot(forward.x, forward.y), 20);
      const speed = (PER_METRE * (dx * forward.x + dy * forward.y)) / length ** 2;
      stage.aimed = Math.min(Math.max(speed, -STRONGEST), STRONGEST);
      say(`kick ${stage.aimed.toFixed(2)} m/s`);
    } else {
      stage.turn(-TURN * dx, TURN * dy);
      Object.assign(drag, { x: event.clientX, y: event.clientY });
    }
  });
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", () => {
    stage.aimed = 0;
    end();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    stage.zoom(Math.exp(0.001 * event.deltaY));
  }, { passive: false });
}
