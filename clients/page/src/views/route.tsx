// The way from one place to another over ground that was driven.

import { api } from "../api";
import type { Schemas } from "../api";
import { useLoaded } from "../cell";
import type { Point } from "../geometry";
import { drawText } from "../map/layers";
import type { Layer } from "../map/view";
import { patch, usePlace } from "../place";
import { useOverlay, useSite } from "../site";
import { Alert, metres } from "../ui";
import { AIM_HINT, useAim } from "./aim";

function pointOf(text: string | null): Point | undefined {
  const [x, y] = (text ?? "").split(",").map(Number);
  return x !== undefined && y !== undefined && Number.isFinite(x) && Number.isFinite(y) && text ? { x, y } : undefined;
}

export function RouteForm() {
  const { site, map, component } = useSite();
  const { query } = usePlace();
  const aim = useAim();
  const [from, to] = [pointOf(query.get("from")), pointOf(query.get("to"))];
  const route = useLoaded(
    async (signal) => {
      if (!from || !to || !map) return undefined;
      const asked = { from_x: from.x, from_y: from.y, to_x: to.x, to_y: to.y, component, version: map.version };
      return api.get("/v1/sites/{site}/route", { path: { site }, query: asked, signal });
    },
    `${query.get("from")} ${query.get("to")} ${component} ${map?.version}`,
  );
  useOverlay(from ? [routeLayer(from, to, route.value)] : [], `${query.get("from")} ${query.get("to")} ${route.value?.length_m}`);
  const aimAt = (end: "from" | "to") => aim.ask(end, (point) => patch({ [end]: `${point.x.toFixed(2)},${point.y.toFixed(2)}` }));
  const stop = () => {
    aim.stop();
    patch({ from: undefined, to: undefined });
  };
  return (
    <fieldset>
      <legend>Way over driven ground</legend>
      <div class="row">
        <button type="button" class="plain" aria-pressed={aim.wanted === "from"} onClick={() => aimAt("from")}>
          Set start
        </button>
        <button type="button" class="plain" aria-pressed={aim.wanted === "to"} onClick={() => aimAt("to")}>
          Set goal
        </button>
        {(from || to) && (
          <button type="button" class="plain" onClick={stop}>
            Clear
          </button>
        )}
      </div>
      {aim.wanted && <p class="soft">{AIM_HINT}</p>}
      <Alert error={route.error} />
      {route.value && (
        <>
          <p>
            <strong>{metres(route.value.length_m)}</strong>: {route.value.description}
          </p>
          <ol class="steps">
            {route.value.steps.map((step, idx) => (
              <li key={idx}>{step.text}</li>
            ))}
          </ol>
        </>
      )}
    </fieldset>
  );
}

function routeLayer(from: Point, to: Point | undefined, route: Schemas["Route"] | undefined): Layer {
  return {
    draw(drawing) {
      const { context } = drawing;
      context.lineJoin = "round";
      for (const [color, width] of [[drawing.paper, 8], ["#d6336c", 4.5]] as const) {
        context.beginPath();
        for (const point of route?.points ?? []) context.lineTo(drawing.px(point.x), drawing.py(point.y));
        context.strokeStyle = color;
        context.lineWidth = width;
        context.stroke();
      }
      for (const [end, name] of [[from, "start"], [to, "goal"]] as const) {
        if (!end) continue;
        context.beginPath();
        context.arc(drawing.px(end.x), drawing.py(end.y), 7, 0, 2 * Math.PI);
        context.fillStyle = "#d6336c";
        context.fill();
        drawText(drawing, end, name, 12);
      }
    },
  };
}
