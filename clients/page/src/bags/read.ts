// Recordings of ROS in the browser: MCAP files and bags of ROS 1, by the rules of `clients/cli/src/bags`; the page's test
// compares what both make of the same files.

import { runName } from "../recording";
import type { RecordedScan, Recording } from "../recording";
import { BeamLayout } from "./beams";
import { visitMessages } from "./containers";
import type { BagKind, Channel } from "./containers";
import { Frames, mountingOf, yawOf } from "./frames";
import type { Mounting } from "./frames";
import { readMessage } from "./messages";
import type { LaserMessage, OdometryMessage } from "./messages";
import { OdometryTrack } from "./odometry";

export { bagKind } from "./containers";

/** Topics that are taken where a bag has several of a kind. */
const USUAL_SCANS = ["scan", "base_scan", "scan_front", "front/scan", "laser/scan"];
const USUAL_ODOMETRY = ["odom", "wheel_odom", "odometry", "odom/wheel"];

/** What the reader is told about a bag; what is left out is found. */
export interface BagOptions {
  /** Topic of `sensor_msgs/LaserScan`. */
  scanTopic?: string;
  /** Topic of `nav_msgs/Odometry`; where a bag has none, odometry is read from `/tf`. */
  odometryTopic?: string;
  /** Take what comes before the place where a file is cut off or damaged. */
  skipMalformed?: boolean;
}

/** Reads a bag. */
export async function readBag(file: File, kind: BagKind, options: BagOptions, progress: (share: number) => void): Promise<Recording> {
  const gathered = new Gathered();
  let damage: string | undefined;
  try {
    await visitMessages(file, kind, (channel, bytes) => gathered.take(channel, bytes), progress);
  } catch (error) {
    if (!options.skipMalformed) throw error;
    damage = `${error instanceof Error ? error.message : String(error)}; what follows is left out`;
  }
  const recording = gathered.recording(runName(file.name), options);
  if (damage) recording.notes.push(damage);
  return recording;
}

/** All that a bag says of lasers and motion. */
class Gathered {
  private readonly kinds = new Map<string, string>();
  private readonly scans = new Map<string, LaserMessage[]>();
  private readonly odometry = new Map<string, OdometryMessage[]>();
  /** Odometry that is told as a transform. */
  private readonly moving: OdometryMessage[] = [];
  private readonly frames = new Frames();

  take({ topic, kind, layout }: Channel, bytes: Uint8Array): void {
    if (!this.kinds.has(topic)) this.kinds.set(topic, kind);
    let message;
    try {
      message = readMessage(kind, bytes, layout);
    } catch (error) {
      throw new Error(`a message of ${topic} (${kind}): ${error instanceof Error ? error.message : String(error)}`);
    }
    if (message?.kind === "laser") pushTo(this.scans, topic, message.laser);
    if (message?.kind === "odometry") pushTo(this.odometry, topic, message.odometry);
    if (message?.kind !== "transforms") return;
    for (const said of message.transforms) {
      const parent = said.parent.split("/").at(-1);
      if (parent === "odom") {
        const [x, y] = said.translation_m;
        this.moving.push({ timestamp_ns: said.timestamp_ns, robotFrame: said.child, odom_from_robot: { x, y, theta: yawOf(said.rotation) } });
      } else if (parent !== "map") {
        this.frames.add(said);
      }
    }
  }

  recording(name: string, options: BagOptions): Recording {
    const scanTopic = choose("laser", [...this.scans.keys()], options.scanTopic, USUAL_SCANS);
    if (scanTopic === undefined) {
      const held = [...this.kinds].sort(([a], [b]) => (a < b ? -1 : 1)).map(([topic, kind]) => `${topic} (${kind})`);
      throw new Error(`no topic of sensor_msgs/LaserScan; the bag holds ${held.join(", ") || "nothing"}`);
    }
    const odometryTopic = choose("odometry", [...this.odometry.keys()], options.odometryTopic, USUAL_ODOMETRY);
    const messages = this.scans.get(scanTopic) ?? [];
    const samples = odometryTopic === undefined ? this.moving : (this.odometry.get(odometryTopic) ?? []);
    const notes = [`${scanTopic} with odometry of ${odometryTopic ?? "tf"}`];
    const [first, sample] = [messages[0], samples[0]];
    if (!sample) throw new Error("neither nav_msgs/Odometry nor a frame that moves in odom on tf: without odometry a recording says nothing");
    if (!first) throw new Error("the laser's topic carries no scan");
    const layout = new BeamLayout(first, this.mounting(sample.robotFrame, first.frame, notes));
    const track = new OdometryTrack(samples);
    const scans: RecordedScan[] = [];
    for (const message of messages) {
      const odom_from_robot = track.at(message.timestamp_ns);
      if (odom_from_robot) scans.push({ timestamp_ns: message.timestamp_ns, odom_from_robot, ranges_m: layout.ranges_m(message) });
    }
    if (scans.length === 0) throw new Error("no scan has odometry near its time");
    if (scans.length < messages.length) notes.push(`${messages.length - scans.length} scans without odometry near them are left out`);
    return { name, geometry: layout.geometry, scans, notes };
  }

  private mounting(robotFrame: string, laserFrame: string, notes: string[]): Mounting {
    const robot_from_laser = this.frames.between(robotFrame, laserFrame);
    if (!robot_from_laser) {
      notes.push(`nothing says where ${laserFrame} sits on ${robotFrame}; taken to be its center`);
      return { robot_from_laser: { x: 0, y: 0, theta: 0 }, isUpsideDown: false };
    }
    const mounting = mountingOf(robot_from_laser);
    if (mounting.isUpsideDown) notes.push(`${laserFrame} hangs upside down`);
    return mounting;
  }
}

function pushTo<T>(lists: Map<string, T[]>, name: string, item: T): void {
  const list = lists.get(name);
  if (list) list.push(item);
  else lists.set(name, [item]);
}

/** The topic that was said, the only one, or the usual one; undefined where there is none. */
function choose(what: string, found: string[], said: string | undefined, usual: string[]): string | undefined {
  found.sort();
  if (said !== undefined) {
    if (!found.includes(said)) throw new Error(`no ${what} topic ${said}; the bag has ${found.join(", ") || "none"}`);
    return said;
  }
  if (found.length <= 1) return found[0];
  for (const name of usual) {
    const topic = found.find((candidate) => candidate.replace(/^\/+|\/+$/g, "") === name);
    if (topic !== undefined) return topic;
  }
  throw new Error(`several ${what} topics: ${found.join(", ")}; name one below`);
}
