// Recordings: what a laser saw, when, and where the odometry said the robot was.

import type { Schemas } from "./api";
import type { Pose } from "./geometry";

/** A scan of a recording. */
export interface RecordedScan {
  timestamp_ns: bigint;
  odom_from_robot: Pose;
  /** Metres; infinity where nothing came back, 0 where the reading says nothing. */
  ranges_m: Float32Array;
}

/** A recording: what all scans share, and the scans in file order. */
export interface Recording {
  name: string;
  geometry: Schemas["Geometry"];
  scans: RecordedScan[];
  /** What the reader chose, assumed or left out, for people. */
  notes: string[];
}

/** The file's name without its endings, in the characters that names of runs may have. */
export function runName(fileName: string): string {
  const stem = [".gz", ".log", ".clf", ".carmen", ".txt", ".mcap", ".bag"].reduce(
    (name, ending) => (name.endsWith(ending) ? name.slice(0, -ending.length) : name),
    fileName,
  );
  const name = [...stem.replace(/^\.+/, "")].map((letter) => (/[A-Za-z0-9._-]/.test(letter) ? letter : "-")).join("");
  return name.slice(0, 64) || "run";
}

/** A scan as the API takes it. */
export function wireScan(scan: RecordedScan, geometry: Schemas["Geometry"]): Schemas["Scan"] {
  const reading = (range: number) => (range === 0 ? 0 : range > 0 && range < geometry.range_max_m ? shortest(range) : null);
  // Nanoseconds do not fit a number of JavaScript; the API takes them as text too.
  const timestamp_ns = scan.timestamp_ns.toString() as unknown as number;
  return { timestamp_ns, odom_from_robot: scan.odom_from_robot, ranges_m: Array.from(scan.ranges_m, reading) };
}

/** The number with few digits that is this reading once it is rounded to 32 bits, so that less has to be sent. */
function shortest(range_m: number): number {
  const short = Number(range_m.toPrecision(7));
  return Math.fround(short) === range_m ? short : range_m;
}

/** Metres driven up to each scan, by odometry. */
export function travelOf(recording: Recording): Float64Array {
  const travel = new Float64Array(recording.scans.length);
  recording.scans.forEach(({ odom_from_robot: at }, i) => {
    const before = recording.scans[i - 1]?.odom_from_robot;
    if (before) travel[i] = travel[i - 1]! + Math.hypot(at.x - before.x, at.y - before.y);
  });
  return travel;
}
