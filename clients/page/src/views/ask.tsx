// Where is this driven? Questions by words, by labels, by a stretch drawn on the map, and by a recording.

import { addressOf, usePlace } from "../place";
import { useSite } from "../site";
import { Go } from "../ui";
import { AskByDrawing } from "./askDrawing";
import { AskByExample } from "./askExample";
import { AskByLabels } from "./askLabels";
import { AskByWords } from "./askWords";

const WAYS = [
  ["words", "Words", AskByWords],
  ["drawing", "Draw", AskByDrawing],
  ["labels", "Places", AskByLabels],
  ["example", "Recording", AskByExample],
] as const;

export function AskView() {
  const { site } = useSite();
  const { path, query } = usePlace();
  const [name, , Shown] = WAYS.find(([way]) => way === path[3]) ?? WAYS[0];
  const kept = new URLSearchParams([...query].filter(([key]) => ["version", "component", "layers", "at", "color"].includes(key)));
  return (
    <>
      <h1>Where is this driven?</h1>
      <nav class="ways" aria-label="Ways to ask">
        {WAYS.map(([way, title]) => (
          <Go key={way} to={addressOf(["sites", site, "ask", way], kept)} isCurrent={way === name}>
            {title}
          </Go>
        ))}
      </nav>
      <Shown />
    </>
  );
}
