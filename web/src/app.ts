// The page's state and its one run; the panels call it and listen to it.
import type { HardCase } from "./cases";
import { Crashed, type Engine, Refused, type State } from "./engine";
import { DEFAULTS, type Settings, editOf } from "./link";
import { type Pose, mix, poseOf } from "./pose";
import type { Policy } from "./policy";
import { LONGEST, Run } from "./run";

/** Time for the engine in one picture [ms]: for what is shown, and for what comes next. */
const BUDGET = 12;
const SPARE = 3;
/** How far the run is known ahead of what is shown [s]. */
const AHEAD = 1.5;

export type Topic = "run" | "settings" | "message";

export class App {
  run: Run;
  /** The scene without the policy, if a policy skates. */
  baseline: Run | null;
  /** Shown time, in actions. */
  cursor = 0;
  /** Number of changes of the settings and the run. */
  version = 0;
  /** Is the engine slower than the wanted speed? */
  late = false;
  messages: string[] = [];
  private readonly listeners: Record<Topic, (() => void)[]> = { run: [], settings: [], message: [] };
  /** Of the present second: simulated [s], in the engine [ms], evaluations. */
  private readonly window = { started: 0, engine: 0, evaluations: 0, action: 0 };
  /** Of the last full second; null before it. */
  rates: { perSecond: number; timesRealTime: number } | null = null;

  constructor(
    readonly presets: Readonly<Record<string, string>>,
    readonly cases: readonly HardCase[],
    private engine: Engine,
    private readonly reload: () => Promise<Engine>,
    /** Shipped policies by preset, as far as they are loaded. */
    readonly policies: ReadonlyMap<string, Policy>,
    public settings: Settings,
  ) {
    ({ run: this.run, baseline: this.baseline } = this.begin());
    this.extend(settings.action, 2000);
    this.cursor = Math.min(settings.action, this.run.last);
  }

  get toml(): string {
    const { preset } = this.settings;
    return this.presets[preset] ?? this.hardCase?.edit.toml ?? "";
  }

  /** The hard case that is the scene, if it is one. */
  private get hardCase(): HardCase | undefined {
    return this.cases.find(({ name }) => name === this.settings.preset);
  }

  on(topic: Topic, listener: () => void): void {
    this.listeners[topic].push(listener);
  }

  private tell(topic: Topic): void {
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

  /** The runs of the settings: what is shown, and the baseline if a policy skates. */
  private runs(): { run: Run; baseline: Run | null } {
    const { settings, engine, toml } = this;
    const edit = editOf(settings, toml);
    const policy = settings.policy ? this.policies.get(settings.preset) : null;
    if (policy === undefined) throw new Refused(`no policy for the scene ${settings.preset} is here`);
    const run = new Run(engine, edit, settings.kicks, policy ?? this.hardCase?.driver);
    return { run, baseline: policy === null ? null : new Run(engine, edit, settings.kicks) };
  }

  /** The runs of the settings; where the engine refuses them, of their preset. */
  private begin(): { run: Run; baseline: Run | null } {
    const { settings } = this;
    try {
      return this.runs();
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.report(`The scene cannot start: ${error.message}. It starts as the preset.`);
      this.settings = { ...settings, accuracy: null, effects: [], values: {}, kicks: [], policy: false, action: 0 };
      return this.runs();
    }
  }

  /** Change the scene and start again. Where the engine refuses the change, nothing changes. */
  change(changes: Partial<Settings>): boolean {
    const before = this.settings;
    this.settings = { ...before, kicks: [], action: 0, ...changes };
    try {
      const { run, baseline } = this.runs();
      this.run.remove();
      this.baseline?.remove();
      [this.run, this.baseline] = [run, baseline];
      this.cursor = 0;
      this.messages = [];
      this.tell("message");
      this.tell("run");
      return true;
    } catch (error) {
      this.settings = before;
      this.fail(error);
      this.tell("run");
      return false;
    }
  }

  /** Change what does not concern the scene. */
  set(changes: Partial<Settings>): void {
    this.settings = { ...this.settings, ...changes };
    this.tell("settings");
  }

  /** The first settings of a preset. */
  choose(preset: string): void {
    this.change({ preset, accuracy: null, effects: [], values: {}, policy: false, playing: true });
  }

  /** The scene of a hard case. */
  show({ name, edit }: HardCase): void {
    const preset = Object.keys(this.presets).find((key) => this.presets[key] === edit.toml) ?? name;
    const { effects = [], values = {} } = edit;
    this.change({ preset, accuracy: null, effects, values, policy: false, playing: true });
  }

  reset(): void {
    const { effects, values, accuracy } = DEFAULTS;
    this.change({ effects: [...effects], values: { ...values }, accuracy, playing: true });
  }

  restart(): void {
    this.cursor = 0;
    this.set({ playing: true });
  }

  seek(action: number): void {
    this.guard(() => {
      this.extend(Math.ceil(action), 200);
      this.cursor = Math.min(Math.max(action, 0), this.run.last);
    });
    this.set({ playing: false });
  }

  kick(speed: number): void {
    if (this.run.finished && this.cursor >= this.run.last) {
      this.report("The motion has ended: go back to kick the robot.");
      return;
    }
    this.guard(() => {
      const action = Math.floor(this.cursor);
      this.run.kick(action, speed);
      if (this.baseline !== null && !(this.baseline.finished && this.baseline.last <= action)) this.baseline.kick(action, speed);
      this.cursor = this.run.last;
    });
    this.settings.kicks = [...this.run.kicks];
    this.tell("settings");
  }

  /** Advance by a time [s] of the person who looks. */
  tick(elapsed: number): void {
    this.guard(() => this.extend(Math.ceil(this.cursor + AHEAD / this.run.period), SPARE));
    this.measure();
    if (!this.settings.playing) return;
    const wanted = this.cursor + (elapsed * this.settings.speed) / this.run.period;
    this.guard(() => this.extend(Math.ceil(wanted), BUDGET));
    this.late = wanted > this.run.last && !this.run.finished;
    this.cursor = Math.min(wanted, this.run.last);
    if (this.run.finished && this.cursor >= this.run.last) {
      if (this.run.last >= LONGEST) this.report(`The recording is full (${LONGEST} actions). Restart it to go on.`);
      this.set({ playing: false });
    }
  }

  /** The shown state, and the pose, which between two states is mixed. */
  shown(): { state: State; pose: Pose } {
    const { run, cursor } = this;
    const before = Math.floor(cursor);
    const state = run.at(before);
    const pose = poseOf(state);
    const share = cursor - before;
    if (share === 0 || before >= run.last) return { state, pose };
    return { state, pose: mix(pose, poseOf(run.at(before + 1)), share) };
  }

  /** State and pose of the baseline, where a policy skates. */
  shownBaseline(): { state: State; pose: Pose } | null {
    if (this.baseline === null) return null;
    const state = this.baseline.at(Math.floor(this.cursor));
    return { state, pose: poseOf(state) };
  }

  private extend(action: number, budget: number): void {
    this.run.extend(action, budget);
    this.baseline?.extend(action, budget);
  }

  private measure(): void {
    const { run, window } = this;
    const now = performance.now();
    if (now - window.started < 1000 && run.last >= window.action) return;
    const { evaluations } = run.at(run.last);
    const engine = run.engineTime - window.engine;
    const simulated = (run.last - window.action) * run.period;
    this.rates = engine > 0 && simulated > 0 && evaluations >= window.evaluations
      ? { perSecond: (1e3 * (evaluations - window.evaluations)) / engine, timesRealTime: (1e3 * simulated) / engine }
      : this.rates;
    Object.assign(window, { started: now, engine: run.engineTime, evaluations, action: run.last });
  }

  private guard(task: () => void): void {
    try {
      task();
    } catch (error) {
      this.fail(error);
    }
  }

  /** Report an error of the engine. After a crash the engine is loaded again. */
  private fail(error: unknown): void {
    if (error instanceof Refused) return this.report(error.message);
    if (!(error instanceof Crashed)) throw error;
    this.report(`The engine stopped at an internal error: ${error.message}. It starts again.`);
    this.settings = { ...this.settings, playing: false };
    void this.reload().then((engine) => {
      this.engine = engine;
      this.settings = { ...structuredClone(DEFAULTS), theme: this.settings.theme } as Settings;
      ({ run: this.run, baseline: this.baseline } = this.begin());
      this.cursor = 0;
      this.tell("run");
    });
  }
}
