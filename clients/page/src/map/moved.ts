// A picture that takes long to draw is moved as it is while the camera moves, and drawn anew when that rests.

import type { Camera } from "./camera";

/** Drawing that delays the next frame by more than this is slow, milliseconds. */
const SLOW_MS = 25;
/** A frame that is asked for this soon after a whole picture waits for that picture, milliseconds. */
const SOON_MS = 100;
/** Farther than this from where it was drawn, a picture shows too little. */
const ZOOM_MAX = 2.5;
const SHIFT_MAX = 0.6;

export class MovedPicture {
  private readonly copy = document.createElement("canvas");
  private camera: Camera | undefined;
  /** How long frames wait for the pictures before them, milliseconds; smoothed. */
  private delay_ms = 0;
  private drawnAt = -Infinity;
  private askedAt = 0;

  /** A frame is asked for. */
  ask(now_ms: number): void {
    this.askedAt = now_ms;
  }

  /** The frame that was asked for has come. */
  come(now_ms: number): void {
    if (this.askedAt - this.drawnAt < SOON_MS) this.delay_ms = 0.5 * this.delay_ms + 0.5 * (now_ms - this.askedAt);
  }

  /** Keeps a picture that was just drawn, if drawing is slow. */
  keep(canvas: HTMLCanvasElement, camera: Camera, now_ms: number): void {
    this.drawnAt = now_ms;
    this.camera = undefined;
    if (this.delay_ms < SLOW_MS) return;
    this.copy.width = canvas.width;
    this.copy.height = canvas.height;
    this.copy.getContext("2d", { alpha: false })?.drawImage(canvas, 0, 0);
    this.camera = camera;
  }

  /** Forgets the picture, of which something has changed. */
  drop(): void {
    this.camera = undefined;
  }

  /** Draws the kept picture as another camera sees it; false where there is none or it shows too little. */
  draw(context: CanvasRenderingContext2D, camera: Camera, width: number, height: number, paper: string): boolean {
    const from = this.camera;
    if (!from) return false;
    const zoom = camera.scale / from.scale;
    const shift = { x: (from.x - camera.x) * camera.scale, y: (camera.y - from.y) * camera.scale };
    if (zoom > ZOOM_MAX || zoom < 1 / ZOOM_MAX || Math.abs(shift.x) > SHIFT_MAX * width || Math.abs(shift.y) > SHIFT_MAX * height) return false;
    context.fillStyle = paper;
    context.fillRect(0, 0, width, height);
    context.drawImage(this.copy, width / 2 + shift.x - (zoom * width) / 2, height / 2 + shift.y - (zoom * height) / 2, zoom * width, zoom * height);
    return true;
  }
}
