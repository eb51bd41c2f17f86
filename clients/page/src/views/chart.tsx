// Density along a drive, with the classes of its words behind it.

import { useEffect, useRef, useState } from "preact/hooks";
import { classColor } from "../colors";
import type { Drive } from "../drives";
import { OBSERVATION_M } from "./note";

const HEIGHT = 96;

export function DensityChart({ drive }: { drive: Drive }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [width, setWidth] = useState(0);
  const count = drive.density.length;
  useEffect(() => {
    if (!canvas.current) return;
    const watch = new ResizeObserver(([entry]) => setWidth(Math.round(entry?.contentRect.width ?? 0)));
    watch.observe(canvas.current);
    return () => watch.disconnect();
  }, []);
  useEffect(() => {
    if (canvas.current && width) drawChart(canvas.current, drive, width);
  }, [drive, width]);
  const mean = count ? drive.density.reduce((sum, value) => sum + value, 0) / count : 0;
  const length = (count * OBSERVATION_M).toFixed(0);
  return <canvas class="chart" ref={canvas} height={HEIGHT} role="img" aria-label={`Density over ${length} m, ${mean.toFixed(2)} in the mean`} />;
}

function drawChart(canvas: HTMLCanvasElement, drive: Drive, width: number): void {
  const context = canvas.getContext("2d");
  if (!context) return;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(HEIGHT * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const count = drive.density.length;
  const isDark = window.matchMedia("(prefers-color-scheme: dark)").matches;
  // One column a pixel: the class in the middle, and the range of densities.
  for (let x = 0; x < width && count; x++) {
    const first = Math.floor((x / width) * count);
    const last = Math.max(first + 1, Math.floor(((x + 1) / width) * count));
    const slice = drive.density.subarray(first, last);
    const densityClass = drive.densityClass[first] ?? 255;
    if (densityClass !== 255) {
      context.globalAlpha = 0.45;
      context.fillStyle = classColor(densityClass);
      context.fillRect(x, 0, 1, HEIGHT);
      context.globalAlpha = 1;
    }
    let [low, high] = [1, 0];
    for (const value of slice) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    context.fillStyle = isDark ? "#ffffff" : "#15181d";
    context.fillRect(x, (1 - high) * HEIGHT - 0.75, 1, Math.max((high - low) * HEIGHT, 1.5));
  }
}
