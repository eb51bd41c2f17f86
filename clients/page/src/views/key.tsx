// The key of this browser, asked for when the server wants one.

import { useState } from "preact/hooks";
import { apiKey, isKeyWanted, useKey } from "../api";
import { useCell } from "../cell";
import { Dialog, Field, Tick } from "../ui";

export function KeyDialog({ onClose }: { onClose: () => void }) {
  const isWanted = useCell(isKeyWanted);
  const [key, setKey] = useState(useCell(apiKey));
  const [isKept, setKept] = useState(false);
  return (
    <Dialog title="Key" onClose={onClose}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          useKey(key.trim(), isKept);
          onClose();
        }}
      >
        <p>{isWanted ? "This server asks for a key." : "The key that this browser sends with every request."}</p>
        <Field label="API key" type="password" value={key} autocomplete="off" onInput={(event) => setKey(event.currentTarget.value)} hint="An empty key forgets it." />
        <Tick label="Keep it in this browser, not only in this tab" isOn={isKept} onChange={setKept} />
        <div class="row end">
          <button type="button" class="plain" onClick={onClose}>
            Cancel
          </button>
          <button type="submit" class="main">
            Use it
          </button>
        </div>
      </form>
    </Dialog>
  );
}
