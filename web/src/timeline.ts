// Strip of contact states around the shown time: a lane for each foot, the state's number, events.
import { FREE, SUPPORT } from "./colours";
import { type FootContact, contactState } from "./contact";
import type { Playback } from "./playback";

/** Shown time before and after the cursor [s]. */
const BEFORE = 3;
const AFTER = 1.5;
const LEFT = 68;
const HEIGHTS = { numbers: 18, lane: 18, gap: 6, axis: 16 };
const STRIP_HEIGHT = HEIGHTS.numbers + 2 * HEIGHTS.lane + HEIGHTS.gap + HEIGHTS.axis + 10;

export class Timeline {
  private readonly pen: CanvasRenderingContext2D;
  private start = 0;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly playback: Playback) {
    const pen = canvas.getContext("2d");
    if (pen === null) throw new Error("no 2D canvas");
    this.pen = pen;
    const seek = (event: PointerEvent) => {
      if (event.buttons === 0) return;
      const box = canvas.getBoundingClientRect();
      playback.seek(Math.round((this.start + (event.clientX - box.left - LEFT) / this.scale) / playback.motion.period));
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      seek(event);
    });
    canvas.addEventListener("pointermove", seek);
  }

  /** [px per s] */
  private get scale(): number {
    return Math.max(this.canvas.clientWidth - LEFT - 8, 10) / (BEFORE + AFTER);
  }

  draw(): void {
    const { pen, canvas, playback } = this;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth, STRIP_HEIGHT];
    if (canvas.width !== Math.round(width * ratio)) [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const style = getComputedStyle(canvas);
    const ink = style.getPropertyValue("--text");
    const faint = style.getPropertyValue("--border");
    const time = playback.cursor * playback.motion.period;
    // While a person drags in the strip, it stays where it is.
    if (playback.settings.playing || time < this.start || time > this.start + BEFORE + AFTER) {
      this.start = Math.max(0, time - BEFORE);
    }
    const x = (t: number) => LEFT + (t - this.start) * this.scale;
    const lanes = [4 + HEIGHTS.numbers, 4 + HEIGHTS.numbers + HEIGHTS.lane + HEIGHTS.gap] as const;
    pen.font = "12px system-ui, sans-serif";
    pen.textBaseline = "middle";
    pen.fillStyle = ink;
    pen.textAlign = "left";
    ["state", "right foot", "left foot"].forEach((name, i) => {
      pen.fillText(name, 0, i === 0 ? 4 + HEIGHTS.numbers / 2 : (lanes[i - 1] ?? 0) + HEIGHTS.lane / 2);
    });
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, 0, width - LEFT, height - HEIGHTS.axis);
    pen.clip();
    this.stretches((from, to, number, right) => {
      const { support, free } = contactState(number);
      const feet = right ? [support, free] : [free, support];
      feet.forEach((foot, i) => {
        const supports = (i === 0) === right;
        this.foot(foot, supports ? SUPPORT : FREE, x(from), x(to), lanes[i] ?? 0, faint);
      });
      const shown = String(number);
      if (x(to) - x(from) > pen.measureText(shown).width + 4) {
        pen.fillStyle = ink;
        pen.textAlign = "center";
        pen.fillText(shown, (Math.max(x(from), LEFT) + x(to)) / 2, 4 + HEIGHTS.numbers / 2);
      }
      pen.fillStyle = faint;
      pen.fillRect(x(from), 4, 1, HEIGHTS.numbers);
    });
    pen.fillStyle = ink;
    pen.fillRect(x(time) - 1, 0, 2, height);
    pen.restore();
    this.axis(x, lanes[1] + HEIGHTS.lane + 4, ink, faint);
  }

  /** Call for every time in the window in which the contact state and the supporting leg stay the same. */
  private stretches(draw: (from: number, to: number, number: number, right: boolean) => void): void {
    const { motion } = this.playback;
    const first = Math.max(0, Math.floor(this.start / motion.period));
    const last = Math.min(motion.last, Math.ceil((this.start + BEFORE + AFTER) / motion.period));
    let from = first;
    for (let i = first; i <= last; i++) {
      const [now, next] = [motion.at(i), i < last ? motion.at(i + 1) : null];
      if (next !== null && next.contactState === now.contactState && next.supportLeg === now.supportLeg) continue;
      draw(from * motion.period, (i + 1) * motion.period, now.contactState, now.supportLeg === "right");
      from = i + 1;
    }
  }

  /** Sticking: full colour; sliding: pale; on an edge: the lower half; in the air: a thin line. */
  private foot(foot: FootContact, colour: string, from: number, to: number, top: number, faint: string): void {
    const { pen } = this;
    const wide = Math.max(to - from, 0.5);
    if (foot.slip === "air") {
      pen.fillStyle = faint;
      pen.fillRect(from, top + HEIGHTS.lane - 2, wide, 2);
      return;
    }
    const high = foot.edge ? HEIGHTS.lane / 2 : HEIGHTS.lane;
    const y = top + HEIGHTS.lane - high;
    pen.fillStyle = colour;
    pen.globalAlpha = foot.slip === "stick" ? 1 : 0.45;
    pen.fillRect(from, y, wide, high);
    pen.globalAlpha = 1;
  }

  private axis(x: (t: number) => number, y: number, ink: string, faint: string): void {
    const { pen } = this;
    pen.textAlign = "center";
    for (let t = Math.ceil(2 * this.start) / 2; t <= this.start + BEFORE + AFTER; t += 0.5) {
      pen.fillStyle = faint;
      pen.fillRect(x(t), y - 2, 1, 5);
      pen.fillStyle = ink;
      if (t % 1 === 0) pen.fillText(`${t} s`, x(t), y + 10);
    }
  }
}
