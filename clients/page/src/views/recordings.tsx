// Choosing recordings in the browser, and what was read of them.

import { useState } from "preact/hooks";
import { useAction } from "../cell";
import { readFile, travelOf } from "../carmen/file";
import type { Recording } from "../carmen/log";
import { Alert, Field, Progress, count, metres } from "../ui";

/** Takes files by button or drop, reads them, and hands the recordings on. */
export function FilePicker(props: { label: string; isSeveral?: boolean; onRead: (recordings: Recording[]) => void }) {
  const [progress, setProgress] = useState<{ name: string; share: number } | undefined>();
  const [field, setField] = useState("");
  const [isOver, setOver] = useState(false);
  const [isLenient, setLenient] = useState(false);
  const reading = useAction(async (files: File[]) => {
    const recordings: Recording[] = [];
    for (const file of files) {
      const options = { skipMalformed: isLenient, ...(field && { fieldOfView_deg: Number(field) }) };
      try {
        recordings.push(await readFile(file, options, (share) => setProgress({ name: file.name, share })));
      } catch (error) {
        setProgress(undefined);
        throw new Error(`${file.name}: ${error instanceof Error ? error.message : String(error)}`);
      }
    }
    setProgress(undefined);
    props.onRead(recordings);
  });
  const take = (files: FileList | null | undefined) => {
    if (files?.length) void reading.run([...files]);
  };
  return (
    <div
      class={isOver ? "drop over" : "drop"}
      onDragOver={(event) => {
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={(event) => {
        event.preventDefault();
        setOver(false);
        take(event.dataTransfer?.files);
      }}
    >
      <Field label={props.label} type="file" multiple={props.isSeveral ?? false} accept=".log,.clf,.gz,.carmen,.txt" onChange={(event) => take(event.currentTarget.files)} hint="CARMEN logs (FLASER or ROBOTLASER1), plain or gzipped. They are read in this browser." />
      <details>
        <summary>If the log does not tell its laser</summary>
        <Field label="Field of view, degrees" type="number" min={1} max={360} step="any" value={field} onInput={(event) => setField(event.currentTarget.value)} />
        <label class="tick">
          <input type="checkbox" checked={isLenient} onChange={(event) => setLenient(event.currentTarget.checked)} />
          <span>Pass over lines that cannot be read</span>
        </label>
      </details>
      {progress && <Progress value={progress.share} label={`Reading ${progress.name}`} />}
      <Alert error={reading.error} />
    </div>
  );
}

/** What a recording holds, in a line. */
export function RecordingLine({ recording }: { recording: Recording }) {
  const travel = travelOf(recording).at(-1) ?? 0;
  return (
    <p>
      <strong>{recording.name}</strong>: {count(recording.scans.length)} scans of {recording.geometry.num_ranges} beams, {metres(travel)} by odometry
      {recording.skipped.length > 0 && <span class="soft">, {count(recording.skipped.length)} lines passed over</span>}
    </p>
  );
}
