// Sends recordings as `locution replay` does: what the server already has of a run is not sent again.

import { api, isStatus } from "./api";
import type { Schemas } from "./api";
import { wireScan } from "./recording";
import type { Recording } from "./recording";

const SCANS_PER_BATCH = 100;

/** How far an upload is. */
export interface Sent {
  numScans: number;
  receipt: Schemas["Receipt"] | undefined;
}

/** Makes the site if there is none of this name. */
export async function ensureSite(site: string): Promise<void> {
  try {
    await api.get("/v1/sites/{site}", { path: { site } });
  } catch (error) {
    if (!isStatus(error, 404)) throw error;
    await api.put("/v1/sites/{site}", { path: { site }, body: {} });
  }
}

/** Sends a recording as a run and finishes it. */
export async function uploadRun(
  site: string,
  run: string,
  recording: Recording,
  progress: (sent: Sent) => void,
  signal: AbortSignal,
): Promise<void> {
  const path = { site, run };
  const body = { robot: recording.name, geometry: recording.geometry };
  const made = await api.put("/v1/sites/{site}/runs/{run}", { path, body, signal });
  let next = made.next_sequence;
  if (next > recording.scans.length || (made.state === "finished" && next < recording.scans.length)) {
    throw new Error(`There is already another run “${run}” in this site.`);
  }
  progress({ numScans: next, receipt: undefined });
  while (next < recording.scans.length) {
    const scans = recording.scans.slice(next, next + SCANS_PER_BATCH).map((scan) => wireScan(scan, recording.geometry));
    const receipt = await api.post("/v1/sites/{site}/runs/{run}/batches", { path, body: { first_sequence: next, scans }, signal });
    next = receipt.next_sequence;
    progress({ numScans: next, receipt });
  }
  if (made.state !== "finished") await api.post("/v1/sites/{site}/runs/{run}/finish", { path, signal });
}

/** Whether a text may name a site or a run. */
export function isName(text: string): boolean {
  return /^[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}$/.test(text);
}
