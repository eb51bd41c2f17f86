// Recordings from files that a person chose in the browser.

import type { Schemas } from "../api";
import { CarmenReader } from "./log";
import type { CarmenOptions, RecordedScan, Recording } from "./log";

/** Reads a log, plain or gzipped; `progress` is told the share of the file that is read. */
export async function readFile(file: File, options: CarmenOptions, progress: (share: number) => void): Promise<Recording> {
  const reader = new CarmenReader(options);
  let bytesRead = 0;
  const counted = new TransformStream<Uint8Array, Uint8Array>({
    transform(chunk, controller) {
      bytesRead += chunk.byteLength;
      controller.enqueue(chunk);
    },
  });
  const head = new Uint8Array(await file.slice(0, 2).arrayBuffer());
  const isPacked = head[0] === 0x1f && head[1] === 0x8b;
  const bytes = file.stream().pipeThrough(counted) as ReadableStream<BufferSource>;
  const unpacked = isPacked ? bytes.pipeThrough(new DecompressionStream("gzip")) : bytes;
  const texts = unpacked.pipeThrough(new TextDecoderStream("utf-8", { ignoreBOM: true })).getReader();
  let rest = "";
  let numRounds = 0;
  for (;;) {
    const { done, value } = await texts.read();
    const lines = (rest + (value ?? "")).split("\n");
    rest = done ? "" : (lines.pop() ?? "");
    // What follows the last line feed is a line only if there is something.
    if (done && lines.at(-1) === "") lines.pop();
    for (const line of lines) reader.push(line.replace(/\r+$/, ""));
    progress(bytesRead / Math.max(file.size, 1));
    if (done) break;
    // The page stays alive while a long file is read.
    if (++numRounds % 16 === 0) await new Promise((resolve) => setTimeout(resolve));
  }
  return reader.finish(runName(file.name));
}

/** The file's name without its endings, in the characters that names of runs may have. */
export function runName(fileName: string): string {
  const stem = [".gz", ".log", ".clf", ".carmen", ".txt"].reduce(
    (name, ending) => (name.endsWith(ending) ? name.slice(0, -ending.length) : name),
    fileName,
  );
  const name = [...stem.replace(/^\.+/, "")].map((letter) => (/[A-Za-z0-9._-]/.test(letter) ? letter : "-")).join("");
  return name.slice(0, 64) || "run";
}

/** A scan as the API takes it. */
export function wireScan(scan: RecordedScan, geometry: Schemas["Geometry"]): Schemas["Scan"] {
  const ranges_m = Array.from(scan.ranges_m, (range) => (range > 0 && range < geometry.range_max_m ? shortest(range) : null));
  // Nanoseconds do not fit a number of JavaScript; the API takes them as text too.
  const timestamp_ns = scan.timestamp_ns.toString() as unknown as number;
  return { timestamp_ns, odom_from_robot: scan.odom_from_robot, ranges_m };
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
