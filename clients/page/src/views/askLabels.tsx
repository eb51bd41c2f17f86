// A question by labels of places, such as a corridor of 10 m and then a corner to the left.

import { useMemo } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useLoaded } from "../cell";
import { LABEL_COLORS } from "../colors";
import { patch, usePlace } from "../place";
import { useSite } from "../site";
import { Alert, Choice, LazyField, percent } from "../ui";
import { Answers } from "./answers";
import type { Found } from "./answers";

const LABELS = Object.keys(LABEL_COLORS);

/** `corridor:10,corner::left` in the address: label, least length, turn. */
interface Asked {
  label: string;
  length_min_m: string;
  turn: string;
}

function askedOf(text: string): Asked[] {
  return text
    .split(",")
    .map((part) => part.split(":"))
    .filter(([label]) => label !== undefined && LABELS.includes(label))
    .map(([label = "", length_min_m = "", turn = ""]) => ({ label, length_min_m, turn }));
}

export function AskByLabels() {
  const { site } = useSite();
  const text = usePlace().query.get("labels") ?? "";
  const asked = askedOf(text);
  const answers = useLoaded(async (signal) => {
    if (!asked.length) return [];
    const labels = asked.map(({ label, length_min_m, turn }) => ({
      label: label as Schemas["PlaceLabel"],
      ...(length_min_m && { length_min_m: Number(length_min_m) }),
      ...(turn && { turn: turn as Schemas["Turn"] }),
    }));
    return api.post("/v1/sites/{site}/queries/labels", { path: { site }, body: { labels, limit: 50 }, signal });
  }, `${site} ${text}`);
  const found = useMemo((): Found[] => (answers.value ?? []).map(foundOf), [answers.value]);
  const set = (changed: Asked[]) => patch({ labels: changed.map(({ label, length_min_m, turn }) => [label, length_min_m, turn].join(":").replace(/:+$/, "")).join() });
  const edit = (idx: number, changes: Partial<Asked>) => set(asked.map((old, i) => (i === idx ? { ...old, ...changes } : old)));
  return (
    <>
      <p class="soft">What a person would say, in the order of driving: a corridor, then a corner, then a hall.</p>
      {asked.map(({ label, length_min_m, turn }, idx) => (
        <div key={idx} class="card row" role="group" aria-label={`Place ${idx + 1}`}>
          <Choice label="Place" value={label} options={LABELS.map((name) => [name, name] as const)} onChange={(value) => edit(idx, { label: value })} />
          <LazyField label="At least, metres" type="number" min={0} max={1000} step="any" value={length_min_m} onCommit={(text) => edit(idx, { length_min_m: text })} />
          <Choice label="Turn" value={turn} options={[["", "any"], ["left", "left"], ["right", "right"]]} onChange={(value) => edit(idx, { turn: value })} />
          <button type="button" class="plain" onClick={() => set(asked.filter((_, i) => i !== idx))}>
            Remove
          </button>
        </div>
      ))}
      <button type="button" class="chip add" disabled={asked.length >= 16} onClick={() => set([...asked, { label: "corridor", length_min_m: "", turn: "" }])}>
        + place
      </button>
      <Alert error={answers.error} />
      {asked.length > 0 && answers.value && <Answers found={found} />}
    </>
  );
}

function foundOf(answer: Schemas["LabelAnswer"]): Found {
  const { places } = answer;
  const run = places[0]?.run ?? "";
  const first = Math.min(...places.map((place) => place.first));
  const last = Math.max(...places.map((place) => place.last));
  const said = places.map((place) => `${place.label} ${place.length_m.toFixed(1)} m`).join(", ");
  return {
    run,
    observations: [first, last],
    title: `${run} ${first}–${last}`,
    detail: `${said}; ${percent(answer.confidence)} sure${answer.is_reversed ? ", driven the other way" : ""}`,
  };
}
