// Three kinds of messages, read from their bytes: laser scans, odometry and transforms, of ROS 1 and ROS 2.

import type { Pose } from "../geometry";
import { textOf } from "./bytes";
import { rotationOf, yawOf } from "./frames";
import type { Rotation, StampedTransform } from "./frames";

/** How the bytes of messages are laid out: packed with a counter in every header, or aligned in either byte order. */
export type Layout = "ros1" | "cdr";

/** What counts of a `sensor_msgs/LaserScan`. */
export interface LaserMessage {
  timestamp_ns: bigint;
  frame: string;
  /** Direction of the first beam. */
  angleMin_rad: number;
  /** From one beam to the next; negative where the laser turns clockwise. */
  angleIncrement_rad: number;
  /** Readings below it say nothing. */
  rangeMin_m: number;
  /** Readings from it on met nothing. */
  rangeMax_m: number;
  /** As they were sent. */
  ranges_m: Float32Array;
}

/** What counts of a `nav_msgs/Odometry`. */
export interface OdometryMessage {
  timestamp_ns: bigint;
  /** The frame that it moves. */
  robotFrame: string;
  odom_from_robot: Pose;
}

export type Message =
  | { kind: "laser"; laser: LaserMessage }
  | { kind: "odometry"; odometry: OdometryMessage }
  | { kind: "transforms"; transforms: StampedTransform[] };

/** Reads a message; undefined when it is of another kind. */
export function readMessage(kind: string, bytes: Uint8Array, layout: Layout): Message | undefined {
  switch (kind) {
    case "sensor_msgs/LaserScan":
      return { kind: "laser", laser: new MessageReader(bytes, layout).laser() };
    case "nav_msgs/Odometry":
      return { kind: "odometry", odometry: new MessageReader(bytes, layout).odometry() };
    case "tf2_msgs/TFMessage":
    case "tf/tfMessage":
      return { kind: "transforms", transforms: new MessageReader(bytes, layout).transforms() };
    default:
      return undefined;
  }
}

/** A place in the bytes of a message. */
class MessageReader {
  private at = 0;
  private readonly bytes: Uint8Array;
  private readonly view: DataView;
  private readonly isLittleEndian: boolean;

  constructor(
    bytes: Uint8Array,
    private readonly layout: Layout,
  ) {
    if (layout === "cdr") {
      // Two bytes name the encoding, two are options; alignment counts from behind them.
      if (bytes.length < 4) throw new Error(`a message of ${bytes.length} bytes`);
      if (bytes[0] !== 0 || bytes[1]! > 1) throw new Error(`encoding ${bytes[0]}.${bytes[1]} is not plain CDR`);
    }
    this.isLittleEndian = layout === "ros1" || bytes[1] === 1;
    this.bytes = layout === "cdr" ? bytes.subarray(4) : bytes;
    this.view = new DataView(this.bytes.buffer, this.bytes.byteOffset, this.bytes.byteLength);
  }

  /** Where the next number of so many bytes begins. */
  private place(length: number): number {
    if (this.layout === "cdr") this.at = Math.ceil(this.at / length) * length;
    return this.skip(length);
  }

  private skip(length: number): number {
    if (length > this.bytes.length - this.at) throw new Error(`the message ends after ${this.bytes.length} bytes`);
    this.at += length;
    return this.at - length;
  }

  private u32(): number {
    return this.view.getUint32(this.place(4), this.isLittleEndian);
  }

  private f32(): number {
    return this.view.getFloat32(this.place(4), this.isLittleEndian);
  }

  private f64(): number {
    return this.view.getFloat64(this.place(8), this.isLittleEndian);
  }

  /** A frame without the slash of old bags. */
  private frame(): string {
    const length = this.u32();
    const first = this.skip(length);
    return textOf(this.bytes.subarray(first, first + length)).replace(/\0$/, "").replace(/^\/+/, "");
  }

  private header(): { timestamp_ns: bigint; frame: string } {
    if (this.layout === "ros1") this.u32();
    const [seconds, nanoseconds] = [this.u32(), this.u32()];
    return { timestamp_ns: BigInt(seconds) * 1_000_000_000n + BigInt(nanoseconds), frame: this.frame() };
  }

  laser(): LaserMessage {
    const { timestamp_ns, frame } = this.header();
    const angleMin_rad = this.f32();
    this.f32();
    const angleIncrement_rad = this.f32();
    // Time between beams and between scans.
    this.f32();
    this.f32();
    const [rangeMin_m, rangeMax_m] = [this.f32(), this.f32()];
    const count = this.u32();
    // The count is a claim until the bytes are there.
    if (count > this.bytes.length / 4) throw new Error(`${count} readings in ${this.bytes.length} bytes`);
    const ranges_m = new Float32Array(count);
    for (let beam = 0; beam < count; beam++) ranges_m[beam] = this.f32();
    return { timestamp_ns, frame, angleMin_rad, angleIncrement_rad, rangeMin_m, rangeMax_m, ranges_m };
  }

  odometry(): OdometryMessage {
    const { timestamp_ns } = this.header();
    const robotFrame = this.frame();
    const [x, y] = [this.f64(), this.f64()];
    this.f64();
    return { timestamp_ns, robotFrame, odom_from_robot: { x, y, theta: yawOf(this.rotation()) } };
  }

  private rotation(): Rotation {
    return rotationOf(this.f64(), this.f64(), this.f64(), this.f64());
  }

  transforms(): StampedTransform[] {
    const count = this.u32();
    const transforms: StampedTransform[] = [];
    for (let i = 0; i < count; i++) {
      const { timestamp_ns, frame: parent } = this.header();
      const child = this.frame();
      const translation_m: [number, number, number] = [this.f64(), this.f64(), this.f64()];
      transforms.push({ timestamp_ns, parent, child, translation_m, rotation: this.rotation() });
    }
    return transforms;
  }
}
