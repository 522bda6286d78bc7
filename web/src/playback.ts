// What the picture, the strip and the controls of playback share: a motion, a shown time, messages.
import type { Look } from "./link";
import type { Motion, Sample } from "./motion";
import { type Pose, mix, poseOf } from "./pose";

export type Topic = "run" | "settings" | "message";

export abstract class Playback<S extends Look = Look> {
  /** Shown time, in samples. */
  cursor = 0;
  /** Number of changes of the settings and the motion. */
  version = 0;
  messages: string[] = [];
  private readonly listeners: Record<Topic, (() => void)[]> = { run: [], settings: [], message: [] };

  constructor(public settings: S) {}

  abstract get motion(): Motion;

  on(topic: Topic, listener: () => void): void {
    this.listeners[topic].push(listener);
  }

  protected tell(topic: Topic): void {
    this.version += 1;
    for (const listener of this.listeners[topic]) listener();
  }

  report(message: string): void {
    if (!this.messages.includes(message)) this.messages.push(message);
    this.tell("message");
  }

  dismiss(): void {
    this.messages = [];
    this.tell("message");
  }

  /** Change what does not concern the scene. */
  set(changes: Partial<S>): void {
    this.settings = { ...this.settings, ...changes };
    this.tell("settings");
  }

  protected play(playing: boolean): void {
    this.settings = { ...this.settings, playing };
    this.tell("settings");
  }

  restart(): void {
    this.cursor = 0;
    this.play(true);
  }

  seek(sample: number): void {
    this.cursor = Math.min(Math.max(sample, 0), this.motion.last);
    this.play(false);
  }

  /** Advance by a time [s] of the person who looks. */
  tick(elapsed: number): void {
    if (!this.settings.playing) return;
    const { motion } = this;
    this.cursor = Math.min(this.wanted(elapsed), motion.last);
    if (motion.finished && this.cursor >= motion.last) this.play(false);
  }

  /** Where the cursor would be after a time [s]. */
  protected wanted(elapsed: number): number {
    return this.cursor + (elapsed * this.settings.speed) / this.motion.period;
  }

  /** The shown sample, and the pose, which between two samples is mixed. */
  shown(): { sample: Sample; pose: Pose } {
    const { motion, cursor } = this;
    const before = Math.floor(cursor);
    const sample = motion.at(before);
    const pose = poseOf(sample);
    const share = cursor - before;
    if (share === 0 || before >= motion.last) return { sample, pose };
    return { sample, pose: mix(pose, poseOf(motion.at(before + 1)), share) };
  }
}
