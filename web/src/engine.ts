// The engine: a WebAssembly module with plain exports (rust/skate-web). All calls to it are in this file.

import type { Sample } from "./motion";

interface Exports {
  memory: WebAssembly.Memory;
  initialise(): void;
  input(length: number): number;
  output(): number;
  output_length(): number;
  panic_text(): number;
  panic_length(): number;
  terminations(): number;
  create(length: number): number;
  remove(handle: number): void;
  step(handle: number, actions: number): number;
  hold(handle: number, count: number): number;
  kick(handle: number, speed: number): number;
  state(handle: number): number;
  state_length(): number;
  snapshot(handle: number): number;
  restore(handle: number, length: number): number;
  observation(handle: number): number;
  checksum(length: number): bigint;
}

export type Accuracy = "fast" | "balanced" | "reference";
export const ACCURACIES: readonly Accuracy[] = ["fast", "balanced", "reference"];

/** A scene and what to change in it, in this order: effects, numbers, accuracy. */
export interface SceneEdit {
  toml: string;
  effects?: [name: string, on: boolean][];
  values?: Record<string, number>;
  accuracy?: Accuracy;
}

export interface Parameter {
  name: string;
  value: number;
  low: number;
  high: number;
  unit: string;
}

export interface Effect {
  name: string;
  description: string;
  on: boolean;
  /** Why it cannot be switched, or null. */
  fixed: string | null;
}

/** The fields of a scene that the page reads. */
export interface SceneFields {
  name: string;
  description: string;
  control: {
    action_period: number;
    lifting?: { ahead: number; height: number } | null;
  };
}

export interface Description {
  scene: SceneFields;
  parameters: Parameter[];
  effects: Effect[];
  coordinates: string[];
}

/** An argument that the engine refuses. The message is for people. */
export class Refused extends Error {}

/** The engine has stopped at an internal error. Load it again. */
export class Crashed extends Error {}

/** Copy of a simulation's state; `Engine::state` of rust/skate-web lists the entries. */
export class State implements Sample {
  constructor(readonly numbers: Float64Array) {}

  private at(i: number): number {
    return this.numbers[i] ?? Number.NaN;
  }
  private list(from: number, count: number): Float64Array {
    return this.numbers.subarray(from, from + count);
  }

  /** [s] */
  get time() { return this.at(0); }
  get contactState() { return this.at(2); }
  get supportLeg(): "right" | "left" { return this.at(3) === 0 ? "right" : "left"; }
  /** 0: none; else an index into `Engine.terminations`, plus 1. */
  get termination() { return this.at(4); }
  /** Top of the head [m]. */
  get head() { return this.list(5, 3); }
  /** f_y, N, N at the heel, N at the toe: of the supporting foot, of the free foot [N]. */
  get contactForces() { return this.list(8, 8); }
  get evaluations() { return this.at(16); }
  get gaitSteps() { return this.at(17); }
  /** Under load [m]. */
  get slide() { return this.at(18); }
  /** Unaccounted [J]. */
  get energyResidual() { return this.at(19); }
  /** Of the centre of mass, forward [m/s]. */
  get speed() { return this.at(20); }
  /** [rad, m] */
  get q() { return this.list(40, this.at(1)); }
  /** [rad/s, m/s] */
  get v() { return this.list(60, this.at(1)); }
  /** Both ends (x, y, z) of the 17 links in the world [m]. */
  get links() { return this.list(80, 102); }
}

export class Engine {
  private readonly encoder = new TextEncoder();
  private readonly decoder = new TextDecoder();
  private readonly stateLength: number;
  readonly terminations: readonly string[];

  private constructor(private readonly wasm: Exports) {
    wasm.initialise();
    this.stateLength = wasm.state_length();
    wasm.terminations();
    this.terminations = JSON.parse(this.text()) as string[];
  }

  static async load(source: BufferSource): Promise<Engine> {
    const { instance } = await WebAssembly.instantiate(source, {});
    return new Engine(instance.exports as unknown as Exports);
  }

  /** Load `engine.wasm` from a folder of a server. */
  static async fetch(folder: string): Promise<Engine> {
    const reply = await fetch(new URL("engine.wasm", folder));
    if (!reply.ok) throw new Error(`engine.wasm: ${reply.status} ${reply.statusText}`);
    return Engine.load(await reply.arrayBuffer());
  }

  /** Checksum of numbers, eight bytes each. */
  checksum(numbers: Float64Array): string {
    const length = this.give(new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength));
    const sum = BigInt.asUintN(64, this.call((wasm) => wasm.checksum(length)));
    return sum.toString(16).padStart(16, "0");
  }

  /** A simulation at the start of a scene. */
  create(edit: SceneEdit): Simulation {
    const length = this.give(this.encoder.encode(JSON.stringify(edit)));
    const handle = this.checked((wasm) => wasm.create(length));
    return new Simulation(this, handle, JSON.parse(this.text()) as Description);
  }

  /** Call the module. A trap becomes a `Crashed`. */
  call<T>(task: (wasm: Exports) => T): T {
    try {
      return task(this.wasm);
    } catch (trap) {
      const { wasm } = this;
      const why = wasm.panic_length() > 0
        ? this.decoder.decode(new Uint8Array(wasm.memory.buffer, wasm.panic_text(), wasm.panic_length()))
        : String(trap);
      throw new Crashed(why);
    }
  }

  /** Call the module. A negative result becomes a `Refused`. */
  checked(task: (wasm: Exports) => number): number {
    const result = this.call(task);
    if (result < 0) throw new Refused(this.text());
    return result;
  }

  /** Copy bytes to the module's input; returns their number. */
  give(bytes: Uint8Array): number {
    const at = this.call((wasm) => wasm.input(bytes.length));
    new Uint8Array(this.wasm.memory.buffer, at, bytes.length).set(bytes);
    return bytes.length;
  }

  /** Copy of the module's output. */
  bytes(): Uint8Array<ArrayBuffer> {
    const { wasm } = this;
    return new Uint8Array(wasm.memory.buffer, wasm.output(), wasm.output_length()).slice();
  }

  text(): string {
    return this.decoder.decode(this.bytes());
  }

  state(handle: number): State {
    const at = this.call((wasm) => wasm.state(handle));
    if (at === 0) throw new Refused(`no simulation ${handle}`);
    return new State(new Float64Array(this.wasm.memory.buffer, at, this.stateLength).slice());
  }
}

/** One robot on the ice. */
export class Simulation {
  constructor(
    private readonly engine: Engine,
    private readonly handle: number,
    readonly description: Description,
  ) {}

  /** Advance by action periods; returns how many were made before the simulation ended. */
  step(actions = 1): number {
    return this.engine.checked((wasm) => wasm.step(this.handle, actions));
  }

  state(): State {
    return this.engine.state(this.handle);
  }

  /** Name of the termination, or null. */
  termination(state: State): string | null {
    return this.engine.terminations[state.termination - 1] ?? null;
  }

  /** Residual joint torques of the next actions [N m]. */
  hold(torques: Float64Array): void {
    this.engine.give(new Uint8Array(torques.buffer, torques.byteOffset, torques.byteLength));
    this.engine.checked((wasm) => wasm.hold(this.handle, torques.length));
  }

  /** Add a speed to the forward velocity of every body [m/s]. */
  kick(speed: number): void {
    this.engine.checked((wasm) => wasm.kick(this.handle, speed));
  }

  snapshot(): Uint8Array<ArrayBuffer> {
    this.engine.checked((wasm) => wasm.snapshot(this.handle));
    return this.engine.bytes();
  }

  restore(snapshot: Uint8Array): void {
    const length = this.engine.give(snapshot);
    this.engine.checked((wasm) => wasm.restore(this.handle, length));
  }

  observation(): Float32Array {
    this.engine.checked((wasm) => wasm.observation(this.handle));
    return new Float32Array(this.engine.bytes().buffer);
  }

  remove(): void {
    this.engine.call((wasm) => wasm.remove(this.handle));
  }
}
