// One match: both scans over one another, what speaks for it, and a person's word on it.

import { useEffect, useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useLoaded } from "../cell";
import { addressOf, patch, usePlace } from "../place";
import { componentOf, forget, keyOf, placeMatches, useSite } from "../site";
import { Act, Alert, Figures, Go, degrees, metres, probability } from "../ui";
import { evidenceText } from "./evidence";
import { ScanOverlay } from "./overlay";

export function MatchView({ id }: { id: string }) {
  const { site, map, component, stage } = useSite();
  const { query } = usePlace();
  const [round, setRound] = useState(0);
  const match = useLoaded(
    async (signal) => (map ? api.get("/v1/sites/{site}/matches/{id}", { path: { site, id }, query: { version: map.version }, signal }) : undefined),
    `${site} ${map?.version} ${id} ${round}`,
  );
  useEffect(() => {
    if (!map || !match.value) return;
    const home = componentOf(map, match.value.earlier.run);
    if (home !== undefined && home !== component) patch({ component: String(home) });
    void placeMatches(site, map, [match.value]).then(([placed]) => {
      if (placed) stage.view?.show({ x: (placed.earlier.x + placed.later.x) / 2, y: (placed.earlier.y + placed.later.y) / 2 });
    });
  }, [match.value?.id, map?.version, stage.view]);
  const decide = async (decision: "veto" | "confirm" | undefined) => {
    if (!map) return;
    const path = { site, id };
    const at = { version: map.version };
    if (decision) await api.put("/v1/sites/{site}/matches/{id}/decision", { path, query: at, body: { decision } });
    else await api.delete("/v1/sites/{site}/matches/{id}/decision", { path, query: at });
    forget(keyOf(site, map.version, "matches"));
    setRound(round + 1);
  };
  const shown = match.value;
  return (
    <>
      <p>
        <Go to={addressOf(["sites", site, "matches"], query)}>← All matches</Go>
      </p>
      <h1>Match {id}</h1>
      <Alert error={match.error} />
      {shown && map && (
        <>
          <p>
            <span class={`state ${shown.state}`}>{shown.state}</span> {probability(shown.probability)} sure
            {shown.decision && <strong> · {shown.decision === "veto" ? "vetoed by a person" : "confirmed by a person"}</strong>}
          </p>
          <ScanOverlay match={shown} map={map} site={site} />
          <h2>Evidence</h2>
          {evidenceText(shown).map((sentence) => (
            <p key={sentence}>{sentence}</p>
          ))}
          <Stretches match={shown} />
          <h2>You know better?</h2>
          <p class="soft">A veto takes this pair of places out of the next map, a confirmation keeps it in.</p>
          <div class="row">
            <Act kind="danger" act={() => decide("veto")} isDisabled={shown.decision === "veto"}>
              Veto
            </Act>
            <Act kind="main" act={() => decide("confirm")} isDisabled={shown.decision === "confirm"}>
              Confirm
            </Act>
            {shown.decision && <Act act={() => decide(undefined)}>Take it back</Act>}
          </div>
          {shown.decision && <Rebuild />}
        </>
      )}
    </>
  );
}

function Rebuild() {
  const { site, reload } = useSite();
  const build = async () => {
    await api.post("/v1/sites/{site}/builds", { path: { site } });
    reload();
  };
  return (
    <div class="card">
      <p>The decision counts in the next build.</p>
      <Act act={build}>Build the map now</Act>
    </div>
  );
}

function Stretches({ match }: { match: Schemas["Match"] }) {
  const { site } = useSite();
  const { query } = usePlace();
  const fit = match.evidence.registration;
  const stretch = (interval: Schemas["Interval"]) => (
    <>
      <Go to={addressOf(["sites", site, "runs", interval.run], query)}>{interval.run}</Go> {interval.first}–{interval.last}
    </>
  );
  const figures: [string, preact.ComponentChildren][] = [
    ["Earlier", stretch(match.earlier)],
    ["Later", stretch(match.later)],
    ["Direction", match.direction],
  ];
  if (fit) {
    const { x, y, theta } = fit.earlier_from_later;
    figures.push(["Offset", `${metres(x)}, ${metres(y)}, ${degrees(theta)}`]);
  }
  return <Figures figures={figures} />;
}
