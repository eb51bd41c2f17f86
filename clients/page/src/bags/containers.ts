// The two containers of recorded messages: MCAP and the bag of ROS 1. Read record by record, whether they have an index
// or not, so that a file that was never closed is read as far as it goes; as `clients/cli/src/bags/containers.rs` does.

import { ByteReader, CUT_OFF, FileReader, crc32, textOf } from "./bytes";
import type { Layout } from "./messages";
import { unpacked } from "./unpack";

/** Where messages of one kind stand. */
export interface Channel {
  topic: string;
  /** Type of the messages as ROS 1 says it, such as `sensor_msgs/LaserScan`. */
  kind: string;
  layout: Layout;
}

/** What is done with every message. */
export type Visit = (channel: Channel, bytes: Uint8Array) => void;

export type BagKind = "mcap" | "bag";

const MAGIC: Record<BagKind, string> = { mcap: "\x89MCAP0\r\n", bag: "#ROSBAG V2.0\n" };

/** Which container begins so, if either. */
export function bagKind(head: Uint8Array): BagKind | undefined {
  const text = String.fromCharCode(...head);
  return (["mcap", "bag"] as const).find((kind) => text.startsWith(MAGIC[kind]));
}

/** Walks through the messages of a file, in the order of its bytes. */
export async function visitMessages(file: Blob, kind: BagKind, visit: Visit, progress: (share: number) => void): Promise<void> {
  const input = new FileReader(file);
  input.skip(MAGIC[kind].length);
  await (kind === "mcap" ? visitMcap(input, visit, progress) : visitBag(input, visit, progress));
}

/** Lets the page live while a long file is read, a few times a second. */
class Breather {
  private last = performance.now();

  async breathe(share: number, progress: (share: number) => void): Promise<void> {
    if (performance.now() - this.last < 60) return;
    progress(share);
    await new Promise((resolve) => setTimeout(resolve));
    this.last = performance.now();
  }
}

const SCHEMA = 0x03;
const CHANNEL = 0x04;
const MESSAGE = 0x05;
const CHUNK = 0x06;
const DATA_END = 0x0f;

/** What an MCAP file has said so far of its channels. */
class Mcap {
  private readonly kinds = new Map<number, string>();
  private readonly channels = new Map<number, Channel>();

  constructor(private readonly visit: Visit) {}

  static isRead(opcode: number): boolean {
    return opcode >= SCHEMA && opcode <= CHUNK;
  }

  take(opcode: number, record: Uint8Array): void {
    const input = new ByteReader(record);
    if (opcode === SCHEMA) {
      const id = input.u16();
      this.kinds.set(id, input.text().replace("/msg/", "/"));
    } else if (opcode === CHANNEL) {
      const [id, schema] = [input.u16(), input.u16()];
      const [topic, encoding] = [input.text(), input.text()];
      // Others are no messages of ROS.
      if (encoding === "ros1" || encoding === "cdr") this.channels.set(id, { topic, kind: this.kinds.get(schema) ?? "", layout: encoding });
    } else if (opcode === MESSAGE) {
      const channel = this.channels.get(input.u16());
      // A counter, the time of logging and of publishing.
      input.take(4 + 8 + 8);
      if (channel) this.visit(channel, input.rest());
    } else {
      this.takeChunk(input);
    }
  }

  private takeChunk(input: ByteReader): void {
    // First and last time.
    input.take(8 + 8);
    const [length, checksum] = [input.u64(), input.u32()];
    const compression = input.text();
    const records = unpacked(input.take(input.u64()), compression, length);
    // A chunk without a checksum says 0.
    if (checksum !== 0 && crc32(records) !== checksum) throw new Error("a chunk is damaged: its checksum is wrong");
    const inner = new ByteReader(records);
    while (!inner.isAtEnd) {
      const opcode = inner.u8();
      const record = inner.take(inner.u64());
      if (Mcap.isRead(opcode)) this.take(opcode, record);
    }
  }
}

async function visitMcap(input: FileReader, visit: Visit, progress: (share: number) => void): Promise<void> {
  const mcap = new Mcap(visit);
  const breather = new Breather();
  while (!input.isAtEnd) {
    const opcode = (await input.take(1))[0]!;
    const length = await input.u64();
    if (opcode === DATA_END) return;
    if (Mcap.isRead(opcode)) mcap.take(opcode, await input.take(length));
    else input.skip(length);
    await breather.breathe(input.share, progress);
  }
  // Only the record that ends the messages says that all of them are there.
  throw new Error(CUT_OFF);
}

const BAG_MESSAGE = 0x02;
const BAG_CHUNK = 0x05;
const BAG_CONNECTION = 0x07;

type Fields = Map<string, Uint8Array>;

/** The fields of a record's header, or of a connection. */
function fieldsOf(header: Uint8Array): Fields {
  const fields: Fields = new Map();
  const input = new ByteReader(header);
  while (!input.isAtEnd) {
    const field = input.take(input.u32());
    const end = field.indexOf(0x3d);
    if (end < 0) throw new Error("a header field without a name");
    fields.set(textOf(field.subarray(0, end)), field.subarray(end + 1));
  }
  return fields;
}

function numberOf(fields: Fields, name: string): number {
  const value = fields.get(name);
  if (!value) throw new Error(`a record without the field '${name}'`);
  return new ByteReader(value).u32();
}

function textIn(fields: Fields, name: string, what: string): string {
  const value = fields.get(name);
  if (!value) throw new Error(`${what} without a ${name}`);
  return textOf(value);
}

/** A bag of ROS 1. */
class Bag {
  private readonly channels = new Map<number, Channel>();

  constructor(private readonly visit: Visit) {}

  static isRead(fields: Fields): boolean {
    const op = fields.get("op")?.[0];
    return op === BAG_MESSAGE || op === BAG_CHUNK || op === BAG_CONNECTION;
  }

  take(fields: Fields, data: Uint8Array): void {
    const op = fields.get("op")?.[0];
    if (op === BAG_MESSAGE) {
      const channel = this.channels.get(numberOf(fields, "conn"));
      if (channel) this.visit(channel, data);
    } else if (op === BAG_CONNECTION) {
      const topic = textIn(fields, "topic", "a connection");
      const kind = textIn(fieldsOf(data), "type", "a connection");
      this.channels.set(numberOf(fields, "conn"), { topic, kind, layout: "ros1" });
    } else {
      const compression = textOf(fields.get("compression") ?? new Uint8Array());
      const chunk = new ByteReader(unpacked(data, compression, numberOf(fields, "size")));
      while (!chunk.isAtEnd) {
        const inner = fieldsOf(chunk.take(chunk.u32()));
        const content = chunk.take(chunk.u32());
        if (Bag.isRead(inner)) this.take(inner, content);
      }
    }
  }
}

async function visitBag(input: FileReader, visit: Visit, progress: (share: number) => void): Promise<void> {
  const bag = new Bag(visit);
  const breather = new Breather();
  while (!input.isAtEnd) {
    const fields = fieldsOf(await input.take(await input.u32()));
    const length = await input.u32();
    if (Bag.isRead(fields)) bag.take(fields, await input.take(length));
    else input.skip(length);
    await breather.breathe(input.share, progress);
  }
}
