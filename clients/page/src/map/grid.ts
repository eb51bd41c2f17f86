// The occupancy grid of a component, as pictures at several sizes in which thin walls stay visible.

import { fetchWithKey, refusalOf, sitePath } from "../api";
import { Bounds } from "../geometry";
import type { Drawing } from "./camera";

/** What a cell is; larger wins when cells are drawn as one. */
const UNKNOWN = 0;
const FREE = 1;
const OCCUPIED = 2;

/** Cells, row by row from the upper left. */
export interface Cells {
  width: number;
  height: number;
  data: Uint8Array;
}

/** A grid with its place in the component's frame. */
export class Grid {
  private readonly pictures = new Map<string, ImageBitmap | HTMLCanvasElement>();
  private readonly sizes: Cells[];

  constructor(
    readonly cells: Cells,
    readonly resolution_m: number,
    readonly origin: { x: number; y: number },
  ) {
    this.sizes = [cells];
    for (let last = cells; Math.max(last.width, last.height) > 256; ) {
      last = halved(last);
      this.sizes.push(last);
    }
  }

  get width_m(): number {
    return this.cells.width * this.resolution_m;
  }

  get height_m(): number {
    return this.cells.height * this.resolution_m;
  }

  /** The box that holds all occupied cells but the outermost half percent on every side, which lone rays put there. */
  get bounds(): Bounds {
    const rows = new Float64Array(this.cells.height);
    const columns = new Float64Array(this.cells.width);
    this.cells.data.forEach((cell, i) => {
      if (cell !== OCCUPIED) return;
      columns[i % this.cells.width]!++;
      rows[Math.floor(i / this.cells.width)]!++;
    });
    const bounds = new Bounds();
    const [left, right] = middle(columns);
    const [top, bottom] = middle(rows);
    const [x, y] = [this.origin.x, this.origin.y + this.height_m];
    bounds.add(x + left * this.resolution_m, y - top * this.resolution_m);
    bounds.add(x + right * this.resolution_m, y - bottom * this.resolution_m);
    return bounds;
  }

  /** Draws the grid in two colors; free ground may be left out. */
  draw(drawing: Drawing, wall: string, free: string | undefined): void {
    const cell_px = this.resolution_m * drawing.camera.scale;
    const wanted = Math.max(0, Math.floor(Math.log2(1.4 / cell_px)));
    const idx = Math.min(wanted, this.sizes.length - 1);
    const size = this.sizes[idx]!;
    const picture = this.picture(idx, wall, free);
    const step = cell_px * 2 ** idx;
    const { context } = drawing;
    context.imageSmoothingEnabled = step < 2;
    const top = drawing.py(this.origin.y + this.height_m);
    context.drawImage(picture, drawing.px(this.origin.x), top, size.width * step, size.height * step);
  }

  private picture(idx: number, wall: string, free: string | undefined): ImageBitmap | HTMLCanvasElement {
    const name = `${idx} ${wall} ${free ?? ""}`;
    let picture = this.pictures.get(name);
    if (!picture) {
      picture = painted(this.sizes[idx]!, wall, free);
      this.pictures.set(name, picture);
    }
    return picture;
  }
}

/** Between which positions all but half a percent at either end lies. */
function middle(counts: Float64Array): [number, number] {
  const total = counts.reduce((sum, count) => sum + count, 0);
  let [first, last, sum] = [0, counts.length, 0];
  counts.forEach((count, idx) => {
    if (sum <= 0.005 * total) first = idx;
    sum += count;
    if (sum < 0.995 * total) last = idx + 2;
  });
  return [first, Math.min(last, counts.length)];
}

function halved(cells: Cells): Cells {
  const width = Math.ceil(cells.width / 2);
  const height = Math.ceil(cells.height / 2);
  const data = new Uint8Array(width * height);
  // Counted from below, so that the lower left corner stays the origin.
  const top = cells.height % 2;
  for (let y = 0; y < cells.height; y++) {
    for (let x = 0; x < cells.width; x++) {
      const at = ((y + top) >> 1) * width + (x >> 1);
      const value = cells.data[y * cells.width + x]!;
      if (value > data[at]!) data[at] = value;
    }
  }
  return { width, height, data };
}

function painted(cells: Cells, wall: string, free: string | undefined): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = cells.width;
  canvas.height = cells.height;
  const context = canvas.getContext("2d");
  if (!context) return canvas;
  const image = context.createImageData(cells.width, cells.height);
  const pixels = new Uint32Array(image.data.buffer);
  const colors = [0, free ? pixelOf(free) : 0, pixelOf(wall)];
  for (let i = 0; i < pixels.length; i++) pixels[i] = colors[cells.data[i]!]!;
  context.putImageData(image, 0, 0);
  return canvas;
}

/** `#rrggbb` as a pixel of an image, little endian as all browsers are. */
function pixelOf(color: string): number {
  const value = Number.parseInt(color.slice(1), 16);
  const swapped = ((value & 0xff) << 16) | (value & 0xff00) | (value >> 16);
  return (0xff000000 | swapped) >>> 0;
}

/** Loads the grid of a component: its picture, and where it lies. */
export async function loadGrid(site: string, version: number, component: number, signal: AbortSignal): Promise<Grid> {
  const query = `?version=${version}&component=${component}`;
  const [yaml, png] = await Promise.all(
    ["grid.yaml", "grid.png"].map(async (name) => {
      const answer = await fetchWithKey(`${sitePath(site)}/map/${name}${query}`, { signal });
      if (!answer.ok) throw await refusalOf(answer);
      return answer.blob();
    }),
  );
  const text = await yaml!.text();
  const resolution_m = Number(/resolution: *([-0-9.e]+)/.exec(text)?.[1]);
  const origin = (/origin: *\[([^\]]*)\]/.exec(text)?.[1] ?? "").split(",").map(Number);
  const picture = await createImageBitmap(png!);
  return new Grid(cellsOf(picture), resolution_m, { x: origin[0] ?? 0, y: origin[1] ?? 0 });
}

/** Map_server's gray values: dark is occupied, light is free, between them is unknown. */
function cellsOf(picture: ImageBitmap): Cells {
  const canvas = document.createElement("canvas");
  canvas.width = picture.width;
  canvas.height = picture.height;
  const context = canvas.getContext("2d", { willReadFrequently: true });
  const data = new Uint8Array(picture.width * picture.height);
  if (context) {
    context.drawImage(picture, 0, 0);
    const { data: pixels } = context.getImageData(0, 0, picture.width, picture.height);
    for (let i = 0; i < data.length; i++) {
      const gray = pixels[4 * i]!;
      data[i] = gray < 100 ? OCCUPIED : gray > 220 ? FREE : UNKNOWN;
    }
  }
  return { width: picture.width, height: picture.height, data };
}
