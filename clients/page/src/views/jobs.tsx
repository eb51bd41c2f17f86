// Builds and other long work of a site.

import { useEffect, useRef, useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useSite } from "../site";
import { Act, Progress } from "../ui";

const JOBS_SHOWN = 20;
const SOON_MS = 1000;
const SELDOM_MS = 5000;

/** The latest jobs of a site; asked for often while one runs, seldom otherwise, never while nobody looks. */
export function useJobs(site: string) {
  const [state, setState] = useState<{ list: Schemas["Job"][]; isLoaded: boolean }>({ list: [], isLoaded: false });
  const [round, setRound] = useState(0);
  const isRunning = useRef(false);
  useEffect(() => {
    let timer = 0;
    const abort = new AbortController();
    const ask = async () => {
      if (document.visibilityState === "visible") {
        try {
          const page = await api.get("/v1/sites/{site}/jobs", { path: { site }, query: { limit: JOBS_SHOWN }, signal: abort.signal });
          isRunning.current = page.items.some((job) => job.state === "running" || job.state === "queued");
          setState((old) => (JSON.stringify(old.list) === JSON.stringify(page.items) && old.isLoaded ? old : { list: page.items, isLoaded: true }));
        } catch {
          // The view that asked for the site tells what is wrong; the jobs are asked for again.
          isRunning.current = false;
        }
      }
      if (!abort.signal.aborted) timer = window.setTimeout(ask, isRunning.current ? SOON_MS : SELDOM_MS);
    };
    void ask();
    return () => {
      abort.abort();
      window.clearTimeout(timer);
    };
  }, [site, round]);
  return { ...state, reload: () => setRound((count) => count + 1) };
}

export function JobsView() {
  const { site, jobs, reload } = useSite();
  const build = async () => {
    await api.post("/v1/sites/{site}/builds", { path: { site } });
    reload();
  };
  return (
    <>
      <h1>Jobs</h1>
      <p class="soft">A build makes a new version of the map from everything that is stored. It starts by itself when a run ends.</p>
      <Act kind="main" act={build}>
        Build the map now
      </Act>
      {jobs.length === 0 && <p>Nothing has been built yet.</p>}
      <ul class="list">
        {jobs.map((job) => (
          <li key={job.id} class="job">
            <JobLine job={job} />
          </li>
        ))}
      </ul>
    </>
  );
}

function JobLine({ job }: { job: Schemas["Job"] }) {
  const { site, reload } = useSite();
  const isOver = job.state !== "queued" && job.state !== "running";
  const cancel = async () => {
    await api.delete("/v1/sites/{site}/jobs/{id}", { path: { site, id: job.id } });
    reload();
  };
  return (
    <>
      <div class="row">
        <strong class="grow">
          {job.kind} {job.id}
        </strong>
        <span class={`state ${job.state}`}>{job.state}</span>
        {!isOver && <Act act={cancel}>Cancel</Act>}
      </div>
      {isOver ? <p class="soft">{job.error ?? job.detail}</p> : <Progress value={job.progress} label={`${Math.round(100 * job.progress)} % · ${job.detail}${left(job)}`} />}
    </>
  );
}

/** How long a job will still take, where that can be told. */
function left({ left_s }: Schemas["Job"]): string {
  if (typeof left_s !== "number") return "";
  return left_s < 90 ? ` · about ${Math.ceil(left_s)} s left` : ` · about ${Math.round(left_s / 60)} min left`;
}
