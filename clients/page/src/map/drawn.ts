// What people drew onto the map, and the doors between the rooms that they name.

import type { Schemas } from "../api";
import { ANNOTATION_COLOR } from "../colors";
import type { Point } from "../geometry";
import { distanceToLine, drawDisc, drawText } from "./layers";
import type { Layer } from "./view";

/** What people drew: points, lines and areas with their names. */
export function annotationsLayer(annotations: Schemas["Annotation"][]): Layer {
  return {
    draw(drawing) {
      const { context } = drawing;
      for (const annotation of annotations) {
        const points = pointsOf(annotation);
        context.beginPath();
        points.forEach((point, i) => context[i ? "lineTo" : "moveTo"](drawing.px(point.x), drawing.py(point.y)));
        context.strokeStyle = ANNOTATION_COLOR;
        context.lineWidth = 2.5;
        context.setLineDash(annotation.geometry?.type === "Polygon" ? [6, 4] : []);
        context.stroke();
        context.setLineDash([]);
        const [first] = points;
        if (!first) continue;
        if (points.length === 1) drawDisc(drawing, first, ANNOTATION_COLOR, 6);
        drawText(drawing, first, annotation.name, 10);
      }
    },
    pick(point, radius_m) {
      let best: { annotation: Schemas["Annotation"]; distance_m: number } | undefined;
      for (const annotation of annotations) {
        const points = pointsOf(annotation);
        points.forEach((to, i) => {
          const distance_m = distanceToLine(point, points[i - 1] ?? to, to);
          if (distance_m < (best?.distance_m ?? radius_m)) best = { annotation, distance_m };
        });
      }
      return best && { hit: { kind: "annotation", annotation: best.annotation }, distance_m: best.distance_m };
    },
  };
}

/** The positions of an annotation, of an area those of its outer border; none where this version does not have it. */
function pointsOf({ geometry }: Schemas["Annotation"]): Point[] {
  if (!geometry) return [];
  const positions = geometry.type === "Point" ? [geometry.coordinates] : geometry.type === "LineString" ? geometry.coordinates : (geometry.coordinates[0] ?? []);
  return positions.map(([x = 0, y = 0]) => ({ x, y }));
}

export function doorsLayer(doors: Point[]): Layer {
  return {
    draw(drawing) {
      for (const door of doors) drawDisc(drawing, door, drawing.isDark ? "#ffffff" : "#23272f", 3.5);
    },
  };
}
