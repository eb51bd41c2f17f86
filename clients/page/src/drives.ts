// What a run drove and read, observation by observation, in the frame of the map.

import { api, getJson, listAll, sitePath } from "./api";
import type { Schemas } from "./api";
import { Polyline } from "./map/polyline";

/** A run, an entry for each observation; positions are not numbers where the map does not have them. */
export interface Drive {
  run: string;
  /** Component of the map; undefined in the run's own frame. */
  component: number | undefined;
  x: Float64Array;
  y: Float64Array;
  theta: Float64Array;
  scanSeq: Float64Array;
  density: Float32Array;
  densityClass: Uint8Array;
  words: Schemas["Word"][];
}

/** The drive of a run in a version of the map. */
export async function loadDrive(site: string, version: number, run: string, signal: AbortSignal): Promise<Drive> {
  const [trajectory, observations, words] = await Promise.all([
    getJson<Schemas["Trajectory"]>(`${sitePath(site, "runs", run)}/trajectory`, { frame: "map", version: String(version) }, signal),
    listAll<Schemas["Observation"]>(`${sitePath(site, "runs", run)}/observations`, {}, signal),
    listAll<Schemas["Word"]>(`${sitePath(site, "runs", run)}/words`, { level: "0" }, signal),
  ]);
  const poses = new Map(trajectory.poses.map((pose) => [pose.scan_seq, pose]));
  return driveOf(run, trajectory.component ?? undefined, observations, words, (seen) => poses.get(seen.scan_seq));
}

/** Puts observations and words of a run together, with the pose that each observation has in a frame. */
export function driveOf(
  run: string,
  component: number | undefined,
  observations: Schemas["Observation"][],
  words: Schemas["Word"][],
  poseOf: (observation: Schemas["Observation"]) => { x: number; y: number; theta: number } | undefined,
): Drive {
  const count = observations.length;
  const drive: Drive = {
    run,
    component,
    x: new Float64Array(count).fill(NaN),
    y: new Float64Array(count).fill(NaN),
    theta: new Float64Array(count).fill(NaN),
    scanSeq: new Float64Array(count),
    density: new Float32Array(count),
    densityClass: new Uint8Array(count).fill(255),
    words,
  };
  observations.forEach((observation, idx) => {
    const pose = poseOf(observation);
    if (pose) {
      drive.x[idx] = pose.x;
      drive.y[idx] = pose.y;
      drive.theta[idx] = pose.theta;
    }
    drive.scanSeq[idx] = observation.scan_seq;
    drive.density[idx] = observation.densities[0] ?? 0;
  });
  for (const word of words) drive.densityClass.fill(word.class, word.observations[0], (word.observations[1] ?? 0) + 1);
  return drive;
}

/** The path of a drive, with a color by class. */
export function pathByClass(drive: Drive): Polyline {
  return new Polyline(drive.x, drive.y, drive.densityClass);
}

/** Steps in which density is shown. */
export const DENSITY_STEPS = 16;

/** The path of a drive, with a color by density. */
export function pathByDensity(drive: Drive): Polyline {
  const steps = Uint8Array.from(drive.density, (value) => Math.min(DENSITY_STEPS - 1, Math.floor(value * DENSITY_STEPS)));
  return new Polyline(drive.x, drive.y, steps);
}

/** A pose of a drive at an observation, if the map has it. */
export function poseAt(drive: Drive, observation: number): { x: number; y: number; theta: number } | undefined {
  const [x, y, theta] = [drive.x[observation], drive.y[observation], drive.theta[observation]];
  if (x === undefined || y === undefined || theta === undefined || Number.isNaN(x)) return undefined;
  return { x, y, theta };
}

/** Scans of a run from one sequence number to another, both inclusive. */
export async function loadScans(site: string, run: string, first: number, last: number, signal?: AbortSignal): Promise<Schemas["StoredScan"][]> {
  const page = await api.get("/v1/sites/{site}/runs/{run}/scans", {
    path: { site, run },
    query: { cursor: String(first), limit: last - first + 1 },
    ...(signal ? { signal } : {}),
  });
  return page.items;
}
