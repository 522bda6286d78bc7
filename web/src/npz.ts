// NumPy's .npz archives: arrays of numbers, and texts. Sizes are checked before anything is unpacked.
import { messageOf } from "./errors";

/** A file that cannot be used. The message is for people. */
export class Damaged extends Error {}

/** Numbers in the order of the file, or a text. */
export type Entry = { shape: number[]; numbers: Float64Array } | { text: string };

/** Largest unpacked entry [bytes]. */
const LARGEST = 1 << 26;
const MOST_ENTRIES = 256;
const SUFFIX = /\.npy$/;

/** The arrays of an archive by name; of others than the wanted ones nothing is read. */
export async function readNpz(bytes: Uint8Array<ArrayBuffer>, wanted?: ReadonlySet<string>): Promise<Map<string, Entry>> {
  try {
    const found = new Map<string, Entry>();
    for (const file of directory(bytes)) {
      const name = file.name.replace(SUFFIX, "");
      if (wanted === undefined || wanted.has(name)) found.set(name, readNpy(await unpack(bytes, file)));
    }
    return found;
  } catch (error) {
    throw new Damaged(`not an .npz file of numbers: ${messageOf(error)}`);
  }
}

/** Names of the arrays in an archive. */
export function namesIn(bytes: Uint8Array<ArrayBuffer>): string[] {
  try {
    return directory(bytes).map(({ name }) => name.replace(SUFFIX, ""));
  } catch (error) {
    throw new Damaged(`not an .npz file: ${messageOf(error)}`);
  }
}

interface PackedFile {
  name: string;
  method: number;
  checksum: number;
  packed: number;
  size: number;
  /** Offset of the local header [bytes]. */
  offset: number;
}

/** Directory of a zip archive (APPNOTE.TXT, sections 4.3.12 and 4.3.16). */
function directory(bytes: Uint8Array<ArrayBuffer>): PackedFile[] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let end = bytes.length - 22;
  while (end >= 0 && view.getUint32(end, true) !== 0x06054b50) end -= 1;
  if (end < 0) throw new Error("no directory");
  const count = view.getUint16(end + 10, true);
  if (count > MOST_ENTRIES) throw new Error(`${count} entries: at most ${MOST_ENTRIES} are possible`);
  let at = view.getUint32(end + 16, true);
  const files: PackedFile[] = [];
  for (let i = 0; i < count; i++) {
    if (view.getUint32(at, true) !== 0x02014b50) throw new Error("damaged directory");
    const [nameLength, extra, comment] = [28, 30, 32].map((offset) => view.getUint16(at + offset, true)) as [number, number, number];
    files.push({
      name: new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + nameLength)),
      method: view.getUint16(at + 10, true),
      checksum: view.getUint32(at + 16, true),
      packed: view.getUint32(at + 20, true),
      size: view.getUint32(at + 24, true),
      offset: view.getUint32(at + 42, true),
    });
    at += 46 + nameLength + extra + comment;
  }
  if (new Set(files.map(({ name }) => name.replace(SUFFIX, ""))).size < count) throw new Error("two entries have the same name");
  return files;
}

/** Content of a file in an archive (section 4.3.7). */
async function unpack(bytes: Uint8Array<ArrayBuffer>, file: PackedFile): Promise<Uint8Array<ArrayBuffer>> {
  if (file.size > LARGEST) throw new Error(`${file.name} is too large: at most ${LARGEST} bytes`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const start = file.offset + 30 + view.getUint16(file.offset + 26, true) + view.getUint16(file.offset + 28, true);
  const data = bytes.slice(start, start + file.packed);
  const content = file.method === 0 ? data : await inflate(data, file.size);
  if (content.length !== file.size || crc32(content) !== file.checksum) throw new Error(`${file.name} has a wrong checksum`);
  return content;
}

async function inflate(data: Uint8Array<ArrayBuffer>, size: number): Promise<Uint8Array<ArrayBuffer>> {
  const reader = new Blob([data]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
  const content = new Uint8Array(size);
  let filled = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return content.subarray(0, filled);
    if (filled + value.length > size) throw new Error("an entry is larger than its directory says");
    content.set(value, filled);
    filled += value.length;
  }
}

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let crc = n;
  for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});

function crc32(bytes: Uint8Array): number {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = (crc >>> 8) ^ (CRC_TABLE[(crc ^ byte) & 0xff] ?? 0);
  return (crc ^ 0xffffffff) >>> 0;
}

/** How a number of a type is read, and its size [bytes]. */
const TYPES: Record<string, [size: number, read: (view: DataView, at: number) => number]> = {
  "<f4": [4, (view, at) => view.getFloat32(at, true)],
  "<f8": [8, (view, at) => view.getFloat64(at, true)],
  "<i8": [8, (view, at) => Number(view.getBigInt64(at, true))],
  "|b1": [1, (view, at) => view.getUint8(at)],
  "|u1": [1, (view, at) => view.getUint8(at)],
};

/** An array in NumPy's format 1 to 3, little-endian, in C order. */
function readNpy(bytes: Uint8Array<ArrayBuffer>): Entry {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (String.fromCharCode(...bytes.subarray(1, 6)) !== "NUMPY") throw new Error("an entry is no array");
  const long = (bytes[6] ?? 1) > 1;
  const start = long ? 12 : 10;
  const length = long ? view.getUint32(8, true) : view.getUint16(8, true);
  const header = new TextDecoder().decode(bytes.subarray(start, start + length));
  const type = /'descr': '(.*?)'/.exec(header)?.[1] ?? "";
  const shape = [...(/'shape': \(([^)]*)\)/.exec(header)?.[1] ?? "").matchAll(/\d+/g)].map(([digits]) => Number(digits));
  if (header.includes("'fortran_order': True")) throw new Error("an array is in Fortran's order");
  const body = start + length;
  const count = shape.reduce((product, n) => product * n, 1);
  if (/^<U\d+$/.test(type)) {
    const points = Array.from({ length: Number(type.slice(2)) }, (_, i) => view.getUint32(body + 4 * i, true));
    return { text: points.filter((point) => point !== 0).map((point) => String.fromCodePoint(point)).join("") };
  }
  const [size, read] = TYPES[type] ?? [0, null];
  if (read === null) throw new Error(`type ${type} is not supported`);
  if (body + size * count !== bytes.length) throw new Error("an array has a wrong size");
  return { shape, numbers: Float64Array.from({ length: count }, (_, i) => read(view, body + size * i)) };
}

/** The numbers of an array of a known shape, -1 for any length; `finite` refuses infinity and NaN. */
export function numbersOf(entries: Map<string, Entry>, name: string, shape?: readonly number[], finite = true): Float64Array {
  const entry = entries.get(name);
  if (entry === undefined || !("numbers" in entry)) throw new Damaged(`array ${name} is missing`);
  const fits = shape === undefined || (shape.length === entry.shape.length && shape.every((n, i) => n === -1 || n === entry.shape[i]));
  if (!fits) throw new Damaged(`array ${name} has the shape ${entry.shape.join(" x ")}, not ${shape.join(" x ")}`);
  if (finite && !entry.numbers.every(Number.isFinite)) throw new Damaged(`array ${name} has a number that is not finite`);
  return entry.numbers;
}

/** The JSON object of a text. */
export function objectOf(entries: Map<string, Entry>, name: string): Record<string, unknown> {
  const entry = entries.get(name);
  if (entry === undefined || !("text" in entry)) throw new Damaged(`the text ${name} is missing`);
  try {
    const parsed: unknown = JSON.parse(entry.text);
    if (typeof parsed === "object" && parsed !== null) return parsed as Record<string, unknown>;
  } catch {
    // Refused below.
  }
  throw new Damaged(`the text ${name} is not a JSON object`);
}
