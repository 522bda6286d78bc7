// The page's state and its one run; the panels call it and listen to it.
import { CASES, playOf } from "./cases";
import { Crashed, type Engine, Refused, type State } from "./engine";
import { DEFAULTS, type Settings, editOf } from "./link";
import { OPENABLE, type Opened, openFile } from "./files";
import type { Motion } from "./motion";
import { Damaged } from "./npz";
import { Playback } from "./playback";
import type { Policy } from "./policy";
import { type Pose, poseOf } from "./pose";
import type { Recording } from "./recording";
import { LONGEST, Run } from "./run";

/** Time for the engine in one picture [ms]: for what is shown, and for what comes next. */
const BUDGET = 12;
const SPARE = 3;
/** How far the run is known ahead of what is shown [s]. */
const AHEAD = 1.5;

export class App extends Playback<Settings> {
  /** The simulation of the scene. Where a recording is shown it stays at its start. */
  run: Run;
  /** The scene without the policy, if a policy skates. */
  baseline: Run | null;
  /** Is the engine slower than the wanted speed? */
  late = false;
  /** Opened recordings by name. */
  readonly recordings = new Map<string, Recording>();
  /** Of the present second: simulated [s], in the engine [ms], evaluations. */
  private readonly window = { started: 0, engine: 0, evaluations: 0, action: 0 };
  /** Of the last full second; null before it. */
  rates: { perSecond: number; timesRealTime: number } | null = null;

  constructor(
    /** Presets and opened files by name, as TOML. */
    readonly presets: Record<string, string>,
    private engine: Engine,
    private readonly reload: () => Promise<Engine>,
    /** Shipped and opened policies by preset. */
    readonly policies: Map<string, Policy>,
    settings: Settings,
    opened: ReadonlyMap<string, Opened>,
  ) {
    super(settings);
    for (const [name, file] of opened) this.add(name, file);
    ({ run: this.run, baseline: this.baseline } = this.begin());
    this.extend(settings.action, 2000);
    this.cursor = Math.min(settings.action, this.motion.last);
  }

  /** The recording, if the scene is one and nothing is changed in it. */
  get recording(): Recording | null {
    const { preset, accuracy, effects, values } = this.settings;
    const changed = accuracy !== null || effects.length > 0 || Object.keys(values).length > 0;
    return changed ? null : this.recordings.get(preset) ?? null;
  }

  get motion(): Motion {
    return this.recording ?? this.run;
  }

  get toml(): string {
    return this.presets[this.settings.preset] ?? this.hardCase?.scene ?? "";
  }

  /** The hard case that is the scene, if it is one. */
  private get hardCase() {
    return CASES.find(({ name }) => name === this.settings.preset);
  }

  /** The runs of the settings: what is shown, and the baseline if a policy skates. */
  private runs(): { run: Run; baseline: Run | null } {
    const { settings, engine, toml, hardCase } = this;
    const { values, driver } = hardCase === undefined ? { values: {}, driver: null } : playOf(hardCase);
    const edit = editOf({ ...settings, values: { ...values, ...settings.values } }, toml);
    const policy = settings.policy ? this.policies.get(settings.preset) : null;
    if (policy === undefined) throw new Refused(`no policy for the scene ${settings.preset} is here`);
    const run = new Run(engine, edit, settings.kicks, policy ?? driver);
    return { run, baseline: policy === null ? null : new Run(engine, edit, settings.kicks) };
  }

  /** The runs of the settings; where the engine refuses them, of their preset, or of the first one for a file. */
  private begin(): { run: Run; baseline: Run | null } {
    const { settings } = this;
    try {
      return this.runs();
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      const preset = OPENABLE.test(settings.preset) ? DEFAULTS.preset : settings.preset;
      this.report(`The scene cannot start: ${error.message}. Shown is the preset ${preset}.`);
      this.settings = { ...settings, preset, accuracy: null, effects: [], values: {}, kicks: [], policy: false, action: 0 };
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

  /** The first settings of a preset or a hard case. */
  choose(preset: string, policy = false): boolean {
    return this.change({ preset, accuracy: null, effects: [], values: {}, policy, playing: true });
  }

  /** Show what a file holds. If it holds nothing that can be shown, nothing changes. */
  async open(name: string, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    try {
      const file = await openFile(name, bytes);
      this.add(name, file);
      if (this.choose(name, this.isOpenedPolicy(name))) return;
      delete this.presets[name];
      this.report(`${name}: its scene cannot start.`);
      this.tell("run");
    } catch (error) {
      if (!(error instanceof Damaged)) throw error;
      this.report(`${name}: ${error.message}.`);
    }
  }

  /** Add shipped policies. */
  learn(policies: ReadonlyMap<string, Policy>): void {
    for (const [preset, policy] of policies) this.policies.set(preset, policy);
    this.tell("settings");
  }

  /** Is a preset the file of a policy? */
  isOpenedPolicy(preset: string): boolean {
    return OPENABLE.test(preset) && this.policies.has(preset);
  }

  private add(name: string, { toml, recording, policy }: Opened): void {
    this.presets[name] = toml;
    this.recordings.delete(name);
    this.policies.delete(name);
    if (recording !== undefined) this.recordings.set(name, recording);
    if (policy !== undefined) this.policies.set(name, policy);
  }

  reset(): void {
    const { effects, values, accuracy } = DEFAULTS;
    this.change({ effects: [...effects], values: { ...values }, accuracy, playing: true });
  }

  override seek(action: number): void {
    this.guard(() => this.extend(Math.ceil(action), 200));
    super.seek(action);
  }

  kick(speed: number): void {
    if (this.recording !== null) {
      this.report("This is a recording: it cannot be kicked. Change a number of the scene to simulate it.");
      return;
    }
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

  override tick(elapsed: number): void {
    this.guard(() => this.extend(Math.ceil(this.cursor + AHEAD / this.run.period), SPARE));
    this.measure();
    if (!this.settings.playing) return;
    const wanted = this.wanted(elapsed);
    this.guard(() => this.extend(Math.ceil(wanted), BUDGET));
    this.late = wanted > this.motion.last && !this.motion.finished;
    super.tick(elapsed);
    if (this.run.last >= LONGEST && this.cursor >= LONGEST) {
      this.report(`The recording is full (${LONGEST} actions). Restart it to go on.`);
    }
  }

  /** State and pose of the baseline, where a policy skates. */
  shownBaseline(): { state: State; pose: Pose } | null {
    if (this.baseline === null) return null;
    const state = this.baseline.at(Math.floor(this.cursor));
    return { state, pose: poseOf(state) };
  }

  private extend(action: number, budget: number): void {
    if (this.recording !== null) return;
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
