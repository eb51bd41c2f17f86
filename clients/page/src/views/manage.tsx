// What changes or ends a site.

import { useState } from "preact/hooks";
import { api, save, sitePath } from "../api";
import { useLoaded } from "../cell";
import { go } from "../place";
import { forget, useSite } from "../site";
import { Act, Alert, Confirm, Figures, bytes, count } from "../ui";

export function ManageView() {
  const { site } = useSite();
  const [isAsking, setAsking] = useState(false);
  const info = useLoaded((signal) => api.get("/v1/sites/{site}", { path: { site }, signal }), site);
  const remove = async () => {
    await api.delete("/v1/sites/{site}", { path: { site } });
    forget(`${site}/`);
    go([]);
  };
  return (
    <>
      <h1>Manage {site}</h1>
      <Alert error={info.error} />
      {info.value && (
        <Figures
          figures={[
            ["Runs", count(info.value.num_runs)],
            ["Scans", count(info.value.num_scans)],
            ["Observations", count(info.value.num_observations)],
            ["Words", count(info.value.num_words)],
            ["On disk", bytes(info.value.bytes_on_disk)],
            ["Texts", `generation ${info.value.generation}`],
          ]}
        />
      )}
      <h2>Backup</h2>
      <p class="soft">The whole site as one file, taken while it serves.</p>
      <Act act={() => save(`${sitePath(site)}/backup`, `${site}.backup`)}>Download a backup</Act>
      {info.value && (
        <details>
          <summary>Configuration</summary>
          <pre tabIndex={0}>{JSON.stringify(info.value.config, null, 1)}</pre>
        </details>
      )}
      <h2>Delete</h2>
      <p class="soft">All runs, maps and decisions of the site are gone for good.</p>
      <button type="button" class="danger" onClick={() => setAsking(true)}>
        Delete this site…
      </button>
      {isAsking && (
        <Confirm title={`Delete ${site}?`} word={site} verb="Delete it" act={remove} onClose={() => setAsking(false)}>
          <p>
            {info.value ? `${count(info.value.num_runs)} runs with ${count(info.value.num_scans)} scans` : "Everything"} will be deleted. This cannot be undone.
          </p>
        </Confirm>
      )}
    </>
  );
}
