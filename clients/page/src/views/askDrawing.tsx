// A question by a stretch of path, drawn on the map: its words are those of the run that drove there.

import { useEffect, useMemo, useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useAction } from "../cell";
import type { Drive } from "../drives";
import type { Point } from "../geometry";
import { stretchesLayer } from "../map/layers";
import { usePlace, patch } from "../place";
import { driveOfRun, useOverlay, useSite } from "../site";
import { Alert } from "../ui";
import { Answers, foundByWords } from "./answers";
import { OBSERVATION_M } from "./note";
import { wirePattern, patternsOf, wordsText } from "./words";

/** A path is compared at points this far apart, metres. */
const STEP_M = 0.2;
/** A run that is farther from the drawn path than this did not drive it, metres in the mean. */
const NEAR_M = 1.5;
const WORDS_MAX = 64;

/** A stretch of a run: `drawn=run:first-last` in the address. */
interface Stretch {
  run: string;
  first: number;
  last: number;
}

function stretchOf(text: string | null): Stretch | undefined {
  const parts = /^(.+):(\d+)-(\d+)$/.exec(text ?? "");
  return parts ? { run: parts[1]!, first: Number(parts[2]), last: Number(parts[3]) } : undefined;
}

export function AskByDrawing() {
  const { site, map, component, stage } = useSite();
  const { query } = usePlace();
  const stretch = stretchOf(query.get("drawn"));
  const [answers, setAnswers] = useState<Schemas["WordAnswer"][] | undefined>();
  const [drive, setDrive] = useState<Drive | undefined>();
  const ask = useAction(async (drawn: Point[] | undefined) => {
    if (!map) return;
    const runs = map.runs.filter((run) => run.component === component).map((run) => run.run);
    let asked = stretch;
    if (drawn) {
      const drives = await Promise.all(runs.map((run) => driveOfRun(site, map.version, run)));
      asked = nearestStretch(drives, drawn);
      if (!asked) throw new Error("No run drove along what you drew. Draw along a path on the map.");
      patch({ drawn: `${asked.run}:${asked.first}-${asked.last}` });
    }
    if (!asked) return;
    const { run, first, last } = asked;
    const driven = await driveOfRun(site, map.version, run);
    setDrive(driven);
    const words = driven.words.filter(({ observations }) => observations[1]! >= first && observations[0]! <= last).slice(0, WORDS_MAX);
    if (!words.length) throw new Error("There is no word along this stretch.");
    const patterns = patternsOf(wordsText(words)).map(wirePattern);
    setAnswers(await api.post("/v1/sites/{site}/queries/words", { path: { site }, body: { words: patterns, limit: 50 } }));
  });
  useEffect(() => {
    stage.tool.set({ kind: "path", take: (points, isDone) => isDone && void ask.run([...points]) });
    return () => stage.tool.set(undefined);
  }, [stage, map, component]);
  useEffect(() => {
    if (stretch) void ask.run(undefined);
  }, [map?.version]);
  const found = useMemo(() => foundByWords(answers ?? []), [answers]);
  return (
    <>
      <p class="soft">Draw along a path on the map. What the robot read there is looked up in all runs. Two fingers still move the map; with keys, press Enter at each corner and twice at the end.</p>
      {stretch && (
        <p>
          {stretch.run}, observations {stretch.first}–{stretch.last}: {((stretch.last - stretch.first) * OBSERVATION_M).toFixed(1)} m
        </p>
      )}
      {ask.isRunning && <p class="soft">Asking…</p>}
      <Alert error={ask.error} />
      {answers ? <Answers found={found} /> : drive === undefined && <Nothing />}
    </>
  );
}

/** Keeps the overlay empty until there is an answer. */
function Nothing() {
  useOverlay([stretchesLayer([])], "");
  return null;
}

/** The stretch of a run that follows a drawn path best. */
export function nearestStretch(drives: readonly Drive[], drawn: readonly Point[]): Stretch | undefined {
  const path = resampled(drawn);
  if (path.length < 2) return undefined;
  let best: (Stretch & { cost: number }) | undefined;
  for (const drive of drives) {
    // Whoever draws does not know which way the robot went.
    for (const way of [path, [...path].reverse()]) {
      const found = follow(drive, way);
      if (found && found.cost < (best?.cost ?? NEAR_M)) best = { ...found, run: drive.run };
    }
  }
  return best && { run: best.run, first: best.first, last: best.last };
}

/** Follows a path along a drive from every observation near its beginning, each for as many metres as the path has. */
function follow(drive: Drive, path: readonly Point[]): { first: number; last: number; cost: number } | undefined {
  const start = path[0]!;
  const per = Math.max(1, Math.round(STEP_M / OBSERVATION_M));
  let best: { first: number; last: number; cost: number } | undefined;
  for (let first = 0; first < drive.x.length; first++) {
    if (!(Math.hypot(drive.x[first]! - start.x, drive.y[first]! - start.y) < 2 * NEAR_M)) continue;
    let sum = 0;
    let at = first;
    for (const point of path) {
      // The robot and the hand do not keep the same pace: the nearest observation just ahead counts.
      let nearest = Infinity;
      let next = at;
      for (let ahead = at; ahead <= at + 3 * per && ahead < drive.x.length; ahead++) {
        const distance = Math.hypot(drive.x[ahead]! - point.x, drive.y[ahead]! - point.y);
        if (distance < nearest) [nearest, next] = [distance, ahead];
      }
      sum += Math.min(nearest, 4 * NEAR_M);
      at = next;
    }
    const cost = sum / path.length;
    if (at > first && cost < (best?.cost ?? Infinity)) best = { first, last: at, cost };
  }
  return best;
}

function resampled(drawn: readonly Point[]): Point[] {
  const path: Point[] = drawn[0] ? [drawn[0]] : [];
  for (const point of drawn) {
    let last = path.at(-1)!;
    for (let left = Math.hypot(point.x - last.x, point.y - last.y); left >= STEP_M; left -= STEP_M) {
      const share = STEP_M / left;
      last = { x: last.x + share * (point.x - last.x), y: last.y + share * (point.y - last.y) };
      path.push(last);
    }
  }
  return path;
}
