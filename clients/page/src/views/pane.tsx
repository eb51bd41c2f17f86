// The map itself: canvas, scale bar, legend, and what is clicked.

import { useEffect, useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
import { useCell, useLoaded } from "../cell";
import { Bounds } from "../geometry";
import type { Point } from "../geometry";
import { cameraOf, cameraText, scaleBar } from "../map/camera";
import { loadGrid } from "../map/grid";
import type { Grid } from "../map/grid";
import { MapView } from "../map/view";
import type { Hit } from "../map/view";
import { addressOf, go, patch, placeNow, usePlace } from "../place";
import { keptOnce, keyOf, useSite } from "../site";
import type { SiteState } from "../site";
import { Alert, Go } from "../ui";
import { useLayers } from "./chosen";
import { Legend } from "./legend";
import { AnnotationNote, RoomNote } from "./named";
import { MapChoice } from "./site";
import { WordNote } from "./note";

export function MapPane() {
  const state = useSite();
  const { site, map, component, stage } = state;
  const canvas = useRef<HTMLCanvasElement>(null);
  const [scale, setScale] = useState(20);
  const [pointer, setPointer] = useState<Point | undefined>();
  const [note, setNote] = useState<Hit | undefined>();
  const grid = useLoaded(
    async () =>
      map ? keptOnce(keyOf(site, map.version, "grid", component), () => loadGrid(site, map.version, component, new AbortController().signal)) : undefined,
    map ? keyOf(site, map.version, component) : "",
  );
  // What was clicked in one view says nothing in the next.
  const view = usePlace().path.join("/");
  useEffect(() => setNote(undefined), [view]);
  const layers = useLayers(state, grid.value);
  const overlay = useCell(stage.overlay);
  const tool = useCell(stage.tool);
  useView(state, canvas, grid.value, { setScale, setPointer, setNote });
  // At once, since a key may be pressed before the next picture is drawn.
  useLayoutEffect(() => {
    if (!stage.view) return;
    stage.view.layers = [...layers.layers, ...overlay];
    stage.view.tool = tool;
    stage.view.redraw();
  }, [layers.layers, overlay, tool, stage.view]);
  return (
    <div class={tool ? "pane aiming" : "pane"}>
      <canvas
        ref={canvas}
        tabIndex={0}
        role="application"
        aria-label={`Map of ${site}. Arrow keys move it, plus and minus zoom, 0 shows all, Enter picks what is in the middle.`}
      />
      {map ? <MapChoice state={state} /> : <NoMap />}
      <div class="tools" role="group" aria-label="Zoom">
        <button type="button" title="Zoom in" aria-label="Zoom in" onClick={() => stage.view?.zoom(1.5)}>
          +
        </button>
        <button type="button" title="Zoom out" aria-label="Zoom out" onClick={() => stage.view?.zoom(1 / 1.5)}>
          −
        </button>
        <button type="button" title="Show everything" aria-label="Show everything" onClick={() => stage.view?.fit()}>
          ⤢
        </button>
      </div>
      {map && <Legend layers={layers} />}
      <ScaleBar scale={scale} pointer={pointer} />
      <div class="notes" aria-live="polite">
        {layers.busy && <p class="note">{layers.busy}</p>}
        {(grid.error !== undefined || layers.error !== undefined) && <Alert error={grid.error ?? layers.error} />}
        {note && <Picked hit={note} onClose={() => setNote(undefined)} />}
      </div>
    </div>
  );
}

interface Setters {
  setScale: (scale: number) => void;
  setPointer: (point: Point | undefined) => void;
  setNote: (hit: Hit | undefined) => void;
}

/** Makes the view of the canvas, and keeps address and camera the same. */
function useView(state: SiteState, canvas: { current: HTMLCanvasElement | null }, grid: Grid | undefined, set: Setters): void {
  const { stage, map, component, site } = state;
  const bounds = useMemo(() => boundsOf(state, grid), [map, component, grid]);
  const name = `${site}/${component}`;
  const shown = useRef("");
  const current = useRef(name);
  current.current = name;
  const asked = usePlace().query.get("at");
  const written = useRef(asked);
  const timer = useRef(0);
  useEffect(() => {
    if (!canvas.current) return;
    const view = new MapView(canvas.current);
    stage.view = view;
    view.onCamera = (camera) => {
      set.setScale(camera.scale);
      // Who has moved the map does not want it fitted when its walls come.
      shown.current = current.current;
      window.clearTimeout(timer.current);
      timer.current = window.setTimeout(() => {
        written.current = cameraText(camera);
        patch({ at: written.current });
      }, 300);
    };
    view.onPoint = set.setPointer;
    return () => {
      window.clearTimeout(timer.current);
      view.end();
      stage.view = undefined;
    };
  }, [stage]);
  useEffect(() => {
    const { view } = stage;
    if (!view) return;
    view.bounds = () => bounds;
    view.onPick = (hit) => {
      if (stage.onPick) stage.onPick(hit);
      else if (hit?.kind === "match") go(["sites", site, "matches", hit.id], placeNow().query);
      set.setNote(hit?.kind === "match" ? undefined : hit);
    };
    const camera = cameraOf(placeNow().query.get("at"));
    if (map && shown.current !== name) {
      // The first time the address decides, then what there is to see.
      if (camera) view.camera = camera;
      else view.fit(false);
      set.setScale(view.camera.scale);
      // The path is there before the walls, which belong into the picture too.
      if (grid) shown.current = name;
    }
  }, [stage.view, bounds, site, component]);
  useEffect(() => {
    // An address that was not written here is a link that was followed.
    const camera = asked === written.current ? undefined : cameraOf(asked);
    written.current = asked;
    if (!camera || !stage.view) return;
    window.clearTimeout(timer.current);
    stage.view.camera = camera;
    set.setScale(camera.scale);
  }, [asked]);
}

function boundsOf({ map, component }: SiteState, grid: Grid | undefined): Bounds {
  const bounds = new Bounds();
  for (const run of map?.runs ?? []) {
    if (run.component !== component) continue;
    for (const pose of run.poses) {
      bounds.add(pose.x, pose.y);
    }
  }
  if (grid) {
    const walls = grid.bounds;
    bounds.add(walls.low.x, walls.low.y);
    bounds.add(walls.high.x, walls.high.y);
  }
  return bounds;
}

function ScaleBar({ scale, pointer }: { scale: number; pointer: Point | undefined }) {
  const { length_m, pixels } = scaleBar(scale);
  return (
    <div class="scale">
      <span class="position">{pointer ? `${pointer.x.toFixed(2)}, ${pointer.y.toFixed(2)} m` : ""}</span>
      <span class="bar" style={{ width: `${pixels}px` }} data-length={length_m}>
        {length_m >= 1 ? `${length_m} m` : `${Math.round(100 * length_m)} cm`}
      </span>
    </div>
  );
}

function NoMap() {
  const { site, isLoading } = useSite();
  if (isLoading) return <p class="nomap">Loading the map…</p>;
  return (
    <div class="nomap">
      <h2>No map yet</h2>
      <p>
        Send recordings under <Go to={addressOf(["sites", site, "runs"])}>Runs</Go>. The map is built when a run ends;{" "}
        <Go to={addressOf(["sites", site, "jobs"])}>Jobs</Go> shows how far it is.
      </p>
    </div>
  );
}

function Picked({ hit, onClose }: { hit: Hit; onClose: () => void }) {
  const { site } = useSite();
  return (
    <div class="note">
      {hit.kind === "note" && <p>{hit.text}</p>}
      {hit.kind === "run" && (
        <p>
          Run <Go to={addressOf(["sites", site, "runs", hit.run], placeNow().query)}>{hit.run}</Go>
        </p>
      )}
      {hit.kind === "room" && <RoomNote room={hit.room} onClose={onClose} />}
      {hit.kind === "annotation" && <AnnotationNote annotation={hit.annotation} onClose={onClose} />}
      {hit.kind === "word" && <WordNote run={hit.run} observation={hit.observation} />}
      <button type="button" class="close" aria-label="Close" onClick={onClose}>
        ×
      </button>
    </div>
  );
}
