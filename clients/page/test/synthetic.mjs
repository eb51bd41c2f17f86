// A large site that no server has to hold: what the page asks for is answered from here.

import { deflateSync } from "node:zlib";

const RUNS = 10;
const OBSERVATIONS = 10_000;
const STEP_M = 0.1;
/** Metres of the building, and of its grid's cells. */
const SIZE = { x: 200, y: 150 };
const CELL_M = 0.05;
const SCANS_PER_OBSERVATION = 2;

const runName = (idx) => `robot-${idx}`;

/** Metres from corridor to corridor, and how many there are. */
const CORRIDOR_M = 7.3;
const CORRIDORS = 20;

/** Where a run is after so many observations: up and down the corridors, beside where it drove before. */
function poseAt(idx, observation) {
  const along = observation * STEP_M + idx * 97;
  const lane = Math.floor(along / SIZE.x);
  const within = along % SIZE.x;
  const y = ((lane * RUNS + idx) % CORRIDORS) * CORRIDOR_M + 0.35 * (lane % 5) + 0.2 * Math.sin(along / 3);
  return lane % 2 ? { x: SIZE.x - within, y, theta: Math.PI } : { x: within, y, theta: 0 };
}

const sequence = (length, make) => Array.from({ length }, (_, idx) => make(idx));
const page = (items) => ({ items, next_cursor: null });
const wordSize = 12;

function mapAnswer() {
  const runs = sequence(RUNS, (idx) => ({
    run: runName(idx),
    component: 0,
    num_scans: OBSERVATIONS * SCANS_PER_OBSERVATION,
    length_m: OBSERVATIONS * STEP_M,
    poses: sequence(OBSERVATIONS / 5, (keyframe) => ({ scan_seq: keyframe * 5 * SCANS_PER_OBSERVATION, ...poseAt(idx, keyframe * 5) })),
  }));
  const statistics = { num_matches: 9000, num_verified: 4500, num_keyframes: (RUNS * OBSERVATIONS) / 5, length_m: RUNS * OBSERVATIONS * STEP_M, duration_s: 60 };
  return { version: 1, versions: [1], components: [{ component: 0, runs: runs.map(({ run }) => run) }], runs, regions: [], connections: [], statistics };
}

/** What is verified joins a place with itself two lanes later, what is rejected joins any. */
function matches() {
  return sequence(9000, (idx) => {
    const run = idx % RUNS;
    const state = idx % 2 ? "verified" : "rejected";
    const at = (idx * 37) % (OBSERVATIONS - 4000);
    const [other, to] = state === "verified" ? [run, at + (2 * SIZE.x) / STEP_M] : [(run + 3) % RUNS, OBSERVATIONS - 1 - at];
    const interval = (name, middle) => ({ run: runName(name), first: Math.max(0, middle - 30), last: middle + 30 });
    const keyframes = { earlier_keyframe: Math.floor(at / 5), later_keyframe: Math.floor(to / 5) };
    const registration = { ...keyframes, earlier_from_later: { x: 0, y: 0, theta: 0 }, covariance: [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-6]], agreement: 0.9 };
    return { id: String(idx), earlier: interval(run, at), later: interval(other, to), direction: "same", channel: ["spatial", "words", "profile"][idx % 3], evidence: { registration }, probability: 0.9, state };
  });
}

function labels() {
  return sequence(2000, (idx) => ({ run: runName(idx % RUNS), component: 0, label: ["corridor", "corner", "hall"][idx % 3], first: idx, last: idx + 9, length_m: 2, turn_rad: 0, confidence: 0.9, map_from_middle: poseAt(idx % RUNS, (idx * 43) % OBSERVATIONS) }));
}

function observations(idx) {
  return sequence(OBSERVATIONS, (observation) => ({
    observation,
    scan_seq: observation * SCANS_PER_OBSERVATION,
    timestamp_ns: observation * 1e8,
    travel_m: observation * STEP_M,
    run_from_robot: poseAt(idx, observation),
    densities: [0.5 + 0.5 * Math.sin(observation / 40)],
    is_hard: false,
    num_frontiers: 2,
  }));
}

function words() {
  return sequence(Math.floor(OBSERVATIONS / wordSize), (idx) => ({ id: { level: 0, index: idx }, class: (idx * 5) % 8, size: wordSize, turn_rad: 0, observations: [idx * wordSize, (idx + 1) * wordSize - 1], predecessors: [] }));
}

function trajectory(idx) {
  return { component: 0, poses: sequence(OBSERVATIONS, (observation) => ({ scan_seq: observation * SCANS_PER_OBSERVATION, timestamp_ns: observation * 1e8, ...poseAt(idx, observation) })) };
}

/** CRC-32 of a chunk of a picture. */
function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return (crc ^ 0xffffffff) >>> 0;
}

/** A gray picture of rooms: walls between the corridors, every 9 m along with doors in them. */
function gridPng() {
  const [width, height] = [SIZE.x / CELL_M, SIZE.y / CELL_M];
  const rows = Buffer.alloc((width + 1) * height);
  for (let row = 0; row < height; row++) {
    const y = (height - row) * CELL_M;
    const isAcross = (y + 2) % CORRIDOR_M < CELL_M * 1.5;
    for (let column = 0; column < width; column++) {
      const x = column * CELL_M;
      const isAlong = x % 9 < CELL_M * 1.5 && (y + 2) % CORRIDOR_M > 3.5;
      rows[row * (width + 1) + 1 + column] = isAcross || isAlong ? 0 : 254;
    }
  }
  const chunk = (name, data) => {
    const content = Buffer.concat([Buffer.from(name, "latin1"), data]);
    const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
    length.writeUInt32BE(data.length);
    sum.writeUInt32BE(crc32(content));
    return Buffer.concat([length, content, sum]);
  };
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  // Eight bits of gray.
  head.set([8, 0, 0, 0, 0], 8);
  const magic = Buffer.from("\x89PNG\r\n\x1a\n", "latin1");
  return Buffer.concat([magic, chunk("IHDR", head), chunk("IDAT", deflateSync(rows, { level: 1 })), chunk("IEND", Buffer.alloc(0))]);
}

/** The answer to a path of the API, or undefined. */
export function answerOf(path) {
  const under = /^\/v1\/sites\/large(?:\/(.*))?$/.exec(path)?.[1] ?? (path === "/v1/sites/large" ? "" : undefined);
  if (under === undefined) return undefined;
  const ofRun = /^runs\/robot-(\d)\/(observations|words|trajectory)$/.exec(under);
  if (ofRun) {
    const idx = Number(ofRun[1]);
    return ofRun[2] === "trajectory" ? trajectory(idx) : page(ofRun[2] === "words" ? words() : observations(idx));
  }
  const answers = {
    "": () => ({ site: "large", map_version: 1 }),
    map: mapAnswer,
    jobs: () => page([]),
    matches: () => page(matches()),
    labels: () => page(labels()),
    "map/grid.yaml": () => `image: grid.pgm\nresolution: ${CELL_M}\norigin: [0.0, -2.0, 0.0]\n`,
    "map/grid.png": gridPng,
  };
  return answers[under]?.();
}

/** How much there is to draw. */
export const SYNTHETIC = { observations: RUNS * OBSERVATIONS, keyframes: (RUNS * OBSERVATIONS) / 5, matches: 9000, cells: (SIZE.x * SIZE.y) / CELL_M ** 2 };
