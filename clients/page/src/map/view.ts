// A canvas that shows layers of a map and is moved by mouse, fingers and keys.

import type { Schemas } from "../api";
import type { Bounds, Point } from "../geometry";
import { SCALE_MAX, SCALE_MIN, Drawing, cameraFor } from "./camera";
import type { Camera } from "./camera";
import { MovedPicture } from "./moved";

/** What lies under a pointer. */
export type Hit =
  | { kind: "match"; id: string }
  | { kind: "word"; run: string; observation: number }
  | { kind: "run"; run: string }
  | { kind: "room"; room: Schemas["Room"] }
  | { kind: "annotation"; annotation: Schemas["Annotation"] }
  | { kind: "note"; text: string };

/** Something drawn on the map. */
export interface Layer {
  draw(drawing: Drawing): void;
  /** What of it lies within `radius_m` of a point, and how far away, metres. */
  pick?(point: Point, radius_m: number): { hit: Hit; distance_m: number } | undefined;
}

/** What a pointer does instead of moving the map. */
export interface Tool {
  /** A path is drawn by dragging, or a point is set by a click. */
  kind: "path" | "point";
  /** Called with the points so far, and whether the pointer was lifted. */
  take: (points: Point[], isDone: boolean) => void;
}

/** A pointer that moved less than this has clicked, pixels. */
const CLICK_PX = 6;
const PICK_PX = 12;
const STEP_PX = 80;
/** A camera that has not moved for this long rests, milliseconds. */
const REST_MS = 120;

export class MapView {
  layers: Layer[] = [];
  tool: Tool | undefined;
  onCamera: (camera: Camera) => void = () => undefined;
  onPick: (hit: Hit | undefined, point: Point) => void = () => undefined;
  onPoint: (point: Point | undefined) => void = () => undefined;
  /** What `fit` shows. */
  bounds: () => Bounds | undefined = () => undefined;
  private current: Camera = { x: 0, y: 0, scale: 20 };
  private readonly context: CanvasRenderingContext2D;
  private readonly pointers = new Map<number, Point>();
  private drawn: Point[] = [];
  private travel_px = 0;
  private wasPinched = false;
  private frame = 0;
  private rest = 0;
  private readonly moved = new MovedPicture();
  private readonly darkness = window.matchMedia("(prefers-color-scheme: dark)");
  private readonly ends = new AbortController();

  constructor(private readonly canvas: HTMLCanvasElement) {
    const context = canvas.getContext("2d", { alpha: false });
    if (!context) throw new Error("this browser has no canvas to draw on");
    this.context = context;
    const on = <K extends keyof HTMLElementEventMap>(name: K, act: (event: HTMLElementEventMap[K]) => void) =>
      canvas.addEventListener(name, act, { signal: this.ends.signal, passive: false });
    on("pointerdown", (event) => this.down(event));
    on("pointermove", (event) => this.move(event));
    on("pointerup", (event) => this.up(event));
    on("pointercancel", (event) => this.pointers.delete(event.pointerId));
    on("pointerleave", () => this.onPoint(undefined));
    on("wheel", (event) => this.wheel(event));
    on("keydown", (event) => this.key(event));
    on("focus", () => this.redraw());
    on("blur", () => this.redraw());
    const resized = new ResizeObserver(() => this.redraw());
    resized.observe(canvas);
    this.darkness.addEventListener("change", () => this.redraw(), { signal: this.ends.signal });
    this.ends.signal.addEventListener("abort", () => resized.disconnect());
  }

  /** Lets go of the canvas. */
  end(): void {
    this.ends.abort();
    cancelAnimationFrame(this.frame);
    window.clearTimeout(this.rest);
  }

  get camera(): Camera {
    return this.current;
  }

  set camera(camera: Camera) {
    this.current = { ...camera, scale: Math.min(Math.max(camera.scale, SCALE_MIN), SCALE_MAX) };
    window.clearTimeout(this.rest);
    this.rest = window.setTimeout(() => this.redraw(), REST_MS);
    this.askFrame();
  }

  /** Moves by hand or key: the camera, and whoever keeps it in the address. */
  private steer(camera: Camera): void {
    this.camera = camera;
    this.onCamera(this.current);
  }

  /** Shows everything; only what is done by hand is told to whoever keeps the camera. */
  fit(isByHand = true): void {
    const bounds = this.bounds();
    if (!bounds || bounds.isEmpty) return;
    this.camera = cameraFor(bounds, this.canvas.clientWidth, this.canvas.clientHeight);
    if (isByHand) this.onCamera(this.current);
  }

  /** Shows a point without changing the scale more than needed. */
  show(point: Point, scale = Math.max(this.current.scale, 25)): void {
    this.steer({ ...point, scale });
  }

  /** Zooms by a factor; the point under the pixel stays there. */
  zoom(factor: number, at = { x: this.canvas.clientWidth / 2, y: this.canvas.clientHeight / 2 }): void {
    const scale = Math.min(Math.max(this.current.scale * factor, SCALE_MIN), SCALE_MAX);
    const fixed = this.pointAt(at);
    const offset = { x: at.x - this.canvas.clientWidth / 2, y: at.y - this.canvas.clientHeight / 2 };
    this.steer({ x: fixed.x - offset.x / scale, y: fixed.y + offset.y / scale, scale });
  }

  /** Draws everything anew, since something of it has changed. */
  redraw(): void {
    window.clearTimeout(this.rest);
    this.moved.drop();
    this.askFrame();
  }

  private askFrame(): void {
    if (this.frame) return;
    this.moved.ask(performance.now());
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.moved.come(performance.now());
      this.draw();
    });
  }

  private draw(): void {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== wide || this.canvas.height !== high) {
      this.canvas.width = wide;
      this.canvas.height = high;
    }
    const { context } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const drawing = new Drawing(context, this.current, width, height, this.darkness.matches);
    if (!this.moved.draw(context, this.current, width, height, drawing.paper)) this.drawLayers(drawing);
    this.drawTool(drawing);
  }

  private drawLayers(drawing: Drawing): void {
    const { context } = this;
    context.fillStyle = drawing.paper;
    context.fillRect(0, 0, drawing.width, drawing.height);
    for (const layer of this.layers) {
      context.save();
      layer.draw(drawing);
      context.restore();
    }
    this.moved.keep(this.canvas, this.current, performance.now());
  }

  /** The path being drawn; and a cross in the middle for those who aim with keys. */
  private drawTool(drawing: Drawing): void {
    const { context } = this;
    if (this.drawn.length > 1) {
      context.strokeStyle = drawing.ink;
      context.lineWidth = 3;
      context.setLineDash([6, 4]);
      context.beginPath();
      for (const point of this.drawn) context.lineTo(drawing.px(point.x), drawing.py(point.y));
      context.stroke();
      context.setLineDash([]);
    }
    if (this.canvas.matches(":focus-visible")) {
      const [x, y] = [drawing.width / 2, drawing.height / 2];
      context.strokeStyle = drawing.ink;
      context.lineWidth = 1.5;
      context.beginPath();
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
        context.moveTo(x + 5 * dx, y + 5 * dy);
        context.lineTo(x + 14 * dx, y + 14 * dy);
      }
      context.stroke();
    }
  }

  private pointAt(pixel: Point): Point {
    return {
      x: this.current.x + (pixel.x - this.canvas.clientWidth / 2) / this.current.scale,
      y: this.current.y - (pixel.y - this.canvas.clientHeight / 2) / this.current.scale,
    };
  }

  private pixelOf(event: MouseEvent): Point {
    const box = this.canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  private down(event: PointerEvent): void {
    if (event.button > 1) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.pixelOf(event));
    if (this.pointers.size === 1) {
      this.travel_px = 0;
      this.wasPinched = false;
      this.drawn = this.tool?.kind === "path" && event.button === 0 ? [this.pointAt(this.pixelOf(event))] : [];
    } else {
      this.wasPinched = true;
      this.drawn = [];
    }
  }

  private move(event: PointerEvent): void {
    const pixel = this.pixelOf(event);
    this.onPoint(this.pointAt(pixel));
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    this.pointers.set(event.pointerId, pixel);
    this.travel_px += Math.hypot(pixel.x - before.x, pixel.y - before.y);
    const other = others[0];
    if (other) {
      // The point between the fingers stays between them.
      const factor = Math.hypot(pixel.x - other.x, pixel.y - other.y) / Math.max(Math.hypot(before.x - other.x, before.y - other.y), 1);
      this.pan((pixel.x - before.x) / 2, (pixel.y - before.y) / 2);
      this.zoom(factor, { x: (pixel.x + other.x) / 2, y: (pixel.y + other.y) / 2 });
    } else if (this.drawn.length) {
      this.drawn.push(this.pointAt(pixel));
      this.tool?.take(this.drawn, false);
      this.redraw();
    } else if (this.travel_px > CLICK_PX) {
      this.pan(pixel.x - before.x, pixel.y - before.y);
    }
  }

  private up(event: PointerEvent): void {
    if (!this.pointers.delete(event.pointerId) || this.pointers.size) return;
    if (this.wasPinched) return;
    if (this.drawn.length > 1 && this.travel_px > CLICK_PX) {
      this.tool?.take(this.drawn, true);
      this.drawn = [];
      this.redraw();
    } else if (this.travel_px <= CLICK_PX && event.button === 0) {
      this.click(this.pointAt(this.pixelOf(event)));
    }
  }

  private click(point: Point): void {
    if (this.tool?.kind === "point") {
      this.tool.take([point], true);
      return;
    }
    this.onPick(this.hitAt(point), point);
  }

  private hitAt(point: Point): Hit | undefined {
    const radius_m = PICK_PX / this.current.scale;
    // What is drawn last lies on top, but the nearest of all is what was meant.
    const found = this.layers.map((layer) => layer.pick?.(point, radius_m)).filter((hit) => hit !== undefined);
    found.sort((a, b) => a.distance_m - b.distance_m);
    return found[0]?.hit;
  }

  private pan(dx: number, dy: number): void {
    const { x, y, scale } = this.current;
    this.steer({ x: x - dx / scale, y: y + dy / scale, scale });
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    // A pinch on a touchpad comes as a wheel with the control key, in small steps.
    const rate = event.ctrlKey ? 100 : 500;
    this.zoom(Math.exp((-event.deltaY * lines) / rate), this.pixelOf(event));
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const acts: Record<string, () => void> = {
      ArrowLeft: () => this.pan(STEP_PX, 0),
      ArrowRight: () => this.pan(-STEP_PX, 0),
      ArrowUp: () => this.pan(0, STEP_PX),
      ArrowDown: () => this.pan(0, -STEP_PX),
      "+": () => this.zoom(1.4),
      "=": () => this.zoom(1.4),
      "-": () => this.zoom(1 / 1.4),
      "0": () => this.fit(),
      f: () => this.fit(),
      Enter: () => this.enter(),
    };
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** What a click does, in the middle of the view; a path grows by a point with every press, and Enter twice ends it. */
  private enter(): void {
    const point = { x: this.current.x, y: this.current.y };
    if (this.tool?.kind !== "path") {
      this.click(point);
      return;
    }
    const last = this.drawn.at(-1);
    const isAgain = last !== undefined && Math.hypot(last.x - point.x, last.y - point.y) < 1e-9;
    if (!isAgain) this.drawn.push(point);
    this.tool.take(this.drawn, isAgain);
    if (isAgain) this.drawn = [];
    this.redraw();
  }
}
