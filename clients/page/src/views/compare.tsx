// Two versions of the map: side by side, or as their difference; and which runs were joined meanwhile.

import { useEffect, useMemo, useRef } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useLoaded } from "../cell";
import { Bounds, fitMotion } from "../geometry";
import type { Pose } from "../geometry";
import { cameraText, cameraOf } from "../map/camera";
import { loadGrid } from "../map/grid";
import type { Grid } from "../map/grid";
import { runsLayer, wallsLayer } from "../map/layers";
import { MapView } from "../map/view";
import type { Layer } from "../map/view";
import { patch, placeNow, usePlace } from "../place";
import { keptOnce, keyOf, useSite } from "../site";
import { Alert, Choice, Swatch, metres, count } from "../ui";
import { runLines } from "./chosen";

const ONLY_BEFORE = "#c0392b";
const ONLY_AFTER = "#0072b2";

interface Version {
  map: Schemas["Map"];
  grid: Grid;
  component: number;
}

export function CompareView() {
  const { site, map } = useSite();
  const { query } = usePlace();
  if (!map) return <p class="soft">There are no versions before the first map.</p>;
  const versions = [...map.versions].sort((a, b) => b - a);
  const after = Number(query.get("newer") ?? versions[0]);
  const before = Number(query.get("older") ?? versions.find((version) => version < after) ?? after);
  const options = versions.map((version) => [String(version), `version ${version}`] as const);
  return (
    <>
      <h1>Versions</h1>
      {versions.length < 2 && <p>So far there is one version; the next build makes another.</p>}
      <div class="row">
        <Choice label="Left" value={String(before)} options={options} onChange={(older) => patch({ older })} />
        <Choice label="Right" value={String(after)} options={options} onChange={(newer) => patch({ newer })} />
        <Choice label="Shown" value={query.get("show") ?? "sides"} options={[["sides", "side by side"], ["difference", "difference"]]} onChange={(show) => patch({ show })} />
      </div>
      <Compared site={site} before={before} after={after} run={query.get("around") ?? undefined} isDifference={query.get("show") === "difference"} />
    </>
  );
}

async function loadVersion(site: string, version: number, run: string | undefined): Promise<Version> {
  const map = await keptOnce(keyOf(site, version, "map"), () => api.get("/v1/sites/{site}/map", { path: { site }, query: { version } }));
  const component = map.runs.find((mapped) => mapped.run === run)?.component ?? map.components[0]?.component ?? 0;
  const grid = await keptOnce(keyOf(site, version, "grid", component), () => loadGrid(site, version, component, new AbortController().signal));
  return { map, grid, component };
}

function Compared(props: { site: string; before: number; after: number; run: string | undefined; isDifference: boolean }) {
  const { site, before, after, run, isDifference } = props;
  const loaded = useLoaded(() => Promise.all([loadVersion(site, before, run), loadVersion(site, after, run)]), [site, before, after, run].join(" "));
  if (loaded.error !== undefined) return <Alert error={loaded.error} />;
  if (!loaded.value) return <p class="soft">Loading both versions…</p>;
  const [old, now] = loaded.value;
  return (
    <>
      {isDifference ? <Difference old={old} now={now} /> : <Sides old={old} now={now} />}
      <Joined old={old} now={now} run={run} />
    </>
  );
}

/** Where the older version's component lies in the newer one, by the keyframes that both have; identity if none. */
export function newFromOld(old: Version, now: Version): Pose {
  const pairs: [{ x: number; y: number }, { x: number; y: number }][] = [];
  for (const run of now.map.runs) {
    if (run.component !== now.component) continue;
    const same = old.map.runs.find((other) => other.run === run.run && other.component === old.component);
    const poses = new Map(same?.poses.map((pose) => [pose.scan_seq, pose]));
    for (const pose of run.poses) {
      const other = poses.get(pose.scan_seq);
      if (other) pairs.push([pose, other]);
    }
  }
  return fitMotion(pairs);
}

/** Draws a layer that lives in another frame. */
function posed(layer: Layer, pose: Pose): Layer {
  return {
    draw(drawing) {
      const { context } = drawing;
      context.translate(drawing.px(pose.x), drawing.py(pose.y));
      context.rotate(-pose.theta);
      context.translate(-drawing.px(0), -drawing.py(0));
      layer.draw(drawing);
    },
  };
}

function boundsOf({ map, grid, component }: Version): Bounds {
  const bounds = grid.bounds;
  for (const run of map.runs) {
    if (run.component !== component) continue;
    for (const pose of run.poses) bounds.add(pose.x, pose.y);
  }
  return bounds;
}

function Sides({ old, now }: { old: Version; now: Version }) {
  const shared = useRef<Set<MapView>>(new Set());
  const pose = useMemo(() => newFromOld(old, now), [old, now]);
  return (
    <div class="sides">
      {[
        { version: old, pose },
        { version: now, pose: { x: 0, y: 0, theta: 0 } },
      ].map(({ version, pose: at }, idx) => (
        <figure key={idx}>
          <figcaption>
            Version {version.map.version}: {version.map.components.length === 1 ? "one component" : `${version.map.components.length} components`}, {metres(version.map.statistics.length_m)}, {count(version.map.statistics.num_verified)} matches
          </figcaption>
          <VersionCanvas shared={shared.current} layers={versionLayers(version).map((layer) => posed(layer, at))} bounds={boundsOf(now)} label={`Version ${version.map.version}`} />
        </figure>
      ))}
    </div>
  );
}

function versionLayers({ map, grid, component }: Version): Layer[] {
  return [wallsLayer(grid), runsLayer(runLines(map, component), undefined)];
}

function Difference({ old, now }: { old: Version; now: Version }) {
  const shared = useRef<Set<MapView>>(new Set());
  const pose = useMemo(() => newFromOld(old, now), [old, now]);
  // Multiplied, red and blue make dark where both have a wall.
  const layers: Layer[] = [
    {
      draw(drawing) {
        drawing.context.fillStyle = "#ffffff";
        drawing.context.fillRect(0, 0, drawing.width, drawing.height);
      },
    },
    posed({ draw: (drawing) => old.grid.draw(drawing, ONLY_BEFORE, undefined) }, pose),
    {
      draw(drawing) {
        drawing.context.globalCompositeOperation = "multiply";
        now.grid.draw(drawing, ONLY_AFTER, undefined);
      },
    },
  ];
  return (
    <figure>
      <figcaption class="row">
        <span>
          <Swatch color={ONLY_BEFORE} /> only in version {old.map.version}
        </span>
        <span>
          <Swatch color={ONLY_AFTER} /> only in version {now.map.version}
        </span>
        <span>
          <Swatch color="#2b1d3d" /> in both
        </span>
      </figcaption>
      <VersionCanvas shared={shared.current} layers={layers} bounds={boundsOf(now)} label={`Difference of versions ${old.map.version} and ${now.map.version}`} />
    </figure>
  );
}

/** A canvas that moves together with its neighbors. */
function VersionCanvas(props: { shared: Set<MapView>; layers: Layer[]; bounds: Bounds; label: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useRef<MapView | undefined>(undefined);
  useEffect(() => {
    if (!canvas.current) return;
    const made = new MapView(canvas.current);
    view.current = made;
    props.shared.add(made);
    made.onCamera = (camera) => {
      for (const other of props.shared) other.camera = camera;
      patch({ at: cameraText(camera) });
    };
    made.bounds = () => props.bounds;
    const asked = cameraOf(placeNow().query.get("at"));
    if (asked) made.camera = asked;
    else made.fit(false);
    return () => {
      props.shared.delete(made);
      made.end();
    };
  }, []);
  useEffect(() => {
    if (!view.current) return;
    view.current.layers = props.layers;
    view.current.bounds = () => props.bounds;
    view.current.redraw();
  });
  return <canvas ref={canvas} tabIndex={0} role="application" aria-label={`${props.label}. Arrow keys move, plus and minus zoom, 0 shows all.`} />;
}

/** Components of both versions, run by run. */
function Joined({ old, now, run }: { old: Version; now: Version; run: string | undefined }) {
  const parts = (version: Version) => new Map(version.map.runs.map((mapped) => [mapped.run, mapped.component]));
  const [before, after] = [parts(old), parts(now)];
  const runs = [...new Set([...before.keys(), ...after.keys()])];
  return (
    <>
      <h2>Components</h2>
      <p class="soft">Runs with the same number lie in one frame. A click shows the component of that run.</p>
      <div class="scroll" tabIndex={0} role="region" aria-label="Components of both versions">
        <table>
          <thead>
            <tr>
              <th scope="col">Run</th>
              <th scope="col">Version {old.map.version}</th>
              <th scope="col">Version {now.map.version}</th>
              <th scope="col">What happened</th>
            </tr>
          </thead>
          <tbody>
            {runs.map((name) => (
              <tr key={name}>
                <th scope="row">
                  <button type="button" class="link" aria-pressed={name === run} onClick={() => patch({ around: name, at: undefined })}>
                    {name}
                  </button>
                </th>
                <td>{before.get(name) ?? "–"}</td>
                <td>{after.get(name) ?? "–"}</td>
                <td>{happened(name, before, after)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

/** What became of a run between two versions, by the runs that shared a frame with it. */
function happened(run: string, before: Map<string, number>, after: Map<string, number>): string {
  if (!before.has(run)) return "new";
  if (!after.has(run)) return "gone";
  const mates = (parts: Map<string, number>) => [...parts].filter(([other, part]) => other !== run && part === parts.get(run)).map(([other]) => other);
  const [old, now] = [new Set(mates(before)), new Set(mates(after))];
  const joined = [...now].filter((other) => !old.has(other) && before.has(other));
  const left = [...old].filter((other) => !now.has(other) && after.has(other));
  const said = [joined.length ? `joined with ${joined.join(", ")}` : "", left.length ? `parted from ${left.join(", ")}` : ""].filter(Boolean);
  return said.join("; ") || "as before";
}
