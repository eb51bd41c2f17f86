// Places that answer a question by words: a list, and the stretches on the map.

import { useEffect, useMemo, useState } from "preact/hooks";
import type { Schemas } from "../api";
import { useLoaded } from "../cell";
import { poseAt } from "../drives";
import type { Point } from "../geometry";
import { stretchesLayer } from "../map/layers";
import { patch } from "../place";
import { componentOf, driveOfRun, useOverlay, useSite } from "../site";
import { many } from "../ui";

/** A stretch of a run that answers, with what is to be said of it. */
export interface Found {
  run: string;
  observations: readonly [number, number];
  title: string;
  detail: string;
}

export function foundByWords(answers: readonly Schemas["WordAnswer"][]): Found[] {
  return answers.map((answer) => ({
    run: answer.run,
    observations: [answer.observations[0] ?? 0, answer.observations[1] ?? 0],
    title: `${answer.run} ${answer.observations.join("–")}`,
    detail: `fit ${answer.fit.toFixed(2)}, read ${answer.direction === "same" ? "forwards" : "backwards"}`,
  }));
}

/** Shows answers; the chosen one is brought into view. */
export function Answers({ found }: { found: Found[] }) {
  const { site, map, component, stage } = useSite();
  const [chosen, setChosen] = useState(0);
  const runs = [...new Set(found.map(({ run }) => run))].sort();
  const drives = useLoaded(
    async () => new Map(await Promise.all((map ? runs : []).map(async (run) => [run, await driveOfRun(site, map!.version, run)] as const))),
    `${map?.version} ${runs.join()}`,
  );
  const stretches = useMemo(
    () =>
      found.map(({ run, observations, title }, idx) => {
        const drive = drives.value?.get(run);
        const points: Point[] = [];
        for (let at = observations[0]; drive && at <= observations[1]; at++) {
          const pose = poseAt(drive, at);
          if (pose) points.push(pose);
        }
        return { points, name: idx === chosen ? title : String(idx + 1), isChosen: idx === chosen, component: drive?.component };
      }),
    [found, drives.value, chosen],
  );
  const key = JSON.stringify([found, chosen, component, drives.value !== undefined]);
  useOverlay([stretchesLayer(stretches.filter((stretch) => stretch.component === component))], key);
  useEffect(() => setChosen(0), [found]);
  const choose = (idx: number) => {
    setChosen(idx);
    const home = map && componentOf(map, found[idx]?.run ?? "");
    if (home !== undefined && home !== component) patch({ component: String(home), at: undefined });
    const points = stretches[idx]?.points ?? [];
    const middle = points[Math.floor(points.length / 2)];
    if (middle) stage.view?.show(middle);
  };
  return (
    <>
      <p role="status" class="soft">
        {found.length ? `${many(found.length, "place")}, best first` : "Nowhere."}
      </p>
      <ol class="list">
        {found.map(({ title, detail }, idx) => (
          <li key={idx}>
            <button type="button" class="item" aria-pressed={idx === chosen} onClick={() => choose(idx)}>
              <span class="rank">{idx + 1}</span>
              <span class="grow">
                {title}
                <small>{detail}</small>
              </span>
            </button>
          </li>
        ))}
      </ol>
    </>
  );
}
