// Poses in the plane: metres and radians.

import type { Schemas } from "./api";

export type Pose = Schemas["Pose"];
export type Point = Schemas["Point"];

/** `a_from_b` and `b_from_c` make `a_from_c`. */
export function compose(a: Pose, b: Pose): Pose {
  const cos = Math.cos(a.theta);
  const sin = Math.sin(a.theta);
  return { x: a.x + cos * b.x - sin * b.y, y: a.y + sin * b.x + cos * b.y, theta: a.theta + b.theta };
}

export function inverse(pose: Pose): Pose {
  const cos = Math.cos(pose.theta);
  const sin = Math.sin(pose.theta);
  return { x: -cos * pose.x - sin * pose.y, y: sin * pose.x - cos * pose.y, theta: -pose.theta };
}

/** Where a point of frame b is in frame a. */
export function move(a_from_b: Pose, point: Point): Point {
  const cos = Math.cos(a_from_b.theta);
  const sin = Math.sin(a_from_b.theta);
  return { x: a_from_b.x + cos * point.x - sin * point.y, y: a_from_b.y + sin * point.x + cos * point.y };
}

export const IDENTITY: Pose = { x: 0, y: 0, theta: 0 };

/** Where the returns of a scan lie in the robot's frame. */
export function returnsOf(scan: { ranges_m: readonly (number | null)[] }, geometry: Schemas["Geometry"]): Point[] {
  const robot_from_laser = geometry.robot_from_laser ?? IDENTITY;
  const points: Point[] = [];
  scan.ranges_m.forEach((range, beam) => {
    if (range === null || range <= 0 || range >= geometry.range_max_m) return;
    const angle = geometry.angle_min_rad + beam * geometry.angle_increment_rad;
    points.push(move(robot_from_laser, { x: range * Math.cos(angle), y: range * Math.sin(angle) }));
  });
  return points;
}

/** Half axes and direction of the ellipse that holds the position with 95 %. */
export function ellipseOf(covariance: readonly (readonly number[])[]): { a: number; b: number; theta: number } {
  const xx = covariance[0]?.[0] ?? 0;
  const xy = covariance[0]?.[1] ?? 0;
  const yy = covariance[1]?.[1] ?? 0;
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  const scale = Math.sqrt(5.991);
  return {
    a: scale * Math.sqrt(Math.max(mean + spread, 0)),
    b: scale * Math.sqrt(Math.max(mean - spread, 0)),
    theta: 0.5 * Math.atan2(2 * xy, xx - yy),
  };
}

/** A box around points. */
export class Bounds {
  low = { x: Infinity, y: Infinity };
  high = { x: -Infinity, y: -Infinity };

  add(x: number, y: number): void {
    if (!Number.isFinite(x) || !Number.isFinite(y)) return;
    this.low = { x: Math.min(this.low.x, x), y: Math.min(this.low.y, y) };
    this.high = { x: Math.max(this.high.x, x), y: Math.max(this.high.y, y) };
  }

  get isEmpty(): boolean {
    return this.low.x > this.high.x;
  }
}

/** The motion that lays points of frame b onto the same points in frame a, by least squares. */
export function fitMotion(pairs: readonly (readonly [Point, Point])[]): Pose {
  const mean = { ax: 0, ay: 0, bx: 0, by: 0 };
  for (const [a, b] of pairs) {
    mean.ax += a.x / pairs.length;
    mean.ay += a.y / pairs.length;
    mean.bx += b.x / pairs.length;
    mean.by += b.y / pairs.length;
  }
  let dot = 0;
  let cross = 0;
  for (const [a, b] of pairs) {
    dot += (b.x - mean.bx) * (a.x - mean.ax) + (b.y - mean.by) * (a.y - mean.ay);
    cross += (b.x - mean.bx) * (a.y - mean.ay) - (b.y - mean.by) * (a.x - mean.ax);
  }
  const theta = pairs.length > 1 ? Math.atan2(cross, dot) : 0;
  const turned = move({ x: 0, y: 0, theta }, { x: mean.bx, y: mean.by });
  return pairs.length ? { x: mean.ax - turned.x, y: mean.ay - turned.y, theta } : IDENTITY;
}
