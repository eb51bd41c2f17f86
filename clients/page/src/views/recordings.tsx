// Choosing recordings in the browser, and what was read of them.

import { useState } from "preact/hooks";
import { useAction } from "../cell";
import { readFile } from "../open";
import { travelOf } from "../recording";
import type { Recording } from "../recording";
import { Alert, Field, Progress, count, metres } from "../ui";

/** Takes files by button or drop, reads them, and hands the recordings on. */
export function FilePicker(props: { label: string; isSeveral?: boolean; onRead: (recordings: Recording[]) => void }) {
  const [progress, setProgress] = useState<{ name: string; share: number } | undefined>();
  const [field, setField] = useState("");
  const [scanTopic, setScanTopic] = useState("");
  const [odometryTopic, setOdometryTopic] = useState("");
  const [chosen, setChosen] = useState<File[]>([]);
  const [isOver, setOver] = useState(false);
  const [isLenient, setLenient] = useState(false);
  const reading = useAction(async (files: File[]) => {
    const recordings: Recording[] = [];
    for (const file of files) {
      const options = {
        skipMalformed: isLenient,
        ...(field && { fieldOfView_deg: Number(field) }),
        ...(scanTopic && { scanTopic }),
        ...(odometryTopic && { odometryTopic }),
      };
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
    if (!files?.length) return;
    setChosen([...files]);
    void reading.run([...files]);
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
      <Field label={props.label} type="file" multiple={props.isSeveral ?? false} accept=".mcap,.bag,.log,.clf,.gz,.carmen,.txt" onChange={(event) => take(event.currentTarget.files)} hint="Bags of ROS (.mcap, .bag) with a laser and odometry, or CARMEN logs, plain or gzipped. They are read in this browser." />
      <details>
        <summary>If a file is not read as it should be</summary>
        <Field label="Topic of the laser" value={scanTopic} placeholder="/scan" autocomplete="off" onInput={(event) => setScanTopic(event.currentTarget.value.trim())} hint="of a bag with several lasers" />
        <Field label="Topic of the odometry" value={odometryTopic} placeholder="/odom" autocomplete="off" onInput={(event) => setOdometryTopic(event.currentTarget.value.trim())} hint="of a bag with several" />
        <Field label="Field of view, degrees" type="number" min={1} max={360} step="any" value={field} onInput={(event) => setField(event.currentTarget.value)} hint="of a CARMEN log that does not say it" />
        <label class="tick">
          <input type="checkbox" checked={isLenient} onChange={(event) => setLenient(event.currentTarget.checked)} />
          <span>Take what can be read of a file that is damaged or cut off</span>
        </label>
        {chosen.length > 0 && (
          // A browser says nothing when the same file is chosen again.
          <button type="button" class="plain" disabled={reading.isRunning} onClick={() => void reading.run(chosen)}>
            Read again
          </button>
        )}
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
      {recording.notes.map((note) => (
        <small key={note}>{note}</small>
      ))}
    </p>
  );
}
