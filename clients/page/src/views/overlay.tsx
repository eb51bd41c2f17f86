// The scans of both stretches of a match, laid over one another.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useLoaded } from "../cell";
import { loadScans } from "../drives";
import { Bounds, compose, inverse, move, returnsOf } from "../geometry";
import type { Point, Pose } from "../geometry";
import { drawArrow, drawReturns } from "../map/layers";
import { MapView } from "../map/view";
import type { Layer } from "../map/view";
import { Alert, Choice } from "../ui";

/** Keyframes on either side that are shown with the one that was registered. */
const KEYFRAMES_AROUND = 3;
const COLORS = { earlier: "#0072b2", later: "#d55e00" };

/** What a run saw around a keyframe, in that keyframe's frame. */
interface Sight {
  points: Point[];
  path: Point[];
}

export function ScanOverlay({ match, map, site }: { match: Schemas["Match"]; map: Schemas["Map"]; site: string }) {
  const fit = match.evidence.registration;
  const [which, setWhich] = useState("both");
  const [frame, setFrame] = useState("registered");
  const sights = useLoaded(
    async () =>
      fit
        ? Promise.all([
            loadSight(site, map, match.earlier.run, fit.earlier_keyframe),
            loadSight(site, map, match.later.run, fit.later_keyframe),
          ])
        : undefined,
    `${site} ${map.version} ${match.id}`,
  );
  const earlier_from_later = fit && (frame === "registered" ? fit.earlier_from_later : fromMap(map, match));
  if (!fit) return null;
  return (
    <figure class="overlay">
      <OverlayCanvas sights={sights.value} earlier_from_later={earlier_from_later ?? fit.earlier_from_later} which={which} />
      <Alert error={sights.error} />
      <div class="row">
        <Choice label="Shown" value={which} options={[["both", "both scans"], ["earlier", `${match.earlier.run} (blue)`], ["later", `${match.later.run} (orange)`]]} onChange={setWhich} />
        <Choice label="Posed" value={frame} options={[["registered", "as registered"], ["map", "as in the map"]]} onChange={setFrame} />
      </div>
    </figure>
  );
}

/** The relative pose that the whole map gives the two keyframes. */
function fromMap(map: Schemas["Map"], match: Schemas["Match"]): Pose | undefined {
  const fit = match.evidence.registration;
  const pose = (run: string, idx: number | undefined) => (idx === undefined ? undefined : map.runs.find((mapped) => mapped.run === run)?.poses[idx]);
  const earlier = pose(match.earlier.run, fit?.earlier_keyframe);
  const later = pose(match.later.run, fit?.later_keyframe);
  return earlier && later && compose(inverse(earlier), later);
}

async function loadSight(site: string, map: Schemas["Map"], run: string, keyframe: number): Promise<Sight> {
  const poses = map.runs.find((mapped) => mapped.run === run)?.poses ?? [];
  const around = poses.slice(Math.max(0, keyframe - KEYFRAMES_AROUND), keyframe + KEYFRAMES_AROUND + 1);
  const center = poses[keyframe];
  const [first, last] = [around[0], around.at(-1)];
  if (!center || !first || !last) return { points: [], path: [] };
  const [info, scans] = await Promise.all([
    api.get("/v1/sites/{site}/runs/{run}", { path: { site, run } }),
    loadScans(site, run, first.scan_seq, last.scan_seq),
  ]);
  const bySequence = new Map(scans.map((scan) => [scan.scan_seq, scan]));
  const points: Point[] = [];
  const path: Point[] = [];
  for (const pose of around) {
    const scan = bySequence.get(pose.scan_seq);
    const center_from_robot = compose(inverse(center), pose);
    path.push(center_from_robot);
    for (const point of scan ? returnsOf(scan, info.geometry) : []) points.push(move(center_from_robot, point));
  }
  return { points, path };
}

function OverlayCanvas(props: { sights: [Sight, Sight] | undefined; earlier_from_later: Pose; which: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const view = useRef<MapView | undefined>(undefined);
  const { sights, earlier_from_later, which } = props;
  const bounds = useMemo(() => {
    const found = new Bounds();
    for (const point of sights?.[0].points ?? []) if (Math.hypot(point.x, point.y) < 15) found.add(point.x, point.y);
    return found;
  }, [sights]);
  useEffect(() => {
    if (!canvas.current) return;
    view.current = new MapView(canvas.current);
    return () => view.current?.end();
  }, []);
  useEffect(() => {
    if (!view.current) return;
    view.current.bounds = () => bounds;
    view.current.fit(false);
  }, [bounds]);
  useEffect(() => {
    if (!view.current || !sights) return;
    const [earlier, later] = sights;
    view.current.layers = [
      ...(which === "later" ? [] : [sightLayer(earlier, { x: 0, y: 0, theta: 0 }, COLORS.earlier)]),
      ...(which === "earlier" ? [] : [sightLayer(later, earlier_from_later, COLORS.later)]),
    ];
    view.current.redraw();
  }, [sights, which, earlier_from_later.x, earlier_from_later.y, earlier_from_later.theta]);
  return <canvas ref={canvas} tabIndex={0} role="application" aria-label="Scans of both stretches over one another. Arrow keys move, plus and minus zoom, 0 shows all." />;
}

function sightLayer({ points, path }: Sight, pose: Pose, color: string): Layer {
  return {
    draw(drawing) {
      drawing.context.globalAlpha = 0.75;
      drawReturns(drawing, pose, points, color, 2.5);
      drawing.context.globalAlpha = 1;
      drawing.context.strokeStyle = color;
      drawing.context.lineWidth = 1.5;
      drawing.context.beginPath();
      for (const at of path) {
        const moved = move(pose, at);
        drawing.context.lineTo(drawing.px(moved.x), drawing.py(moved.y));
      }
      drawing.context.stroke();
      drawArrow(drawing, pose, color, 9);
    },
  };
}
