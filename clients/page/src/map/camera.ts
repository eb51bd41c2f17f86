// What part of the plane a canvas shows.

import { Bounds } from "../geometry";
import type { Point } from "../geometry";

/** The middle of the view in metres, and pixels of the screen per metre. */
export interface Camera {
  x: number;
  y: number;
  scale: number;
}

export const SCALE_MIN = 0.02;
export const SCALE_MAX = 2000;

/** A camera as it stands in an address. */
export function cameraText(camera: Camera): string {
  const decimals = Math.max(0, Math.min(4, Math.ceil(Math.log10(camera.scale)) + 1));
  return `${camera.x.toFixed(decimals)},${camera.y.toFixed(decimals)},${Number(camera.scale.toPrecision(4))}`;
}

export function cameraOf(text: string | null): Camera | undefined {
  const [x, y, scale] = (text ?? "").split(",").map(Number);
  if (x === undefined || y === undefined || scale === undefined) return undefined;
  if (![x, y, scale].every(Number.isFinite) || scale <= 0) return undefined;
  return { x, y, scale: Math.min(Math.max(scale, SCALE_MIN), SCALE_MAX) };
}

/** The camera that shows a box with a little room around. */
export function cameraFor(bounds: Bounds, width: number, height: number, margin_m = 1.5): Camera {
  const wide = bounds.high.x - bounds.low.x + 2 * margin_m;
  const high = bounds.high.y - bounds.low.y + 2 * margin_m;
  return {
    x: (bounds.low.x + bounds.high.x) / 2,
    y: (bounds.low.y + bounds.high.y) / 2,
    scale: Math.min(Math.max(Math.min(width / wide, height / high), SCALE_MIN), SCALE_MAX),
  };
}

/** One picture being drawn: the canvas, in pixels of the screen, and where metres lie on it. */
export class Drawing {
  readonly low: Point;
  readonly high: Point;

  constructor(
    readonly context: CanvasRenderingContext2D,
    readonly camera: Camera,
    readonly width: number,
    readonly height: number,
    readonly isDark: boolean,
  ) {
    const half = { x: width / 2 / camera.scale, y: height / 2 / camera.scale };
    this.low = { x: camera.x - half.x, y: camera.y - half.y };
    this.high = { x: camera.x + half.x, y: camera.y + half.y };
  }

  px(x: number): number {
    return this.width / 2 + (x - this.camera.x) * this.camera.scale;
  }

  py(y: number): number {
    return this.height / 2 - (y - this.camera.y) * this.camera.scale;
  }

  /** Whether the box around two points may be seen; with the room that what is drawn there takes. */
  isInView(a: Point, b: Point, margin_px = 120): boolean {
    const margin = margin_px / this.camera.scale;
    return (
      Math.max(a.x, b.x) > this.low.x - margin &&
      Math.min(a.x, b.x) < this.high.x + margin &&
      Math.max(a.y, b.y) > this.low.y - margin &&
      Math.min(a.y, b.y) < this.high.y + margin
    );
  }

  get ink(): string {
    return this.isDark ? "#e8eaee" : "#23272f";
  }

  get paper(): string {
    return this.isDark ? "#15181d" : "#f3f2ee";
  }
}

/** A round length and what it is in pixels, for the scale bar: between 60 and 150 pixels. */
export function scaleBar(scale: number): { length_m: number; pixels: number } {
  const wanted = 150 / scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const factor = [5, 2, 1].find((candidate) => candidate * power <= wanted) ?? 1;
  return { length_m: factor * power, pixels: factor * power * scale };
}
