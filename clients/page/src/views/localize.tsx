// A robot that asks where it is: an uploaded recording is driven through the map, and the guesses are watched.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { api, isStatus } from "../api";
import type { Schemas } from "../api";
import { useAction } from "../cell";
import { returnsOf } from "../geometry";
import type { Pose } from "../geometry";
import { guessesLayer } from "../map/layers";
import type { Layer } from "../map/view";
import { patch } from "../place";
import { travelOf, wireScan } from "../recording";
import type { Recording } from "../recording";
import { useOverlay, useSite } from "../site";
import { Alert, Choice, Progress, Tick, metres, probability } from "../ui";
import { FilePicker, RecordingLine } from "./recordings";

const SCANS_PER_BATCH = 15;

/** What is known after a batch. */
interface Moment {
  session: Schemas["Localization"];
  numScans: number;
  /** Where the likeliest guess has been, while one was sure. */
  track: { component: number; pose: Pose }[];
}

export function LocalizeView() {
  const { site, map, component, stage } = useSite();
  const [recording, setRecording] = useState<Recording | undefined>();
  const [moment, setMoment] = useState<Moment | undefined>();
  const [start, setStart] = useState(0);
  const [pause_ms, setPause] = useState("150");
  const [isFollowing, setFollowing] = useState(true);
  const abort = useRef<AbortController | undefined>(undefined);
  const live = useRef({ pause_ms: 150, isFollowing: true });
  live.current = { pause_ms: Number(pause_ms), isFollowing };
  useEffect(() => () => abort.current?.abort(), []);
  const drive = useAction(async () => {
    if (!recording) return;
    abort.current = new AbortController();
    await driveThrough(site, recording, start, abort.current.signal, (next) => {
      setMoment(next);
      const best = next.session.hypotheses[0];
      if (live.current.isFollowing && best && next.session.state === "converged") {
        patch({ component: String(best.component) });
        stage.view?.show(best.map_from_robot, stage.view.camera.scale);
      }
      return live.current.pause_ms;
    });
  });
  const travel = useMemo(() => recording && travelOf(recording), [recording]);
  const layers = useMemo(() => (recording && moment ? momentLayers(recording, moment, component) : []), [moment, component]);
  useOverlay(layers, `${moment?.session.id} ${moment?.numScans} ${component}`);
  if (!map) return <p class="soft">A robot can be localized once there is a map.</p>;
  return (
    <>
      <h1>Where is this robot?</h1>
      <p class="soft">A recording is sent scan by scan, as a robot would that was just switched on. Nothing of it is stored.</p>
      <FilePicker
        label="Recording"
        onRead={([read]) => {
          abort.current?.abort();
          setRecording(read);
          setMoment(undefined);
          setStart(0);
        }}
      />
      {recording && travel && (
        <>
          <RecordingLine recording={recording} />
          <label class="slider">
            Switched on after {metres(travel[start] ?? 0)}
            <input type="range" min={0} max={Math.max(0, recording.scans.length - SCANS_PER_BATCH)} step={1} value={start} disabled={drive.isRunning} onInput={(event) => setStart(Number(event.currentTarget.value))} />
          </label>
          <div class="row">
            <button type="button" class="main" disabled={drive.isRunning} onClick={() => void drive.run()}>
              {moment ? "Drive again" : "Drive"}
            </button>
            <button type="button" class="plain" disabled={!drive.isRunning} onClick={() => abort.current?.abort()}>
              Stop
            </button>
            <Choice label="Pace" value={pause_ms} options={[["0", "as fast as it goes"], ["150", "to be watched"], ["600", "slowly"]]} onChange={setPause} />
          </div>
          <Tick label="Follow the robot once it is sure" isOn={isFollowing} onChange={setFollowing} />
        </>
      )}
      <Alert error={isStopped(drive.error) ? undefined : drive.error} />
      {moment && recording && <MomentView moment={moment} recording={recording} start={start} />}
    </>
  );
}

function isStopped(error: unknown): boolean {
  return error instanceof DOMException && error.name === "AbortError";
}

/** Opens a session, sends batch after batch, and closes it; `tell` answers how long to wait before the next. */
async function driveThrough(site: string, recording: Recording, start: number, signal: AbortSignal, tell: (moment: Moment) => number): Promise<void> {
  const opened = await api.post("/v1/sites/{site}/localisations", { path: { site }, body: { geometry: recording.geometry }, signal });
  const path = { site, id: opened.id };
  const track: Moment["track"] = [];
  try {
    for (let sent = 0; start + sent < recording.scans.length; ) {
      const scans = recording.scans.slice(start + sent, start + sent + SCANS_PER_BATCH).map((scan) => wireScan(scan, recording.geometry));
      const session = await api.post("/v1/sites/{site}/localisations/{id}/batches", { path, body: { first_sequence: sent, scans }, signal });
      sent = session.next_sequence;
      const best = session.hypotheses[0];
      if (best && session.state === "converged") track.push({ component: best.component, pose: best.map_from_robot });
      const pause_ms = tell({ session, numScans: start + sent, track: [...track] });
      await new Promise((resolve) => setTimeout(resolve, pause_ms));
    }
  } finally {
    await api.delete("/v1/sites/{site}/localisations/{id}", { path }).catch((error: unknown) => {
      // A session that the server has ended by itself is as good as closed.
      if (!isStatus(error, 404)) throw error;
    });
  }
}

function momentLayers(recording: Recording, moment: Moment, component: number): Layer[] {
  const scan = recording.scans[moment.numScans - 1];
  const returns = scan ? returnsOf({ ranges_m: Array.from(scan.ranges_m) }, recording.geometry) : [];
  const here = moment.session.hypotheses.filter((guess) => guess.component === component);
  const guesses = here.map((guess, idx) => ({
    pose: guess.map_from_robot,
    covariance: guess.covariance,
    probability: guess.probability,
    name: probability(guess.probability),
    ...(idx === 0 && { returns }),
  }));
  const track: Layer = {
    draw(drawing) {
      const { context } = drawing;
      context.beginPath();
      for (const at of moment.track) if (at.component === component) context.lineTo(drawing.px(at.pose.x), drawing.py(at.pose.y));
      context.strokeStyle = "#d6336c";
      context.lineWidth = 3;
      context.stroke();
    },
  };
  return [track, guessesLayer(guesses)];
}

const STATE_TEXT: Record<string, string> = { lost: "Lost", ambiguous: "Not sure yet", converged: "Sure" };

function MomentView({ moment, recording, start }: { moment: Moment; recording: Recording; start: number }) {
  const { component, stage } = useSite();
  const { session, numScans } = moment;
  const show = (guess: Schemas["Hypothesis"]) => {
    if (guess.component !== component) patch({ component: String(guess.component) });
    stage.view?.show(guess.map_from_robot);
  };
  return (
    <>
      <p role="status">
        <span class={`state ${session.state}`}>{STATE_TEXT[session.state]}</span> after {metres(session.travel_m)}
      </p>
      <Progress value={(numScans - start) / Math.max(1, recording.scans.length - start)} label={`scan ${numScans} of ${recording.scans.length}`} />
      <ol class="list">
        {session.hypotheses.slice(0, 10).map((guess, idx) => (
          <li key={idx}>
            <button type="button" class="item" onClick={() => show(guess)}>
              <span class="grow">
                {guess.map_from_robot.x.toFixed(1)}, {guess.map_from_robot.y.toFixed(1)} m, component {guess.component}
                <meter value={guess.probability} aria-label="probability" />
              </span>
              <span class="num">{probability(guess.probability)}</span>
            </button>
          </li>
        ))}
      </ol>
      <p class="soft">Not in this map: {probability(session.probability_elsewhere)}</p>
    </>
  );
}
