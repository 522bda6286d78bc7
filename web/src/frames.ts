// The loop that plays a motion and draws it.
import type { Playback } from "./playback";
import type { Stage } from "./stage";

/** Longest time between two pictures that is played [s]. */
const LONGEST_GAP = 0.1;

/** Play, and draw each picture that differs from the last one; `then` is called with the time [ms] in any case. */
export function everyFrame(playback: Playback, stage: Stage, draw: () => void, then: (now: number) => void = () => {}): void {
  let drawn = "";
  let before = performance.now();
  const frame = (now: number) => {
    playback.tick(Math.min((now - before) / 1000, LONGEST_GAP));
    before = now;
    const { version, cursor, motion } = playback;
    const view = [version, cursor, motion.last, stage.version, innerWidth, innerHeight, devicePixelRatio].join();
    if (view !== drawn) {
      drawn = view;
      draw();
    }
    then(now);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}
