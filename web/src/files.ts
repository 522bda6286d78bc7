// Files that somebody opens in the page: a recording or a policy of the Python package, or a scene.
import { Damaged, namesIn } from "./npz";
import { Policy } from "./policy";
import { Recording } from "./recording";

export interface Opened {
  /** The file's scene, as TOML. */
  toml: string;
  recording?: Recording;
  policy?: Policy;
}

/** Names of files that can be opened. */
export const OPENABLE = /^[^/\\]+\.(npz|toml)$/;

/** Throws `Damaged` with the reason for a file that cannot be used. */
export async function openFile(name: string, bytes: Uint8Array<ArrayBuffer>): Promise<Opened> {
  if (name.endsWith(".toml")) return { toml: new TextDecoder().decode(bytes) };
  if (namesIn(bytes).includes("segments")) {
    const recording = await Recording.read(bytes);
    return { toml: recording.scene, recording };
  }
  if (!namesIn(bytes).includes("weight0")) throw new Damaged("neither a recording nor a policy");
  const policy = await Policy.read(bytes);
  return { toml: policy.scene, policy };
}
