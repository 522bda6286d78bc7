// A learned policy, as skate_env/policy.py: a perceptron between a normaliser and a torque scale.
import { tanh } from "./elementary";
import type { Simulation } from "./engine";
import { Damaged, numbersOf, objectOf, readNpz } from "./npz";
import type { Driver } from "./run";

interface Layer {
  weight: Float64Array;
  bias: Float64Array;
}

/** Numbers that change their sign in the mirror; joints of the arms change places. */
const NEGATED = new Set(["q8", "q10", "support_leg", "feedforward.tau8", "head_error.x"]);
const PARTNERS: Record<string, string> = { q11: "q14", q12: "q15", q13: "q16", q14: "q11", q15: "q12", q16: "q13" };
/** Of the file. */
const FORMAT = 1;

export class Policy implements Driver {
  private constructor(
    private readonly layers: Layer[],
    private readonly mean: Float64Array,
    private readonly std: Float64Array,
    private readonly clip: number,
    private readonly scale: Float64Array,
    private readonly observationNames: string[],
    private readonly jointNames: string[],
    /** The scene that it was trained on, as TOML. */
    readonly scene: string,
  ) {}

  /** Read a file that `Policy.save` of the Python package wrote. */
  static async read(bytes: Uint8Array<ArrayBuffer>): Promise<Policy> {
    const entries = await readNpz(bytes);
    const { format, scene, observation_names: seen, joint_names: joints } = objectOf(entries, "text");
    if (format !== FORMAT || typeof scene !== "string" || !isNames(seen) || !isNames(joints)) {
      throw new Damaged("not a policy of format 1");
    }
    const layers: Layer[] = [];
    let inputs = seen.length;
    for (let i = 0; entries.has(`weight${i}`); i++) {
      const bias = numbersOf(entries, `bias${i}`, [-1]);
      layers.push({ weight: numbersOf(entries, `weight${i}`, [bias.length, inputs]), bias });
      inputs = bias.length;
    }
    if (layers.length === 0 || inputs !== joints.length) throw new Damaged("the layers do not fit the joints");
    const d = seen.length;
    const [mean, std, scale] = [numbersOf(entries, "mean", [d]), numbersOf(entries, "std", [d]), numbersOf(entries, "action_scale", [inputs])];
    const clip = numbersOf(entries, "clip", [])[0] ?? 0;
    return new Policy(layers, mean, std, clip, scale, seen, joints, scene);
  }

  refuses(sim: Simulation): string | null {
    // The first three coordinates are no joints.
    const joints = sim.description.coordinates.slice(3).join();
    if (joints === this.jointNames.join() && sim.observation().length === this.observationNames.length) return null;
    return `the policy moves the joints ${this.jointNames.join(", ")}; the scene has others`;
  }

  torques(sim: Simulation): Float64Array {
    return this.residual(sim.observation());
  }

  /** Residual torques [N m] for an observation. It sees every state as if the right leg supported. */
  residual(observation: Float32Array): Float64Array {
    const left = (observation[this.observationNames.indexOf("support_leg")] ?? 0) < 0;
    const seen = Float64Array.from(observation);
    let x = left ? mirrored(seen, this.observationNames) : seen;
    x = x.map((value, i) => Math.fround(Math.min(Math.max((value - (this.mean[i] ?? 0)) / (this.std[i] ?? 1), -this.clip), this.clip)));
    this.layers.forEach(({ weight, bias }, layer) => {
      const last = layer === this.layers.length - 1;
      x = bias.map((offset, row) => {
        let sum = offset;
        for (let i = 0; i < x.length; i++) sum += (weight[row * x.length + i] ?? 0) * (x[i] ?? 0);
        return Math.fround(last ? Math.min(Math.max(sum, -1), 1) : tanh(sum));
      });
    });
    const action = left ? mirrored(x, this.jointNames) : x;
    return action.map((share, i) => share * (this.scale[i] ?? 0));
  }
}

function mirrored(values: Float64Array, names: readonly string[]): Float64Array {
  return values.map((_, i) => {
    const name = names[i] ?? "";
    const [joint = "", ...before] = name.split(".").reverse();
    const partner = [...before.reverse(), PARTNERS[joint] ?? joint].join(".");
    const sign = NEGATED.has(name) || NEGATED.has(joint) ? -1 : 1;
    return sign * (values[names.indexOf(partner)] ?? 0);
  });
}

function isNames(x: unknown): x is string[] {
  return Array.isArray(x) && x.every((name) => typeof name === "string");
}
