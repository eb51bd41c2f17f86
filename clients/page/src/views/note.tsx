// A word that was clicked: what it says, and the question that it makes.

import { classColor } from "../colors";
import { useLoaded } from "../cell";
import { addressOf, placeNow } from "../place";
import { driveOfRun, useSite } from "../site";
import { Go, Swatch, degrees } from "../ui";
import { wordsText } from "./words";

/** Observations are this far apart, metres. */
export const OBSERVATION_M = 0.1;

export function WordNote({ run, observation }: { run: string; observation: number }) {
  const { site, map } = useSite();
  const drive = useLoaded(async () => (map ? driveOfRun(site, map.version, run) : undefined), `${site} ${map?.version} ${run}`);
  const words = drive.value?.words ?? [];
  const idx = words.findIndex((word) => word.observations[0]! <= observation && observation <= word.observations[1]!);
  const word = words[idx];
  if (!drive.value) return null;
  const density = drive.value.density[observation] ?? 0;
  // Its neighbors make the question tell more than one word could.
  const around = words.slice(Math.max(0, idx - 1), idx + 2);
  return (
    <>
      <p>
        <Go to={addressOf(["sites", site, "runs", run], placeNow().query)}>{run}</Go>, observation {observation}: density {density.toFixed(2)}
      </p>
      {word && (
        <p>
          <Swatch color={classColor(word.class)} /> word {idx}: class {word.class}, {(word.size * OBSERVATION_M).toFixed(1)} m, turns {degrees(word.turn_rad)}.{" "}
          <Go to={addressOf(["sites", site, "ask"], { words: wordsText(around) })}>Where else does it read like this?</Go>
        </p>
      )}
    </>
  );
}
