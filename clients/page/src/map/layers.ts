// What can be laid onto a map.

import type { Schemas } from "../api";
import { CHANGE_COLORS, CHANNEL_DASHES, CLASS_COLORS, LABEL_COLORS, ROOM_COLORS, STATE_COLORS, runColor } from "../colors";
import { DENSITY_STEPS } from "../drives";
import type { Drive } from "../drives";
import { Bounds, ellipseOf } from "../geometry";
import type { Point, Pose } from "../geometry";
import type { Drawing } from "./camera";
import type { Grid } from "./grid";
import { strokePolylines } from "./polyline";
import type { Polyline } from "./polyline";
import type { Hit, Layer } from "./view";

export function wallsLayer(grid: Grid, isFaint = false): Layer {
  return {
    draw(drawing) {
      const wall = isFaint ? (drawing.isDark ? "#5b626e" : "#a6aab2") : drawing.isDark ? "#d5d9e0" : "#2f343d";
      grid.draw(drawing, wall, drawing.isDark ? "#1d2128" : "#ffffff");
    },
  };
}

/** A run of the map with its place in the list, which gives its color. */
export interface RunLine {
  run: string;
  idx: number;
  line: Polyline;
}

export function runsLayer(lines: RunLine[], chosen: string | undefined): Layer {
  return {
    draw(drawing) {
      for (const { run, idx, line } of lines) {
        drawing.context.globalAlpha = chosen && chosen !== run ? 0.25 : 1;
        strokePolylines(drawing, [line], [runColor(idx)], run === chosen ? 3.5 : 2);
      }
    },
    pick(point, radius_m) {
      const near = lines.map(({ run, line }) => ({ run, distance_m: distanceTo(line, point) }));
      near.sort((a, b) => a.distance_m - b.distance_m);
      const best = near[0];
      // Everything else is smaller and lies on a run, so a run is picked last.
      return best && best.distance_m < radius_m
        ? { hit: { kind: "run", run: best.run }, distance_m: best.distance_m + radius_m }
        : undefined;
    },
  };
}

function distanceTo(line: { x: Float64Array; y: Float64Array }, point: Point): number {
  let best = Infinity;
  for (let i = 0; i < line.x.length; i++) {
    const distance = Math.hypot(line.x[i]! - point.x, line.y[i]! - point.y);
    if (distance < best) best = distance;
  }
  return best;
}

/** A drive with its path colored by what is shown. */
export interface WordLine {
  drive: Drive;
  line: Polyline;
}

/** A color for each step of density, dark where it is narrow. */
export function densityColors(): string[] {
  return Array.from({ length: DENSITY_STEPS }, (_, step) => {
    const at = (step / (DENSITY_STEPS - 1)) * (CLASS_COLORS.length - 1);
    const low = CLASS_COLORS[Math.floor(at)] ?? "#000000";
    const high = CLASS_COLORS[Math.ceil(at)] ?? low;
    const share = at % 1;
    const channel = (color: string, i: number) => Number.parseInt(color.slice(1 + 2 * i, 3 + 2 * i), 16);
    const mixed = [0, 1, 2].map((i) => Math.round(channel(low, i) * (1 - share) + channel(high, i) * share));
    return `#${mixed.map((value) => value.toString(16).padStart(2, "0")).join("")}`;
  });
}

export function wordsLayer(lines: WordLine[], isByDensity: boolean): Layer {
  const colors = isByDensity ? densityColors() : [...CLASS_COLORS, "#9aa0aa"];
  return {
    draw(drawing) {
      strokePolylines(drawing, lines.map(({ line }) => line), colors, Math.min(7, Math.max(3, drawing.camera.scale * 0.18)));
    },
    pick(point, radius_m) {
      let best: { run: string; observation: number; distance_m: number } | undefined;
      for (const { drive } of lines) {
        for (let i = 0; i < drive.x.length; i++) {
          const distance_m = Math.hypot(drive.x[i]! - point.x, drive.y[i]! - point.y);
          if (distance_m < (best?.distance_m ?? radius_m)) best = { run: drive.run, observation: i, distance_m };
        }
      }
      return best && {
        hit: { kind: "word", run: best.run, observation: best.observation },
        distance_m: best.distance_m + radius_m / 2,
      };
    },
  };
}

/** A match with where both of its stretches are in the map. */
export interface PlacedMatch {
  match: Schemas["Match"];
  earlier: Pose;
  later: Pose;
}

export function matchesLayer(matches: PlacedMatch[], chosen: string | undefined): Layer {
  const groups = new Map<string, PlacedMatch[]>();
  for (const placed of matches) {
    const name = `${placed.match.state} ${placed.match.channel}`;
    groups.set(name, [...(groups.get(name) ?? []), placed]);
  }
  return {
    draw(drawing) {
      for (const [name, group] of groups) drawMatches(drawing, name, group);
      const placed = matches.find(({ match }) => match.id === chosen);
      if (placed) drawChosen(drawing, placed);
    },
    pick(point, radius_m) {
      let best: { id: string; distance_m: number } | undefined;
      for (const { match, earlier, later } of matches) {
        const distance_m = distanceToLine(point, earlier, later);
        if (distance_m < (best?.distance_m ?? radius_m)) best = { id: match.id, distance_m };
      }
      return best && { hit: { kind: "match", id: best.id }, distance_m: best.distance_m };
    },
  };
}

/** Most dashes of one kind of match; more would blur into a line, and take their time. */
const DASHES_MAX = 1500;
/** More matches of one kind than this are drawn thin. */
const MATCHES_THIN = 500;

function drawMatches(drawing: Drawing, name: string, group: PlacedMatch[]): void {
  const [state = "", channel = ""] = name.split(" ");
  const { context } = drawing;
  const shown = group.filter(({ earlier, later }) => drawing.isInView(earlier, later));
  context.strokeStyle = STATE_COLORS[state] ?? "#888888";
  context.fillStyle = context.strokeStyle;
  context.globalAlpha = state === "rejected" ? 0.55 : 0.9;
  // Lines of a pixel are drawn the quick way.
  context.lineWidth = shown.length > MATCHES_THIN ? 1 : 1.5;
  const dashes = CHANNEL_DASHES[channel] ?? [];
  const period = dashes.reduce((sum, part) => sum + part, 0);
  // What is shorter than a dash and its gap is a dash.
  const [dashed, solid] = [new Path2D(), new Path2D()];
  let numDashes = 0;
  for (const { earlier, later } of shown) {
    const [x, y] = [drawing.px(earlier.x), drawing.py(earlier.y)];
    const [toX, toY] = [drawing.px(later.x), drawing.py(later.y)];
    const length = Math.min(Math.abs(toX - x) + Math.abs(toY - y), drawing.width + drawing.height);
    const path = length > period && period > 0 ? dashed : solid;
    if (path === dashed) numDashes += length / period;
    path.moveTo(x, y);
    path.lineTo(toX, toY);
  }
  context.stroke(solid);
  context.setLineDash(numDashes < DASHES_MAX ? dashes : []);
  context.stroke(dashed);
  context.setLineDash([]);
  // Both ends, so that a match shows that is shorter than a pixel.
  const size = drawing.camera.scale > 15 ? 5 : 3;
  for (const { earlier, later } of shown) {
    for (const end of [earlier, later]) {
      context.fillRect(drawing.px(end.x) - size / 2, drawing.py(end.y) - size / 2, size, size);
    }
  }
}

function drawChosen(drawing: Drawing, { earlier, later }: PlacedMatch): void {
  const { context } = drawing;
  context.strokeStyle = drawing.ink;
  context.lineWidth = 2.5;
  context.beginPath();
  context.moveTo(drawing.px(earlier.x), drawing.py(earlier.y));
  context.lineTo(drawing.px(later.x), drawing.py(later.y));
  context.stroke();
  for (const [end, color] of [[earlier, "#0072b2"], [later, "#d55e00"]] as const) drawArrow(drawing, end, color, 12);
}

export function distanceToLine(point: Point, a: Point, b: Point): number {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const squared = dx * dx + dy * dy;
  const share = squared ? Math.max(0, Math.min(1, ((point.x - a.x) * dx + (point.y - a.y) * dy) / squared)) : 0;
  return Math.hypot(a.x + share * dx - point.x, a.y + share * dy - point.y);
}

/** A pose as an arrow head of so many pixels. */
export function drawArrow(drawing: Drawing, pose: Pose, color: string, size: number): void {
  const { context } = drawing;
  context.save();
  context.translate(drawing.px(pose.x), drawing.py(pose.y));
  context.rotate(-pose.theta);
  context.beginPath();
  context.moveTo(size, 0);
  context.lineTo(-0.7 * size, 0.65 * size);
  context.lineTo(-0.35 * size, 0);
  context.lineTo(-0.7 * size, -0.65 * size);
  context.closePath();
  context.fillStyle = color;
  context.fill();
  context.strokeStyle = drawing.isDark ? "#000000" : "#ffffff";
  context.lineWidth = 1.5;
  context.stroke();
  context.restore();
}

export function labelsLayer(labels: Schemas["Label"][]): Layer {
  const names = labels.map((label) => ({ at: label.map_from_middle, text: label.label }));
  return {
    draw(drawing) {
      for (const label of labels) {
        const { x, y } = label.map_from_middle;
        if (!drawing.isInView(label.map_from_middle, label.map_from_middle)) continue;
        drawDisc(drawing, { x, y }, LABEL_COLORS[label.label] ?? "#888888", 5.5);
      }
      if (drawing.camera.scale > 14) drawNames(drawing, names, 9, false);
    },
    pick(point, radius_m) {
      const near = labels.map((label) => ({ label, distance_m: Math.hypot(label.map_from_middle.x - point.x, label.map_from_middle.y - point.y) }));
      const best = near.sort((a, b) => a.distance_m - b.distance_m)[0];
      if (!best || best.distance_m > radius_m) return undefined;
      const { label } = best;
      const text = `${label.label}, ${label.length_m.toFixed(1)} m long, driven by ${label.run}; ${Math.round(100 * label.confidence)} % of what was seen agrees`;
      return { hit: { kind: "note", text }, distance_m: best.distance_m };
    },
  };
}

export function drawDisc(drawing: Drawing, at: Point, color: string, radius: number): void {
  const { context } = drawing;
  context.beginPath();
  context.arc(drawing.px(at.x), drawing.py(at.y), radius, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
  context.strokeStyle = drawing.isDark ? "#000000" : "#ffffff";
  context.lineWidth = 1.5;
  context.stroke();
}

/** A text beside a point, readable on walls. */
export function drawText(drawing: Drawing, at: Point, text: string, offset = 0, isCentered = false): void {
  const { context } = drawing;
  context.font = "600 12px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.textAlign = isCentered ? "center" : "left";
  context.lineWidth = 3.5;
  context.lineJoin = "round";
  context.strokeStyle = drawing.paper;
  context.strokeText(text, drawing.px(at.x) + offset, drawing.py(at.y));
  context.fillStyle = drawing.ink;
  context.fillText(text, drawing.px(at.x) + offset, drawing.py(at.y));
}

/** Texts at points, the most telling first; one that would lie on another is left out. */
export function drawNames(drawing: Drawing, names: readonly { at: Point; text: string }[], offset: number, isCentered: boolean): void {
  const taken: { left: number; right: number; y: number }[] = [];
  for (const { at, text } of names) {
    if (!drawing.isInView(at, at)) continue;
    const width = text.length * NAME_LETTER_PX;
    const left = drawing.px(at.x) + offset - (isCentered ? width / 2 : 0);
    const box = { left, right: left + width, y: drawing.py(at.y) };
    if (taken.some((other) => Math.abs(other.y - box.y) < NAME_LINE_PX && other.left < box.right && box.left < other.right)) continue;
    taken.push(box);
    drawText(drawing, at, text, offset, isCentered);
  }
}

const NAME_LETTER_PX = 7;
const NAME_LINE_PX = 15;

/** An area with a name. */
export interface Area {
  name: string;
  note: string;
  color: string;
  outline: Point[];
  holes: Point[][];
  center: Point;
  /** What a click on it picks; its name and note unless said. */
  hit?: Hit;
}

export function areasLayer(areas: Area[]): Layer {
  const extent = ({ outline }: Area) => {
    const bounds = new Bounds();
    for (const { x, y } of outline) bounds.add(x, y);
    return (bounds.high.x - bounds.low.x) * (bounds.high.y - bounds.low.y);
  };
  const bySize = areas.map((area) => ({ area, size: extent(area) })).sort((a, b) => b.size - a.size);
  const names = bySize.map(({ area }) => ({ at: area.center, text: area.name }));
  return {
    draw(drawing) {
      const { context } = drawing;
      for (const area of areas) {
        context.beginPath();
        for (const ring of [area.outline, ...area.holes]) {
          ring.forEach((point, i) => context[i ? "lineTo" : "moveTo"](drawing.px(point.x), drawing.py(point.y)));
          context.closePath();
        }
        context.fillStyle = area.color;
        context.globalAlpha = drawing.isDark ? 0.3 : 0.24;
        context.fill("evenodd");
        context.globalAlpha = 1;
        context.strokeStyle = area.color;
        context.lineWidth = 1.5;
        context.stroke();
      }
      if (drawing.camera.scale > 8) drawNames(drawing, names, 0, true);
    },
    pick(point, radius_m) {
      const area = areas.find(({ outline, holes }) => isInside(point, outline) && !holes.some((hole) => isInside(point, hole)));
      return area && { hit: area.hit ?? { kind: "note", text: `${area.name}: ${area.note}` }, distance_m: 1.8 * radius_m };
    },
  };
}

function isInside(point: Point, outline: Point[]): boolean {
  let inside = false;
  outline.forEach((a, i) => {
    const b = outline[(i + outline.length - 1) % outline.length]!;
    const crosses = a.y > point.y !== b.y > point.y;
    if (crosses && point.x < ((b.x - a.x) * (point.y - a.y)) / (b.y - a.y) + a.x) inside = !inside;
  });
  return inside;
}

export function roomColor(idx: number): string {
  return ROOM_COLORS[idx % ROOM_COLORS.length] ?? "#56b4e9";
}

export function changesLayer(changes: Schemas["Change"][]): Layer {
  return {
    draw(drawing) {
      const { context } = drawing;
      for (const change of changes) {
        const [left, top] = [drawing.px(change.low.x) - 3, drawing.py(change.high.y) - 3];
        const [right, bottom] = [drawing.px(change.high.x) + 3, drawing.py(change.low.y) + 3];
        context.strokeStyle = CHANGE_COLORS[change.kind] ?? "#888888";
        context.fillStyle = context.strokeStyle;
        context.globalAlpha = 0.25;
        context.fillRect(left, top, right - left, bottom - top);
        context.globalAlpha = 1;
        context.lineWidth = 2;
        context.strokeRect(left, top, right - left, bottom - top);
      }
    },
    pick(point, radius_m) {
      const change = changes.find(({ low, high }) => point.x > low.x - radius_m && point.x < high.x + radius_m && point.y > low.y - radius_m && point.y < high.y + radius_m);
      if (!change) return undefined;
      const text = `${change.kind}: ${change.area_m2.toFixed(2)} m² of surface, ${Math.round(100 * change.confidence)} % sure`;
      return { hit: { kind: "note", text }, distance_m: radius_m / 2 };
    },
  };
}

/** Stretches that answer a question. */
export interface Stretch {
  points: Point[];
  name: string;
  isChosen: boolean;
}

export function stretchesLayer(stretches: Stretch[]): Layer {
  return {
    draw(drawing) {
      const { context } = drawing;
      const ordered = [...stretches].sort((a, b) => Number(a.isChosen) - Number(b.isChosen));
      for (const { points, isChosen } of ordered) {
        context.beginPath();
        for (const point of points) context.lineTo(drawing.px(point.x), drawing.py(point.y));
        context.lineCap = "round";
        context.lineJoin = "round";
        context.strokeStyle = drawing.paper;
        context.lineWidth = isChosen ? 13 : 9;
        context.stroke();
        context.strokeStyle = isChosen ? "#d6336c" : "#f08fb3";
        context.lineWidth = isChosen ? 8 : 5;
        context.stroke();
      }
      for (const { points, name } of ordered) {
        const middle = points[Math.floor(points.length / 2)];
        if (middle && name) drawText(drawing, middle, name, 10);
      }
    },
  };
}

/** Where a robot may be. */
export interface Guess {
  pose: Pose;
  covariance: readonly (readonly number[])[];
  probability: number;
  name: string;
  /** Returns of its last scan in its own frame, drawn where the guess would see them. */
  returns?: Point[];
}

export function guessesLayer(guesses: Guess[]): Layer {
  return {
    draw(drawing) {
      // The likeliest is drawn last, on top.
      for (const guess of [...guesses].reverse()) drawGuess(drawing, guess);
    },
  };
}

function drawGuess(drawing: Drawing, { pose, covariance, probability, name, returns }: Guess): void {
  const { context } = drawing;
  context.globalAlpha = 0.35 + 0.65 * probability;
  if (returns) drawReturns(drawing, pose, returns, "#d6336c", 2.5);
  const { a, b, theta } = ellipseOf(covariance);
  context.beginPath();
  context.ellipse(drawing.px(pose.x), drawing.py(pose.y), Math.max(a * drawing.camera.scale, 8), Math.max(b * drawing.camera.scale, 8), -theta, 0, 2 * Math.PI);
  context.fillStyle = "#d6336c33";
  context.fill();
  context.strokeStyle = "#d6336c";
  context.lineWidth = 1.5;
  context.stroke();
  drawArrow(drawing, pose, "#d6336c", 10 + 6 * probability);
  context.globalAlpha = 1;
  drawText(drawing, pose, name, 18);
}

/** The returns of a scan where a pose puts them. */
export function drawReturns(drawing: Drawing, pose: Pose, returns: Point[], color: string, size: number): void {
  const { context } = drawing;
  const cos = Math.cos(pose.theta);
  const sin = Math.sin(pose.theta);
  context.fillStyle = color;
  for (const point of returns) {
    const x = drawing.px(pose.x + cos * point.x - sin * point.y);
    const y = drawing.py(pose.y + sin * point.x + cos * point.y);
    context.fillRect(x - size / 2, y - size / 2, size, size);
  }
}
