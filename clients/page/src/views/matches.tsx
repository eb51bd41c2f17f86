// The matches of a map as a list, and one of them opened.

import { useMemo, useState } from "preact/hooks";
import { useLoaded } from "../cell";
import { STATE_COLORS } from "../colors";
import { addressOf, patch, usePlace } from "../place";
import { keyOf, matchesOf, useSite } from "../site";
import { Alert, Choice, Go, Swatch, count, probability } from "../ui";
import { CHANNELS, STATES, filtered, useChoice } from "./chosen";
import { CHANNEL_TITLES } from "./layers";
import { MatchView } from "./match";

const SHOWN_AT_ONCE = 100;

export function MatchesView() {
  const { map } = useSite();
  const id = usePlace().path[3];
  if (!map) return <p class="soft">There are no matches before the first map.</p>;
  return id ? <MatchView id={id} /> : <MatchList />;
}

function MatchList() {
  const { site, map, component } = useSite();
  const choice = useChoice();
  const { query } = usePlace();
  const [shown, setShown] = useState(SHOWN_AT_ONCE);
  const all = useLoaded(async () => (map ? matchesOf(site, map.version) : []), map ? keyOf(site, map.version) : "");
  const order = query.get("order") ?? "probability";
  const matches = useMemo(() => {
    const found = map && all.value ? filtered(map, component, all.value, choice) : [];
    const rank = (match: (typeof found)[number]) => (order === "bits" ? (match.evidence.bits ?? -1) : match.probability);
    return order === "unsure" ? found.sort((a, b) => Math.abs(a.probability - 0.5) - Math.abs(b.probability - 0.5)) : found.sort((a, b) => rank(b) - rank(a));
  }, [all.value, component, [...choice.states].join(), [...choice.channels].join(), order]);
  const one = (chosen: Set<string>) => (chosen.size === 1 ? ([...chosen][0] ?? "") : "");
  return (
    <>
      <h1>Matches</h1>
      <p class="soft">Pairs of stretches that were taken for the same place, or nearly.</p>
      <div class="row">
        <Choice label="State" value={one(choice.states)} options={[["", "any"], ...STATES.map((state) => [state, state] as const)]} onChange={(state) => patch({ state: state || STATES.join() })} />
        <Choice label="Found by" value={one(choice.channels)} options={[["", "any"], ...CHANNELS.map((channel) => [channel, CHANNEL_TITLES[channel] ?? channel] as const)]} onChange={(channel) => patch({ channel: channel || undefined })} />
        <Choice label="Order" value={order} options={[["probability", "surest first"], ["unsure", "least sure first"], ["bits", "most bits first"]]} onChange={(value) => patch({ order: value })} />
      </div>
      <Alert error={all.error} />
      <p role="status" class="soft">
        {all.isLoading ? "Loading…" : `${count(matches.length)} in component ${component}`}
      </p>
      <ul class="list">
        {matches.slice(0, shown).map((match) => (
          <li key={match.id}>
            <Go to={addressOf(["sites", site, "matches", match.id], query)} class="item">
              <Swatch color={STATE_COLORS[match.state] ?? "#888888"} />
              <span class="grow">
                {match.earlier.run} {match.earlier.first}–{match.earlier.last} ↔ {match.later.run} {match.later.first}–{match.later.last}
                <small>
                  {match.state}
                  {match.reason ? ` (${match.reason.replace("_", " ")})` : ""}, {match.direction === "same" ? "same way" : "opposite way"}, by {CHANNEL_TITLES[match.channel]}
                  {match.decision ? ` · ${match.decision === "veto" ? "vetoed" : "confirmed"}` : ""}
                </small>
              </span>
              <span class="num">{probability(match.probability)}</span>
            </Go>
          </li>
        ))}
      </ul>
      {matches.length > shown && (
        <button type="button" class="plain" onClick={() => setShown(shown + SHOWN_AT_ONCE)}>
          Show {Math.min(SHOWN_AT_ONCE, matches.length - shown)} more
        </button>
      )}
    </>
  );
}
