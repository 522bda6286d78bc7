// NumPy's .npz archives: arrays of floating-point numbers and texts.

export class Damaged extends Error {}

/** Numbers in the order of the file, or a text. */
export type Entry = { shape: number[]; numbers: Float64Array } | { text: string };

/** Largest unpacked entry [bytes]. */
const LARGEST = 1 << 26;

/** All arrays of an archive by name. */
export async function readNpz(bytes: Uint8Array<ArrayBuffer>): Promise<Map<string, Entry>> {
  try {
    const found = new Map<string, Entry>();
    for (const { name, content } of await unzip(bytes)) {
      found.set(name.replace(/\.npy$/, ""), readNpy(content));
    }
    return found;
  } catch (error) {
    throw new Damaged(`not an .npz file of numbers: ${error instanceof Error ? error.message : String(error)}`);
  }
}

interface File {
  name: string;
  content: Uint8Array<ArrayBuffer>;
}

/** Files of a zip archive (APPNOTE.TXT, sections 4.3.7, 4.3.12 and 4.3.16). */
async function unzip(bytes: Uint8Array<ArrayBuffer>): Promise<File[]> {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let end = bytes.length - 22;
  while (end >= 0 && view.getUint32(end, true) !== 0x06054b50) end -= 1;
  if (end < 0) throw new Error("no directory");
  const count = view.getUint16(end + 10, true);
  let at = view.getUint32(end + 16, true);
  const files: File[] = [];
  for (let i = 0; i < count; i++) {
    if (view.getUint32(at, true) !== 0x02014b50) throw new Error("damaged directory");
    const method = view.getUint16(at + 10, true);
    const packed = view.getUint32(at + 20, true);
    if (view.getUint32(at + 24, true) > LARGEST) throw new Error("an entry is too large");
    const [nameLength, extra, comment] = [28, 30, 32].map((offset) => view.getUint16(at + offset, true)) as [number, number, number];
    const local = view.getUint32(at + 42, true);
    const name = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + nameLength));
    const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
    const data = bytes.slice(start, start + packed);
    files.push({ name, content: method === 0 ? data : await inflate(data) });
    at += 46 + nameLength + extra + comment;
  }
  return files;
}

async function inflate(data: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  const stream = new Blob([data]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** An array in NumPy's format 1 to 3, little-endian, in C order. */
function readNpy(bytes: Uint8Array<ArrayBuffer>): Entry {
  const view = new DataView(bytes.buffer);
  if (String.fromCharCode(...bytes.subarray(1, 6)) !== "NUMPY") throw new Error("an entry is no array");
  const long = (bytes[6] ?? 1) > 1;
  const start = long ? 12 : 10;
  const length = long ? view.getUint32(8, true) : view.getUint16(8, true);
  const header = new TextDecoder().decode(bytes.subarray(start, start + length));
  const type = /'descr': '(.*?)'/.exec(header)?.[1] ?? "";
  const shape = [...(/'shape': \(([^)]*)\)/.exec(header)?.[1] ?? "").matchAll(/\d+/g)].map(([digits]) => Number(digits));
  if (header.includes("'fortran_order': True")) throw new Error("an array is in Fortran's order");
  const body = start + length;
  const size = shape.reduce((product, n) => product * n, 1);
  if (/^<U\d+$/.test(type)) {
    const points = Array.from({ length: Number(type.slice(2)) }, (_, i) => view.getUint32(body + 4 * i, true));
    return { text: points.filter((point) => point !== 0).map((point) => String.fromCodePoint(point)).join("") };
  }
  if (type !== "<f4" && type !== "<f8") throw new Error(`type ${type} is not supported`);
  const read = (i: number) => (type === "<f4" ? view.getFloat32(body + 4 * i, true) : view.getFloat64(body + 8 * i, true));
  return { shape, numbers: Float64Array.from({ length: size }, (_, i) => read(i)) };
}
