// What the views of one site share: its map, what lies on the canvas, and answers that are kept.

import { createContext } from "preact";
import { useContext, useEffect } from "preact/hooks";
import type { Schemas } from "./api";
import { listAll, sitePath } from "./api";
import { Cell } from "./cell";
import { loadDrive, poseAt } from "./drives";
import type { Drive } from "./drives";
import type { Pose } from "./geometry";
import type { PlacedMatch } from "./map/layers";
import type { Hit, Layer, MapView, Tool } from "./map/view";

/** The canvas of a site: views lay onto it what they have found. */
export class Stage {
  readonly overlay = new Cell<Layer[]>([]);
  readonly tool = new Cell<Tool | undefined>(undefined);
  /** Called with what was clicked. */
  onPick: ((hit: Hit | undefined) => void) | undefined;
  view: MapView | undefined;
}

/** A site as its views see it. */
export interface SiteState {
  site: string;
  /** The version of the map that is shown; undefined before the first build. */
  map: Schemas["Map"] | undefined;
  isLoading: boolean;
  component: number;
  jobs: Schemas["Job"][];
  stage: Stage;
  /** Asks for the map and the jobs again. */
  reload: () => void;
}

export const SiteContext = createContext<SiteState | undefined>(undefined);

export function useSite(): SiteState {
  const state = useContext(SiteContext);
  if (!state) throw new Error("a view of a site is shown without one");
  return state;
}

/** Lays layers onto the map while a view shows them. */
export function useOverlay(layers: Layer[], key: string): void {
  const { stage } = useSite();
  useEffect(() => {
    stage.overlay.set(layers);
    return () => stage.overlay.set([]);
  }, [stage, key]);
}

/** Answers about versions of maps, which do not change; the oldest are dropped. */
const kept = new Map<string, Promise<unknown>>();
const KEPT_MAX = 200;

/** An answer that is asked for once. */
export function keptOnce<T>(key: string, load: () => Promise<T>): Promise<T> {
  const known = kept.get(key);
  if (known) return known as Promise<T>;
  const loading = load();
  kept.set(key, loading);
  loading.catch(() => kept.delete(key));
  for (const oldest of kept.keys()) {
    if (kept.size <= KEPT_MAX) break;
    kept.delete(oldest);
  }
  return loading;
}

/** Drops what was kept under keys that begin so. */
export function forget(prefix: string): void {
  for (const key of [...kept.keys()]) if (key.startsWith(prefix)) kept.delete(key);
}

/** Under which key an answer about a version is kept. */
export function keyOf(site: string, version: number, ...rest: (string | number)[]): string {
  return [site, version, ...rest].join("/");
}

// What is kept serves several views, so none of them may abort it.
const NEVER = new AbortController().signal;

export function matchesOf(site: string, version: number): Promise<Schemas["Match"][]> {
  return keptOnce(keyOf(site, version, "matches"), () =>
    listAll<Schemas["Match"]>(`${sitePath(site)}/matches`, { version: String(version) }, NEVER),
  );
}

export function driveOfRun(site: string, version: number, run: string): Promise<Drive> {
  return keptOnce(keyOf(site, version, "drive", run), () => loadDrive(site, version, run, NEVER));
}

/** Where the stretches of matches lie; those that no keyframe tells need the drives of their runs. */
export async function placeMatches(site: string, map: Schemas["Map"], matches: Schemas["Match"][]): Promise<PlacedMatch[]> {
  const runs = new Map(map.runs.map((run) => [run.run, run]));
  const keyframe = (run: string, idx: number | undefined): Pose | undefined => (idx === undefined ? undefined : runs.get(run)?.poses[idx]);
  const wanted = new Set<string>();
  for (const match of matches) {
    if (!match.evidence.registration) for (const { run } of [match.earlier, match.later]) if (runs.has(run)) wanted.add(run);
  }
  const drives = new Map(await Promise.all([...wanted].map(async (run) => [run, await driveOfRun(site, map.version, run)] as const)));
  const middle = (interval: Schemas["Interval"]): Pose | undefined => {
    const drive = drives.get(interval.run);
    return drive && poseAt(drive, Math.round((interval.first + interval.last) / 2));
  };
  const placed: PlacedMatch[] = [];
  for (const match of matches) {
    const fit = match.evidence.registration;
    const earlier = keyframe(match.earlier.run, fit?.earlier_keyframe) ?? middle(match.earlier);
    const later = keyframe(match.later.run, fit?.later_keyframe) ?? middle(match.later);
    if (earlier && later) placed.push({ match, earlier, later });
  }
  return placed;
}

/** Components of the runs of a map. */
export function componentOf(map: Schemas["Map"], run: string): number | undefined {
  return map.runs.find((mapped) => mapped.run === run)?.component;
}
