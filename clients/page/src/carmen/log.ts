// CARMEN logs, read as `locution replay` reads them: the rules are those of `engine/src/formats/carmen.rs`, and the
// page's test compares what both make of the same files.

import type { Pose } from "../geometry";
import type { RecordedScan, Recording } from "../recording";
import { StatedLaser } from "./beams";
import type { BeamAngles } from "./beams";
import { Fields, FormatError, parseNumber, parseSecondsNs, wrapAngle } from "./fields";

/** No laser sees farther than this, metres. */
const PLAUSIBLE_RANGE_M = 200;

/** What the reader is told about a log. */
export interface CarmenOptions {
  range_max_m?: number;
  fieldOfView_deg?: number;
  skipMalformed?: boolean;
}

interface LineScan {
  message: "FLASER" | "ROBOTLASER1";
  beams: BeamAngles | undefined;
  range_max_m: number | undefined;
  robot_from_laser: Pose;
  scan: RecordedScan;
}

/** Takes a log line by line. */
export class CarmenReader {
  private numLines = 0;
  private readonly laser = new StatedLaser();
  private first: { line: number; scan: LineScan } | undefined;
  private readonly mountings: Pose[] = [];
  private readonly scans: RecordedScan[] = [];
  private readonly skipped: string[] = [];

  constructor(private readonly options: CarmenOptions = {}) {}

  get numScans(): number {
    return this.scans.length;
  }

  /** Takes the next line, without its line feed. */
  push(line: string): void {
    this.numLines++;
    const text = this.numLines === 1 ? line.replace(/^\ufeff/, "") : line;
    if (text.startsWith("PARAM ")) {
      this.laser.note(new Fields(text.slice(6), this.numLines));
      return;
    }
    try {
      this.take(parseLine(text, this.numLines));
    } catch (error) {
      if (!this.options.skipMalformed || !(error instanceof FormatError)) throw error;
      this.skipped.push(error.message);
    }
  }

  private take(scan: LineScan | undefined): void {
    if (!scan) return;
    const first = this.first?.scan;
    if (first && first.message !== scan.message) return;
    if (first) this.compare(first, scan);
    this.mountings.push(scan.robot_from_laser);
    this.scans.push(scan.scan);
    this.first ??= { line: this.numLines, scan };
  }

  private compare(first: LineScan, scan: LineScan): void {
    const [expected, given] = [first.scan.ranges_m.length, scan.scan.ranges_m.length];
    if (expected !== given) {
      throw new FormatError(this.numLines, `${given} readings, but the first scan of the log has ${expected}`);
    }
    const [a, b] = [first.beams, scan.beams];
    if (a && b && (Math.abs(a.min_rad - b.min_rad) > 1e-6 || Math.abs(a.increment_rad - b.increment_rad) > 1e-9)) {
      throw new FormatError(this.numLines, "beam angles differ from the first scan of the log");
    }
  }

  /** The recording. */
  finish(name: string): Recording {
    if (!this.first) throw new FormatError(this.numLines, "the log holds no FLASER or ROBOTLASER1 message");
    const { line, scan } = this.first;
    const numRanges = scan.scan.ranges_m.length;
    let beams = scan.beams;
    try {
      beams ??= this.laser.beams(numRanges, this.options.fieldOfView_deg);
    } catch (error) {
      throw new FormatError(line, (error as Error).message);
    }
    this.checkMeters(line);
    const geometry = {
      num_ranges: numRanges,
      angle_min_rad: beams.min_rad,
      angle_increment_rad: beams.increment_rad,
      range_max_m: this.options.range_max_m ?? rangeMax(scan.range_max_m, this.scans),
      robot_from_laser: medianMounting(this.mountings),
    };
    const { length } = this.skipped;
    const notes = length ? [`${length} lines that cannot be read are passed over; the first: ${this.skipped[0]}`] : [];
    return { name, geometry, scans: this.scans, notes };
  }

  private checkMeters(line: number): void {
    let numFar = 0;
    let count = 0;
    for (const { ranges_m } of this.scans) {
      for (const range of ranges_m) {
        if (range === Infinity) continue;
        count++;
        if (range > PLAUSIBLE_RANGE_M) numFar++;
      }
    }
    if (2 * numFar > count) {
      throw new FormatError(line, "most readings of the log are beyond 200 m: they must be metres, not millimetres");
    }
  }
}

function parseLine(line: string, number: number): LineScan | undefined {
  // Most lines of a log carry no scan; their words need not be told apart.
  const start = /^\s*(FLASER|ROBOTLASER1)(?=\s|$)/.exec(line);
  if (!start) return undefined;
  const fields = new Fields(line.slice(start[0].length), number);
  return start[1] === "FLASER" ? parseFlaser(fields) : parseRobotLaser(fields);
}

function parseFlaser(fields: Fields): LineScan {
  const ranges_m = parseReadings(fields);
  const odom_from_laser = fields.pose("laser pose");
  const odom_from_robot = fields.pose("odometry pose");
  const timestamp_ns = parseTimestamp(fields);
  return {
    message: "FLASER",
    beams: undefined,
    range_max_m: undefined,
    robot_from_laser: between(odom_from_robot, odom_from_laser),
    scan: { timestamp_ns, odom_from_robot, ranges_m },
  };
}

function parseRobotLaser(fields: Fields): LineScan {
  fields.number("laser type");
  const min_rad = fields.number("start angle");
  const fieldOfView_rad = fields.number("field of view");
  const resolution_rad = fields.number("angular resolution");
  for (const [name, angle_rad] of [["start angle", min_rad], ["field of view", fieldOfView_rad]] as const) {
    if (Math.abs(angle_rad) > 1.001 * 2 * Math.PI) {
      throw fields.error(`${name} is ${angle_rad} rad, more than a full turn: degrees?`);
    }
  }
  // Through 32 bits like the readings, so that a reading of the same text is not below it.
  const range_max_m = Math.fround(fields.number("maximum range"));
  fields.number("accuracy");
  fields.number("remission mode");
  const ranges_m = parseReadings(fields);
  const numRemissions = fields.count("number of remissions");
  for (let i = 0; i < numRemissions; i++) fields.number("remission");
  const odom_from_laser = fields.pose("laser pose");
  const odom_from_robot = fields.pose("robot pose");
  for (const name of ["translational velocity", "rotational velocity", "forward distance", "side distance", "turn axis"]) {
    fields.number(name);
  }
  const timestamp_ns = parseTimestamp(fields);
  return {
    message: "ROBOTLASER1",
    beams: { min_rad, increment_rad: resolution_rad === 0 ? fieldOfView_rad / ranges_m.length : resolution_rad },
    range_max_m: range_max_m > 0 ? range_max_m : undefined,
    robot_from_laser: between(odom_from_robot, odom_from_laser),
    scan: { timestamp_ns, odom_from_robot, ranges_m },
  };
}

/** Count and readings. What is not a positive finite number of metres is "no return". */
function parseReadings(fields: Fields): Float32Array {
  const numRanges = fields.count("number of readings");
  if (numRanges < 2) throw fields.error(`a scan of ${numRanges} readings`);
  const readings: number[] = [];
  for (let idx = 0; idx < numRanges; idx++) {
    const word = fields.word(`reading ${idx}`);
    const range_m = parseNumber(word);
    if (range_m === undefined) throw fields.error(`reading ${idx} is '${word}', not a number`);
    readings.push(Number.isFinite(range_m) && range_m >= 0 ? range_m : Infinity);
  }
  return Float32Array.from(readings);
}

function parseTimestamp(fields: Fields): bigint {
  const word = fields.word("ipc_timestamp 0");
  const timestamp_ns = parseSecondsNs(word);
  if (timestamp_ns === undefined) throw fields.error(`ipc_timestamp '${word}' is not a number of seconds`);
  return timestamp_ns;
}

function between(a: Pose, b: Pose): Pose {
  const [cos, sin] = [Math.cos(a.theta), Math.sin(a.theta)];
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  return { x: cos * dx + sin * dy, y: -sin * dx + cos * dy, theta: wrapAngle(b.theta - a.theta) };
}

/** Where "no return" begins; see the engine's function of this name for why. */
function rangeMax(stated_m: number | undefined, scans: RecordedScan[]): number {
  let largest = 0;
  let count = 0;
  for (const { ranges_m } of scans) {
    for (const range of ranges_m) {
      if (range === Infinity) continue;
      count++;
      if (range > largest) largest = range;
    }
  }
  const edge = Math.fround(Math.fround(0.97) * largest);
  const band = new Map<number, number>();
  let numInBand = 0;
  for (const { ranges_m } of scans) {
    for (const range of ranges_m) {
      if (range === Infinity || range < edge) continue;
      band.set(range, (band.get(range) ?? 0) + 1);
      numInBand++;
    }
  }
  let inferred_m = largest;
  if (numInBand * 10_000 >= count) {
    const frequent = [...band].filter(([, same]) => same * 100 >= numInBand).map(([range]) => range);
    inferred_m = frequent.length ? frequent.reduce((a, b) => Math.min(a, b)) : largest;
  } else {
    inferred_m = largest + 0.01;
  }
  return Math.max(stated_m === undefined ? inferred_m : Math.min(stated_m, inferred_m), 0.01);
}

/** The mounting that the two poses of each line agree on; the robot's center where they do not. */
function medianMounting(mountings: Pose[]): Pose {
  const median = (values: number[]) => values.sort((a, b) => a - b)[values.length >> 1] ?? 0;
  const center: Pose = {
    x: median(mountings.map((pose) => pose.x)),
    y: median(mountings.map((pose) => pose.y)),
    theta: wrapAngle(median(mountings.map((pose) => pose.theta))),
  };
  const spread_m = median(mountings.map((pose) => Math.hypot(pose.x - center.x, pose.y - center.y)));
  const spread_rad = median(mountings.map((pose) => Math.abs(wrapAngle(pose.theta - center.theta))));
  if (spread_m > 0.02 || spread_rad > 0.02) return { x: 0, y: 0, theta: 0 };
  // Half away from zero, as the engine rounds.
  const rounded = (value: number) => (Math.sign(value) * Math.floor(Math.abs(value) * 1e4 + 0.5)) / 1e4 + 0;
  return { x: rounded(center.x), y: rounded(center.y), theta: wrapAngle(rounded(center.theta)) };
}
