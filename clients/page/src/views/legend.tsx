// What the colors on the map mean; only of what is shown.

import { useState } from "preact/hooks";
import { ANNOTATION_COLOR, CHANNEL_DASHES, CHANGE_COLORS, CLASS_COLORS, LABEL_COLORS, STATE_COLORS, runColor } from "../colors";
import { densityColors } from "../map/layers";
import { addressOf, placeNow } from "../place";
import { useSite } from "../site";
import { Go, Swatch } from "../ui";
import type { Layers } from "./chosen";
import { CHANNEL_TITLES } from "./layers";

const RUNS_SHOWN = 8;

export function Legend({ layers }: { layers: Layers }) {
  const [isOpen, setOpen] = useState(() => window.matchMedia("(min-width: 760px)").matches);
  const { site } = useSite();
  const { choice, runs } = layers;
  const has = (name: string) => choice.shown.has(name);
  return (
    <details class="legend" open={isOpen} onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>Legend</summary>
      {has("runs") && (
        <ul>
          {runs.slice(0, RUNS_SHOWN).map(({ run, idx }) => (
            <li key={run}>
              <Swatch color={runColor(idx)} />
              <Go to={addressOf(["sites", site, "runs", run], placeNow().query)}>{run}</Go>
            </li>
          ))}
          {runs.length > RUNS_SHOWN && <li class="soft">and {runs.length - RUNS_SHOWN} more</li>}
        </ul>
      )}
      {has("words") && <WordKey isByDensity={choice.isByDensity} />}
      {has("matches") && (
        <ul>
          {[...choice.states].filter((state) => STATE_COLORS[state]).map((state) => (
            <li key={state}>
              <Swatch color={STATE_COLORS[state] ?? ""} />
              {state} match
            </li>
          ))}
          {[...choice.channels].filter((channel) => CHANNEL_TITLES[channel]).map((channel) => (
            <li key={channel}>
              <Swatch color="currentColor" dash={CHANNEL_DASHES[channel] ?? []} />
              by {CHANNEL_TITLES[channel]}
            </li>
          ))}
        </ul>
      )}
      {has("rooms") && (
        <ul>
          <li>
            <svg class="swatch" viewBox="0 0 18 12" aria-hidden="true">
              <circle cx="9" cy="6" r="4.5" fill="currentColor" />
            </svg>
            door between rooms
          </li>
        </ul>
      )}
      {(has("labels") || has("places")) && <Key colors={LABEL_COLORS} />}
      {has("changes") && <Key colors={CHANGE_COLORS} />}
      {has("annotations") && <Key colors={{ "drawn by people": ANNOTATION_COLOR }} />}
    </details>
  );
}

function Key({ colors }: { colors: Record<string, string> }) {
  return (
    <ul>
      {Object.entries(colors).map(([name, color]) => (
        <li key={name}>
          <Swatch color={color} />
          {name}
        </li>
      ))}
    </ul>
  );
}

/** From narrow to wide. */
function WordKey({ isByDensity }: { isByDensity: boolean }) {
  const colors = isByDensity ? densityColors() : CLASS_COLORS;
  return (
    <div class="ramp">
      <span>{isByDensity ? "density 0" : "narrow 0"}</span>
      <span class="steps" aria-hidden="true">
        {colors.map((color) => (
          <i key={color} style={{ background: color }} />
        ))}
      </span>
      <span>{isByDensity ? "1" : "7 wide"}</span>
    </div>
  );
}
