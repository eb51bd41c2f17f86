// Where was this recorded? A question by an uploaded recording, of which a stretch may be chosen.

import { useMemo, useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useAction } from "../cell";
import { returnsOf } from "../geometry";
import { guessesLayer } from "../map/layers";
import { patch } from "../place";
import { travelOf, wireScan } from "../recording";
import type { Recording } from "../recording";
import { useOverlay, useSite } from "../site";
import { Alert, metres, percent, probability } from "../ui";
import { FilePicker, RecordingLine } from "./recordings";

/** More than this is not looked at by the server. */
const LENGTH_MAX_M = 25;

export function AskByExample() {
  const { site } = useSite();
  const [recording, setRecording] = useState<Recording | undefined>();
  const [end, setEnd] = useState(Infinity);
  const [answer, setAnswer] = useState<{ answer: Schemas["ExampleAnswer"]; recording: Recording; last: number } | undefined>();
  const travel = useMemo(() => recording && travelOf(recording), [recording]);
  const total = travel?.at(-1) ?? 0;
  const end_m = Math.min(end, total);
  const ask = useAction(async () => {
    if (!recording || !travel) return;
    const first = travel.findIndex((at) => at >= end_m - LENGTH_MAX_M);
    const last = travel.findLastIndex((at) => at <= end_m);
    const scans = recording.scans.slice(first, last + 1).map((scan) => wireScan(scan, recording.geometry));
    const body = { geometry: recording.geometry, scans };
    setAnswer({ answer: await api.post("/v1/sites/{site}/queries/example", { path: { site }, body }), recording, last });
  });
  return (
    <>
      <p class="soft">Some metres of scans and odometry, from any robot. Nothing of it is stored.</p>
      <FilePicker
        label="Recording"
        onRead={([read]) => {
          setRecording(read);
          setAnswer(undefined);
          setEnd(Infinity);
        }}
      />
      {recording && (
        <>
          <RecordingLine recording={recording} />
          {total > LENGTH_MAX_M && (
            <label class="slider">
              The {LENGTH_MAX_M} m that end at {metres(end_m)}
              <input type="range" min={LENGTH_MAX_M} max={total} step="any" value={end_m} onInput={(event) => setEnd(Number(event.currentTarget.value))} />
            </label>
          )}
          <button type="button" class="main" disabled={ask.isRunning} onClick={() => void ask.run()}>
            {ask.isRunning ? "Looking…" : "Where was this recorded?"}
          </button>
        </>
      )}
      <Alert error={ask.error} />
      {answer && <ExamplePlaces {...answer} />}
    </>
  );
}

const STATE_TEXT: Record<string, string> = {
  lost: "Not here, as far as the map shows.",
  ambiguous: "Several places are possible.",
  converged: "Found.",
};

function ExamplePlaces({ answer, recording, last }: { answer: Schemas["ExampleAnswer"]; recording: Recording; last: number }) {
  const { component, stage } = useSite();
  const scan = recording.scans[last];
  const returns = useMemo(() => (scan ? returnsOf({ ranges_m: Array.from(scan.ranges_m) }, recording.geometry) : []), [scan]);
  const guesses = answer.places
    .filter((place) => place.component === component)
    .map((place, idx) => ({ pose: place.map_from_robot, covariance: place.covariance, probability: place.probability, name: probability(place.probability), ...(idx === 0 && { returns }) }));
  useOverlay([guessesLayer(guesses)], JSON.stringify([answer, component]));
  const show = (place: Schemas["ExamplePlace"]) => {
    if (place.component !== component) patch({ component: String(place.component), at: undefined });
    stage.view?.show(place.map_from_robot);
  };
  return (
    <>
      <p role="status">
        <strong>{STATE_TEXT[answer.state]}</strong> <span class="soft">Judged by {metres(answer.travel_m)} of driving.</span>
      </p>
      <ol class="list">
        {answer.places.map((place, idx) => (
          <li key={idx}>
            <button type="button" class="item" onClick={() => show(place)}>
              <span class="rank">{idx + 1}</span>
              <span class="grow">
                beside {place.run} {place.observations.join("–")}
                <small>
                  {place.direction === "same" ? "same way" : "opposite way"}; {percent(place.evidence.coverage)} of the returns are on the map, {percent(place.evidence.contradicted)} of these in free space
                </small>
              </span>
              <span class="num">{probability(place.probability)}</span>
            </button>
          </li>
        ))}
      </ol>
    </>
  );
}
