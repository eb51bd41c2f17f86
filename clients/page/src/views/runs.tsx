// The runs of a site, and sending more of them.

import { useRef, useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useAction, useLoaded, useRepeated } from "../cell";
import { runColor } from "../colors";
import { addressOf, usePlace } from "../place";
import type { Recording } from "../recording";
import { useSite } from "../site";
import { Alert, Field, Go, Progress, Swatch, count, many } from "../ui";
import { isName, uploadRun } from "../upload";
import type { Sent } from "../upload";
import { FilePicker, RecordingLine } from "./recordings";

const PAGE = 100;

export function RunsView() {
  const { site, map, reload } = useSite();
  const place = usePlace();
  const [numPages, setPages] = useState(1);
  const runs = useLoaded(async (signal) => {
    const items: Schemas["Run"][] = [];
    let cursor: string | null | undefined;
    for (let page = 0; page < numPages && cursor !== null; page++) {
      const answer: Schemas["RunPage"] = await api.get("/v1/sites/{site}/runs", { path: { site }, query: { limit: PAGE, ...(cursor ? { cursor } : {}) }, signal });
      items.push(...answer.items);
      cursor = answer.next_cursor ?? null;
    }
    return { items, hasMore: cursor !== null };
  }, `${site} ${numPages}`);
  const isLive = runs.value?.items.some((run) => run.state === "open") ?? false;
  useRepeated(async () => {
    if (isLive) runs.reload();
  }, 2000);
  const colors = new Map(map?.runs.map((run, idx) => [run.run, runColor(idx)]));
  return (
    <>
      <h1>Runs</h1>
      <p class="soft">A run is one drive of one robot, from power-on to the end.</p>
      <Alert error={runs.error} />
      {runs.value?.items.length === 0 && <p>There are none yet. Choose recordings below, or send them with the command line or the API.</p>}
      <ul class="list">
        {runs.value?.items.map((run) => (
          <li key={run.run}>
            <Go to={addressOf(["sites", site, "runs", run.run], place.query)} class="item">
              <Swatch color={colors.get(run.run) ?? "#9aa0aa"} />
              <span class="grow">
                {run.run}
                <small>
                  {many(run.num_scans, "scan")} · {many(run.num_words, "word")}
                  {run.robot && run.robot !== run.run ? ` · ${run.robot}` : ""}
                </small>
              </span>
              {run.state === "open" ? <span class="state live">live</span> : !colors.has(run.run) && <span class="soft">not in this map</span>}
            </Go>
          </li>
        ))}
      </ul>
      {runs.value?.hasMore && (
        <button type="button" class="plain" onClick={() => setPages(numPages + 1)}>
          Show more
        </button>
      )}
      <Uploads
        site={site}
        onDone={() => {
          runs.reload();
          reload();
        }}
      />
    </>
  );
}

interface Upload {
  recording: Recording;
  run: string;
  sent?: Sent;
}

export function Uploads({ site, onDone }: { site: string; onDone: () => void }) {
  const [uploads, setUploads] = useState<Upload[]>([]);
  const [isDone, setDone] = useState(false);
  const abort = useRef<AbortController | undefined>(undefined);
  const change = (idx: number, changes: Partial<Upload>) => setUploads((old) => old.map((upload, i) => (i === idx ? { ...upload, ...changes } : upload)));
  const sending = useAction(async () => {
    abort.current = new AbortController();
    for (const [idx, { recording, run }] of uploads.entries()) {
      await uploadRun(site, run, recording, (sent) => change(idx, { sent }), abort.current.signal);
      onDone();
    }
    setDone(true);
  });
  const isReady = uploads.every(({ run }, idx) => isName(run) && uploads.findIndex((other) => other.run === run) === idx);
  return (
    <section class="card" aria-label="Send recordings">
      <h2>Send recordings</h2>
      <FilePicker
        label="Recordings"
        isSeveral
        onRead={(recordings) => {
          setDone(false);
          setUploads(recordings.map((recording) => ({ recording, run: recording.name })));
        }}
      />
      {uploads.map(({ recording, run, sent }, idx) => (
        <div key={idx} class="upload">
          <RecordingLine recording={recording} />
          {sent ? (
            <Progress value={sent.numScans / recording.scans.length} label={`${run}: ${count(sent.numScans)} of ${count(recording.scans.length)} scans${sent.receipt ? `, ${count(sent.receipt.num_words)} words` : ""}`} />
          ) : (
            <Field label="Name of the run" value={run} pattern="[A-Za-z0-9_\-][A-Za-z0-9._\-]*" maxLength={64} onInput={(event) => change(idx, { run: event.currentTarget.value })} />
          )}
        </div>
      ))}
      {uploads.length > 0 && !isDone && (
        <div class="row">
          <button type="button" class="main" disabled={!isReady || sending.isRunning} onClick={() => void sending.run()}>
            Send {many(uploads.length, "run")}
          </button>
          {sending.isRunning && (
            <button type="button" class="plain" onClick={() => abort.current?.abort()}>
              Stop
            </button>
          )}
        </div>
      )}
      <Alert error={sending.error} />
      {isDone && (
        <p role="status">
          Sent. The map is being built; <Go to={addressOf(["sites", site, "jobs"])}>Jobs</Go> shows how far it is.
        </p>
      )}
    </section>
  );
}
