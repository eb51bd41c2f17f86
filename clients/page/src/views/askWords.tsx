// A question by words, put together from chips.

import { useMemo, useState } from "preact/hooks";
import { api } from "../api";
import { useLoaded } from "../cell";
import { CLASS_COLORS, classColor } from "../colors";
import { patch, usePlace } from "../place";
import { useSite } from "../site";
import { Alert, Choice, LazyField } from "../ui";
import { Answers, foundByWords } from "./answers";
import { OBSERVATION_M } from "./note";
import { patternsOf, patternsText, wirePattern } from "./words";
import type { Pattern } from "./words";

export function AskByWords() {
  const { site } = useSite();
  const { query } = usePlace();
  const text = query.get("words") ?? "";
  const patterns = patternsOf(text);
  const [chosen, setChosen] = useState<number | undefined>();
  const answers = useLoaded(
    async (signal) => (patterns.length ? api.post("/v1/sites/{site}/queries/words", { path: { site }, body: { words: patterns.map(wirePattern), limit: 50 }, signal }) : []),
    `${site} ${text}`,
  );
  const found = useMemo(() => foundByWords(answers.value ?? []), [answers.value]);
  const set = (changed: Pattern[]) => patch({ words: patternsText(changed) });
  const edit = (idx: number, pattern: Pattern) => set(patterns.map((old, i) => (i === idx ? pattern : old)));
  const moveBy = (idx: number, step: number) => {
    const changed = [...patterns];
    const [taken] = changed.splice(idx, 1);
    if (taken) changed.splice(idx + step, 0, taken);
    set(changed);
    setChosen(idx + step);
  };
  const picked = chosen === undefined ? undefined : patterns[chosen];
  return (
    <>
      <p class="soft">A word is a stretch of even width: its density class, its length and its turn. Put together what a robot would read, in the order of driving.</p>
      <div class="text" role="group" aria-label="The question">
        {patterns.map((pattern, idx) => (
          <button key={idx} type="button" class="chip" aria-pressed={idx === chosen} onClick={() => setChosen(idx === chosen ? undefined : idx)}>
            <i style={{ background: pattern.class === undefined ? "transparent" : classColor(pattern.class) }} />
            {patternTitle(pattern)}
          </button>
        ))}
        <button
          type="button"
          class="chip add"
          onClick={() => {
            set([...patterns, { class: 4, size: 40 }]);
            setChosen(patterns.length);
          }}
        >
          + word
        </button>
      </div>
      {picked && chosen !== undefined && (
        <PatternForm
          pattern={picked}
          onChange={(pattern) => edit(chosen, pattern)}
          onRemove={() => {
            set(patterns.filter((_, idx) => idx !== chosen));
            setChosen(undefined);
          }}
          onEarlier={chosen > 0 ? () => moveBy(chosen, -1) : undefined}
          onLater={chosen < patterns.length - 1 ? () => moveBy(chosen, 1) : undefined}
        />
      )}
      {patterns.length === 0 && <ClassKey />}
      <Alert error={answers.error} />
      {patterns.length > 0 && answers.value && <Answers found={found} />}
    </>
  );
}

function patternTitle({ class: d, size, turn_deg }: Pattern): string {
  const length = size === undefined ? "any length" : `${(size * OBSERVATION_M).toFixed(1)} m`;
  return `${d ?? "any"} · ${length}${turn_deg === undefined ? "" : ` · ${turn_deg}°`}`;
}

function PatternForm(props: { pattern: Pattern; onChange: (pattern: Pattern) => void; onRemove: () => void; onEarlier: (() => void) | undefined; onLater: (() => void) | undefined }) {
  const { pattern } = props;
  const change = (name: keyof Pattern, value: number | undefined) => {
    const { [name]: _, ...rest } = pattern;
    props.onChange(value === undefined || Number.isNaN(value) ? rest : { ...rest, [name]: value });
  };
  const number = (text: string) => (text === "" ? undefined : Number(text));
  return (
    <div class="card" role="group" aria-label="The chosen word">
      <div class="row">
        <Choice label="Density class" value={pattern.class === undefined ? "" : String(pattern.class)} options={[["", "any"], ...CLASS_COLORS.map((_, d) => [String(d), `${d}${d === 0 ? ", narrow" : d === 7 ? ", wide" : ""}`] as const)]} onChange={(value) => change("class", number(value))} />
        <LazyField label="Length, metres" type="number" min={0.1} max={1000} step="0.1" value={pattern.size === undefined ? "" : String(Math.round(pattern.size) / 10)} onCommit={(text) => change("size", text ? Math.round(Number(text) / OBSERVATION_M) : undefined)} />
        <LazyField label="Turn, degrees" type="number" min={-720} max={720} step="1" value={String(pattern.turn_deg ?? "")} onCommit={(text) => change("turn_deg", number(text))} hint="left is positive" />
      </div>
      <div class="row">
        <button type="button" class="plain" disabled={!props.onEarlier} onClick={props.onEarlier}>
          ← earlier
        </button>
        <button type="button" class="plain" disabled={!props.onLater} onClick={props.onLater}>
          later →
        </button>
        <button type="button" class="plain" onClick={props.onRemove}>
          Remove
        </button>
      </div>
    </div>
  );
}

/** What the classes mean, for those who meet them first. */
function ClassKey() {
  return (
    <div class="card">
      <p>The density is the share of the disc around the robot that it could drive to. Eight classes divide it:</p>
      <ul class="classes">
        {CLASS_COLORS.map((color, d) => (
          <li key={d}>
            <i style={{ background: color }} />
            {d}: {((100 * d) / 8).toFixed(0)}–{((100 * (d + 1)) / 8).toFixed(0)} %{d === 2 ? ", such as a narrow corridor" : d === 4 ? ", such as a wide corridor" : d === 7 ? ", a hall" : ""}
          </li>
        ))}
      </ul>
      <p>To see those of this building, lay the words under the path, and click one.</p>
    </div>
  );
}
