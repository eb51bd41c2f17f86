// Bytes of a file or of a chunk, read one after the other.

/** Longest record or chunk that is taken into memory, bytes; those of recorders are some megabytes. */
const RECORD_BYTES_MAX = 2 ** 30;
/** How much of a file is fetched at once. */
const WINDOW_BYTES = 4 * 2 ** 20;

export const CUT_OFF = "the file is cut off";

/** A place in bytes that are in memory; every number is little endian. */
export class ByteReader {
  at = 0;
  private readonly view: DataView;

  constructor(readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get isAtEnd(): boolean {
    return this.at >= this.bytes.length;
  }

  take(length: number): Uint8Array {
    if (length > this.bytes.length - this.at) throw new Error(CUT_OFF);
    this.at += length;
    return this.bytes.subarray(this.at - length, this.at);
  }

  u8(): number {
    return this.take(1)[0]!;
  }

  u16(): number {
    this.take(2);
    return this.view.getUint16(this.at - 2, true);
  }

  u32(): number {
    this.take(4);
    return this.view.getUint32(this.at - 4, true);
  }

  /** A length, which is refused where memory could not hold it. */
  u64(): number {
    this.take(8);
    return lengthOf(this.view.getBigUint64(this.at - 8, true));
  }

  text(): string {
    return textOf(this.take(this.u32()));
  }

  rest(): Uint8Array {
    return this.bytes.subarray(this.at);
  }
}

const DECODER = new TextDecoder();

export function textOf(bytes: Uint8Array): string {
  return DECODER.decode(bytes);
}

function lengthOf(length: bigint): number {
  if (length > BigInt(Number.MAX_SAFE_INTEGER)) throw new Error(`a record of ${length} bytes`);
  return Number(length);
}

/** A place in a file, of which a window is in memory. */
export class FileReader {
  at = 0;
  private window = new Uint8Array();
  private windowAt = 0;

  constructor(private readonly file: Blob) {}

  get isAtEnd(): boolean {
    return this.at >= this.file.size;
  }

  /** Share of the file that is read. */
  get share(): number {
    return this.at / Math.max(1, this.file.size);
  }

  async take(length: number): Promise<Uint8Array> {
    if (length > RECORD_BYTES_MAX) throw new Error(`a record of ${length} bytes`);
    if (length > this.file.size - this.at) throw new Error(CUT_OFF);
    const offset = this.at - this.windowAt;
    if (offset < 0 || offset + length > this.window.length) {
      const end = Math.min(this.file.size, this.at + Math.max(length, WINDOW_BYTES));
      this.window = new Uint8Array(await this.file.slice(this.at, end).arrayBuffer());
      this.windowAt = this.at;
    }
    const first = this.at - this.windowAt;
    this.at += length;
    return this.window.subarray(first, first + length);
  }

  async u32(): Promise<number> {
    return new ByteReader(await this.take(4)).u32();
  }

  async u64(): Promise<number> {
    return new ByteReader(await this.take(8)).u64();
  }

  skip(length: number): void {
    if (length > this.file.size - this.at) throw new Error(CUT_OFF);
    this.at += length;
  }
}

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let value = byte;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});

/** CRC-32 as zip files have it. */
export function crc32(bytes: Uint8Array): number {
  let crc = 0xffffffff;
  for (let i = 0; i < bytes.length; i++) crc = (crc >>> 8) ^ CRC_TABLE[(crc ^ bytes[i]!) & 0xff]!;
  return (crc ^ 0xffffffff) >>> 0;
}

/** The bytes of a chunk, which says how many they are. */
export function checkedLength(length: number): number {
  if (length > RECORD_BYTES_MAX) throw new Error(`a chunk of ${length} bytes`);
  return length;
}
