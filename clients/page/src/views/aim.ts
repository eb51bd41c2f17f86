// A point on the map that a form asks for: the next click takes it, unless another form asks meanwhile.

import { useEffect, useRef } from "preact/hooks";
import { useCell } from "../cell";
import type { Point } from "../geometry";
import type { Tool } from "../map/view";
import { useSite } from "../site";

export const AIM_HINT = "Click the map; or focus it, move the cross with the arrow keys and press Enter.";

export interface Aim {
  /** What is asked for, while it is. */
  wanted: string | undefined;
  ask: (wanted: string, take: (point: Point) => void) => void;
  stop: () => void;
}

export function useAim(): Aim {
  const { stage } = useSite();
  const mine = useRef<{ tool: Tool; wanted: string } | undefined>(undefined);
  const tool = useCell(stage.tool);
  const stop = () => {
    if (mine.current && stage.tool.get() === mine.current.tool) stage.tool.set(undefined);
    mine.current = undefined;
  };
  // A form that is gone asks for nothing.
  useEffect(() => stop, []);
  const ask = (wanted: string, take: (point: Point) => void) => {
    const asked: Tool = {
      kind: "point",
      take: ([point]) => {
        stop();
        if (point) take(point);
      },
    };
    mine.current = { tool: asked, wanted };
    stage.tool.set(asked);
  };
  return { wanted: tool !== undefined && tool === mine.current?.tool ? mine.current.wanted : undefined, ask, stop };
}
