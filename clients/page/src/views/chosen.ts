// Which layers the address asks for, and what they show.

import { useMemo } from "preact/hooks";
import { listAll, sitePath } from "../api";
import type { Schemas } from "../api";
import { Cell, useCell, useLoaded } from "../cell";
import { LABEL_COLORS } from "../colors";
import { pathByClass, pathByDensity } from "../drives";
import type { Point } from "../geometry";
import type { Grid } from "../map/grid";
import { annotationsLayer, doorsLayer } from "../map/drawn";
import { areasLayer, changesLayer, labelsLayer, matchesLayer, roomColor, runsLayer, wallsLayer, wordsLayer } from "../map/layers";
import type { Area, RunLine } from "../map/layers";
import { Polyline } from "../map/polyline";
import type { Layer } from "../map/view";
import { usePlace } from "../place";
import { driveOfRun, keptOnce, keyOf, matchesOf, placeMatches } from "../site";
import type { SiteState } from "../site";
import { many } from "../ui";

/** Layers in the order in which they are drawn, with what they are called. */
export const LAYERS = [
  ["walls", "Walls"],
  ["rooms", "Rooms"],
  ["places", "Places"],
  ["words", "Words under the path"],
  ["runs", "Runs"],
  ["matches", "Matches"],
  ["labels", "Labels"],
  ["changes", "Changes"],
  ["annotations", "Annotations"],
] as const;

export type LayerName = (typeof LAYERS)[number][0];

const SHOWN_AT_FIRST = "walls,runs,matches";
export const STATES = ["verified", "candidate", "rejected"] as const;
export const CHANNELS = ["spatial", "words", "profile"] as const;

/** Counts what people named and drew here, so that it is asked for again. */
export const annotated = new Cell(0);

/** What the address says of layers. */
export interface Choice {
  shown: Set<string>;
  states: Set<string>;
  channels: Set<string>;
  isByDensity: boolean;
}

export function useChoice(): Choice {
  const { query } = usePlace();
  const set = (name: string, unless: string) => new Set((query.get(name) ?? unless).split(",").filter(Boolean));
  return {
    shown: set("layers", SHOWN_AT_FIRST),
    states: set("state", "verified"),
    channels: set("channel", CHANNELS.join()),
    isByDensity: query.get("color") === "density",
  };
}

/** Rooms as areas, with the doors between them. */
interface RoomsShown {
  areas: Area[];
  doors: Point[];
}

/** The layers that are shown. */
export interface Layers {
  choice: Choice;
  layers: Layer[];
  /** Runs of the component, for the legend. */
  runs: RunLine[];
  /** What is still being loaded, in words. */
  busy: string | undefined;
  error: unknown;
}

export function useLayers(state: SiteState, grid: Grid | undefined): Layers {
  const choice = useChoice();
  const { path, query } = usePlace();
  const { map, component } = state;
  const chosenMatch = path[2] === "matches" ? path[3] : undefined;
  const chosenRun = path[2] === "runs" ? path[3] : undefined;
  const runs = useMemo(() => runLines(map, component), [map, component]);
  const isShown = (name: LayerName) => map !== undefined && choice.shown.has(name);
  const key = (name: LayerName, ...rest: string[]) => (map && isShown(name) ? keyOf(state.site, map.version, component, name, ...rest) : "");
  const words = useLoaded(() => loadWords(state, key("words")), key("words"));
  const matches = useLoaded(async () => (key("matches") && map ? placeMatches(state.site, map, filtered(map, component, await matchesOf(state.site, map.version), choice)) : []), key("matches", [...choice.states].join(), [...choice.channels].join()));
  const labels = useLoaded(() => list<Schemas["Label"]>(state, key("labels"), "labels", {}), key("labels"));
  const places = useLoaded(() => list<Schemas["Place"]>(state, key("places"), "places", { component: String(component) }), key("places"));
  const round = String(useCell(annotated));
  const rooms = useLoaded(() => loadRooms(state, key("rooms", round)), key("rooms", round));
  const annotations = useLoaded(() => list<Schemas["Annotation"]>(state, key("annotations", round), "annotations", { component: String(component) }), key("annotations", round));
  const sessions = [query.get("before") ?? "", query.get("after") ?? ""];
  const changes = useLoaded(() => list<Schemas["Change"]>(state, key("changes"), "changes", { before: sessions[0]!, after: sessions[1]! }), key("changes", ...sessions));

  const wordLines = useMemo(
    () => (words.value ?? []).map((drive) => ({ drive, line: choice.isByDensity ? pathByDensity(drive) : pathByClass(drive) })),
    [words.value, choice.isByDensity],
  );
  const made: Record<LayerName, () => Layer | undefined> = {
    walls: () => grid && wallsLayer(grid),
    rooms: () => rooms.value && together([areasLayer(rooms.value.areas), doorsLayer(rooms.value.doors)]),
    places: () => places.value && areasLayer(places.value.map(areaOfPlace)),
    words: () => wordsLayer(wordLines, choice.isByDensity),
    runs: () => runsLayer(runs, chosenRun),
    matches: () => matches.value && matchesLayer(matches.value, chosenMatch),
    labels: () => labels.value && labelsLayer(labels.value.filter((label) => label.component === component)),
    annotations: () => annotations.value && annotationsLayer(annotations.value),
    changes: () => changes.value && changesLayer(changes.value.filter((change) => change.component === component)),
  };
  const parts = { words, matches, labels, places, rooms, changes, annotations };
  const layers = useMemo(
    () => LAYERS.filter(([name]) => isShown(name)).map(([name]) => made[name]()).filter((layer) => layer !== undefined),
    [grid, runs, wordLines, chosenRun, chosenMatch, [...choice.shown].join(), ...Object.values(parts).map(({ value }) => value)],
  );
  const waiting = LAYERS.filter(([name]) => isShown(name) && name in parts && parts[name as keyof typeof parts].isLoading);
  return {
    choice,
    layers,
    runs,
    busy: waiting.length ? `Loading ${waiting.map(([, title]) => title.toLowerCase()).join(", ")}…` : undefined,
    error: Object.values(parts).find(({ error }) => error !== undefined)?.error,
  };
}

/** Several layers as one; the first that was hit counts. */
function together(parts: Layer[]): Layer {
  return {
    draw: (drawing) => parts.forEach((part) => part.draw(drawing)),
    pick: (point, radius_m) => parts.map((part) => part.pick?.(point, radius_m)).find(Boolean),
  };
}

/** The runs of a component as lines. */
export function runLines(map: Schemas["Map"] | undefined, component: number): RunLine[] {
  return (map?.runs ?? []).flatMap((run, idx) => {
    if (run.component !== component) return [];
    const line = new Polyline(
      Float64Array.from(run.poses, (pose) => pose.x),
      Float64Array.from(run.poses, (pose) => pose.y),
      new Uint8Array(run.poses.length),
    );
    return [{ run: run.run, idx, line }];
  });
}

/** Matches of a component in the states and channels chosen. */
export function filtered(map: Schemas["Map"], component: number, matches: Schemas["Match"][], choice: Choice): Schemas["Match"][] {
  const here = new Set(map.runs.filter((run) => run.component === component).map((run) => run.run));
  return matches.filter(
    (match) => choice.states.has(match.state) && choice.channels.has(match.channel) && here.has(match.earlier.run) && here.has(match.later.run),
  );
}

async function loadWords(state: SiteState, key: string) {
  const { map, site, component } = state;
  if (!map || !key) return [];
  const runs = map.runs.filter((run) => run.component === component);
  const drives = [];
  // One run after the other: a large site is many megabytes.
  for (const { run } of runs) drives.push(await driveOfRun(site, map.version, run));
  return drives;
}

async function list<T>(state: SiteState, key: string, name: string, query: Record<string, string>): Promise<T[]> {
  const { map, site } = state;
  if (!map || !key) return [];
  const said = Object.entries(query).filter(([, value]) => value !== "");
  return keptOnce(key, () => listAll<T>(`${sitePath(site)}/${name}`, { ...Object.fromEntries(said), version: String(map.version) }, new AbortController().signal));
}

function areaOfPlace(place: Schemas["Place"]): Area {
  const color = LABEL_COLORS[place.label] ?? "#888888";
  const note = `${place.length_m.toFixed(1)} m, ${Math.round(100 * place.confidence)} % of the passes agree`;
  return { name: place.label, note, color, outline: place.outline, holes: [], center: place.centre };
}

async function loadRooms(state: SiteState, key: string): Promise<RoomsShown> {
  const { component } = state;
  const rooms = await list<Schemas["Room"]>(state, key, "rooms", { component: String(component) });
  // Both rooms of a door tell of it.
  const doors = new Map(rooms.flatMap((room) => room.doors.map(({ position }) => [`${position.x} ${position.y}`, position] as const)));
  return { areas: rooms.map(areaOfRoom), doors: [...doors.values()] };
}

function areaOfRoom(room: Schemas["Room"], idx: number): Area {
  const rings = room.geometry.type === "Polygon" ? room.geometry.coordinates : [];
  const [outline = [], ...holes] = rings.map((ring) => ring.map(([x = 0, y = 0]) => ({ x, y })));
  return {
    name: room.name ?? `${room.label} ${room.id}`,
    note: `${room.area_m2.toFixed(1)} m², ${many(room.doors.length, "door")}`,
    color: roomColor(idx),
    outline,
    holes,
    center: room.centre,
    hit: { kind: "room", room },
  };
}
