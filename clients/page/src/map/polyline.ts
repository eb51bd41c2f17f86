// Long paths, drawn as finely as the screen shows and only where it looks.
//
// A path is kept at several levels: level 0 has every vertex, level k every 2^k-th. Each level is cut into chunks with
// a box around, so that a frame touches only what is in view, at about one vertex every pixel and a half.

import type { Drawing } from "./camera";

const CHUNK = 128;
/** Vertices nearer than this on the screen are not told apart. */
const SPACING_PX = 1.6;

interface Chunk {
  first: number;
  last: number;
  lowX: number;
  lowY: number;
  highX: number;
  highY: number;
}

interface Level {
  vertices: Uint32Array;
  chunks: Chunk[];
}

/** A path with a color by vertex; a vertex that is not a number interrupts it. */
export class Polyline {
  private readonly levels: Level[] = [];
  private readonly spacing_m: number;

  constructor(
    readonly x: Float64Array,
    readonly y: Float64Array,
    /** Which color the piece before a vertex has. */
    readonly color: Uint8Array,
  ) {
    let length = 0;
    let count = 0;
    for (let i = 1; i < x.length; i++) {
      const step = Math.hypot(x[i]! - x[i - 1]!, y[i]! - y[i - 1]!);
      if (Number.isFinite(step)) {
        length += step;
        count++;
      }
    }
    this.spacing_m = count ? Math.max(length / count, 1e-6) : 1;
    for (let step = 1; ; step *= 2) {
      this.levels.push(this.level(step));
      if (x.length / step < 64) break;
    }
  }

  private level(step: number): Level {
    const vertices: number[] = [];
    for (let i = 0; i < this.x.length; i++) {
      const isEnd = i === this.x.length - 1;
      const isGap = Number.isNaN(this.x[i]) || (i > 0 && Number.isNaN(this.x[i - 1]));
      if (i % step === 0 || isEnd || isGap) vertices.push(i);
    }
    const chunks: Chunk[] = [];
    for (let first = 0; first + 1 < vertices.length; first += CHUNK) {
      const chunk = { first, last: Math.min(first + CHUNK, vertices.length - 1), lowX: Infinity, lowY: Infinity, highX: -Infinity, highY: -Infinity };
      for (let at = chunk.first; at <= chunk.last; at++) {
        const x = this.x[vertices[at]!]!;
        const y = this.y[vertices[at]!]!;
        if (x < chunk.lowX) chunk.lowX = x;
        if (x > chunk.highX) chunk.highX = x;
        if (y < chunk.lowY) chunk.lowY = y;
        if (y > chunk.highY) chunk.highY = y;
      }
      chunks.push(chunk);
    }
    return { vertices: Uint32Array.from(vertices), chunks };
  }

  /** Adds what is in view to one path for each color. */
  trace(drawing: Drawing, paths: Path2D[]): void {
    const { camera, low, high } = drawing;
    const wanted = Math.floor(Math.log2(SPACING_PX / (this.spacing_m * camera.scale)));
    const level = this.levels[Math.max(0, Math.min(wanted, this.levels.length - 1))]!;
    const margin = 4 / camera.scale;
    for (const chunk of level.chunks) {
      if (chunk.highX < low.x - margin || chunk.lowX > high.x + margin) continue;
      if (chunk.highY < low.y - margin || chunk.lowY > high.y + margin) continue;
      this.traceChunk(drawing, level.vertices, chunk, paths);
    }
  }

  private traceChunk(drawing: Drawing, vertices: Uint32Array, chunk: Chunk, paths: Path2D[]): void {
    let penColor = -1;
    for (let at = chunk.first + 1; at <= chunk.last; at++) {
      const to = vertices[at]!;
      const x = drawing.px(this.x[to]!);
      const y = drawing.py(this.y[to]!);
      if (Number.isNaN(x)) {
        penColor = -1;
        continue;
      }
      const color = this.color[to]!;
      const path = paths[Math.min(color, paths.length - 1)]!;
      if (color !== penColor) {
        const from = vertices[at - 1]!;
        if (Number.isNaN(this.x[from]!)) continue;
        path.moveTo(drawing.px(this.x[from]!), drawing.py(this.y[from]!));
        penColor = color;
      }
      path.lineTo(x, y);
    }
  }
}

/** Strokes many paths, each color once. */
export function strokePolylines(drawing: Drawing, lines: Iterable<Polyline>, colors: readonly string[], width: number): void {
  const paths = colors.map(() => new Path2D());
  for (const line of lines) line.trace(drawing, paths);
  const { context } = drawing;
  context.lineWidth = width;
  context.lineJoin = "bevel";
  context.lineCap = "butt";
  paths.forEach((path, idx) => {
    context.strokeStyle = colors[idx] ?? "#888888";
    context.stroke(path);
  });
}
