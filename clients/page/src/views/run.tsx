// One run: where it drove, what it saw last, and its text; of a run that is still driven, as it grows.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { api, listAll, sitePath } from "../api";
import type { Schemas } from "../api";
import { useLoaded, useRepeated } from "../cell";
import { classColor } from "../colors";
import { driveOf, loadScans, pathByClass } from "../drives";
import type { Drive } from "../drives";
import { Bounds, returnsOf } from "../geometry";
import { drawArrow, drawReturns, wordsLayer } from "../map/layers";
import { MapView } from "../map/view";
import { addressOf, go, usePlace } from "../place";
import { componentOf, forget, useSite } from "../site";
import { Alert, Confirm, Figures, Go, count, degrees, metres } from "../ui";
import { DensityChart } from "./chart";
import { OBSERVATION_M } from "./note";
import { wordsText } from "./words";

export function RunView() {
  const { site, map } = useSite();
  const { path, query } = usePlace();
  const run = path[3] ?? "";
  const live = useLiveRun(site, run);
  const info = live.value?.info;
  const component = map && componentOf(map, run);
  return (
    <>
      <p>
        <Go to={addressOf(["sites", site, "runs"], query)}>← All runs</Go>
      </p>
      <h1>
        {run} {info?.state === "open" && <span class="state live">live</span>}
      </h1>
      <Alert error={live.error} />
      {info && live.value && (
        <>
          <Figures
            figures={[
              ["Robot", info.robot ?? "not told"],
              ["Scans", count(info.num_scans)],
              ["Observations", count(info.num_observations)],
              ["Words", count(info.num_words)],
              ["Laser", `${info.geometry.num_ranges} beams, ${metres(info.geometry.range_max_m)}`],
              ["In the map", component === undefined ? "not yet" : `component ${component}`],
            ]}
          />
          <h2>In its own frame</h2>
          <RunCanvas drive={live.value.drive} scan={live.value.scan} geometry={info.geometry} isLive={info.state === "open"} />
          <h2>Density along the way</h2>
          <DensityChart drive={live.value.drive} />
          <h2>Its text</h2>
          <Text drive={live.value.drive} />
          <DeleteRun info={info} />
        </>
      )}
    </>
  );
}

function DeleteRun({ info }: { info: Schemas["Run"] }) {
  const { site, reload } = useSite();
  const { query } = usePlace();
  const [isAsking, setAsking] = useState(false);
  const { run } = info;
  const remove = async () => {
    await api.delete("/v1/sites/{site}/runs/{run}", { path: { site, run } });
    forget(`${site}/`);
    reload();
    go(["sites", site, "runs"], query);
  };
  return (
    <>
      <h2>Delete</h2>
      <p class="soft">Its scans and its text are gone at once; the next map, which is built right away, does not hold it.</p>
      <button type="button" class="danger" onClick={() => setAsking(true)}>
        Delete this run…
      </button>
      {isAsking && (
        <Confirm title={`Delete ${run}?`} word={run} verb="Delete it" act={remove} onClose={() => setAsking(false)}>
          <p>{count(info.num_scans)} scans will be deleted. This cannot be undone.</p>
        </Confirm>
      )}
    </>
  );
}

interface LiveRun {
  info: Schemas["Run"];
  drive: Drive;
  scan: Schemas["StoredScan"] | undefined;
}

/** The run, and again every two seconds while it grows; only what is new is asked for. */
function useLiveRun(site: string, run: string) {
  const known = useRef<{ observations: Schemas["Observation"][]; numWords: number; words: Schemas["Word"][] }>({ observations: [], numWords: -1, words: [] });
  const loaded = useLoaded(async (signal): Promise<LiveRun> => {
    const info = await api.get("/v1/sites/{site}/runs/{run}", { path: { site, run }, signal });
    const { current } = known;
    const query = current.observations.length ? { cursor: String(current.observations.length) } : {};
    if (current.observations.length < info.num_observations) {
      current.observations.push(...(await listAll<Schemas["Observation"]>(`${sitePath(site, "runs", run)}/observations`, query as Record<string, string>, signal)));
    }
    if (current.numWords !== info.num_words) {
      current.words = await listAll<Schemas["Word"]>(`${sitePath(site, "runs", run)}/words`, { level: "0" }, signal);
      current.numWords = info.num_words;
    }
    const last = info.num_scans ? await loadScans(site, run, info.num_scans - 1, info.num_scans - 1, signal) : [];
    return { info, drive: driveOf(run, undefined, current.observations, current.words, (seen) => seen.run_from_robot), scan: last[0] };
  }, `${site} ${run}`);
  useRepeated(async () => {
    if (loaded.value?.info.state === "open") loaded.reload();
  }, 2000);
  return loaded;
}

function RunCanvas(props: { drive: Drive; scan: Schemas["StoredScan"] | undefined; geometry: Schemas["Geometry"]; isLive: boolean }) {
  const { drive, scan, geometry, isLive } = props;
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useRef<MapView | undefined>(undefined);
  const [isFollowing, setFollowing] = useState(true);
  const bounds = useMemo(() => {
    const found = new Bounds();
    drive.x.forEach((x, i) => found.add(x, drive.y[i]!));
    return found;
  }, [drive]);
  useEffect(() => {
    if (!canvas.current) return;
    const made = new MapView(canvas.current);
    view.current = made;
    made.onCamera = () => setFollowing(false);
    return () => made.end();
  }, []);
  useEffect(() => {
    const made = view.current;
    if (!made) return;
    const last = drive.x.length - 1;
    const pose = { x: drive.x[last] ?? 0, y: drive.y[last] ?? 0, theta: drive.theta[last] ?? 0 };
    const points = scan ? returnsOf(scan, geometry) : [];
    made.layers = [
      { draw: (drawing) => drawReturns(drawing, pose, points, drawing.isDark ? "#a6b0c0" : "#5b6472", 2) },
      wordsLayer([{ drive, line: pathByClass(drive) }], false),
      { draw: (drawing) => drawArrow(drawing, pose, isLive ? "#d6336c" : "#23272f", 9) },
    ];
    made.bounds = () => bounds;
    if (isFollowing) made.fit(false);
    else made.redraw();
  }, [drive, scan]);
  return (
    <figure class="overlay">
      <canvas ref={canvas} tabIndex={0} role="application" aria-label="The path of the run, colored by density class. Arrow keys move, plus and minus zoom, 0 shows all." />
    </figure>
  );
}

const WORDS_SHOWN = 300;

function Text({ drive }: { drive: Drive }) {
  const { site } = useSite();
  const [shown, setShown] = useState(WORDS_SHOWN);
  if (!drive.words.length) return <p class="soft">No word yet: a word is complete when the density changes.</p>;
  return (
    <>
      <p class="soft">Class, metres and turn of each word. A word is a link to the places that read like it and its neighbors.</p>
      <div class="text">
        {drive.words.slice(0, shown).map((word, idx) => (
          <Go
            key={idx}
            class="chip"
            title={`class ${word.class}, ${(word.size * OBSERVATION_M).toFixed(1)} m, turns ${degrees(word.turn_rad)}`}
            to={addressOf(["sites", site, "ask"], { words: wordsText(drive.words.slice(Math.max(0, idx - 1), idx + 2)) })}
          >
            <i style={{ background: classColor(word.class) }} />
            {word.class}·{(word.size * OBSERVATION_M).toFixed(1)}
            {Math.abs(word.turn_rad) > 0.26 ? `·${degrees(word.turn_rad)}` : ""}
          </Go>
        ))}
      </div>
      {drive.words.length > shown && (
        <button type="button" class="plain" onClick={() => setShown(shown + WORDS_SHOWN)}>
          Show more of {count(drive.words.length)} words
        </button>
      )}
    </>
  );
}
