// The page that the server shows to people: which view the address names.

import { render } from "preact";
import { useState } from "preact/hooks";
import { apiKey, isKeyWanted } from "./api";
import { useCell } from "./cell";
import { addressOf, usePlace } from "./place";
import { Go } from "./ui";
import { KeyDialog } from "./views/key";
import { KeysPage } from "./views/keys";
import { SitePage } from "./views/site";
import { SitesPage } from "./views/sites";

function Page() {
  const { path } = usePlace();
  const key = useCell(apiKey);
  const isWanted = useCell(isKeyWanted);
  const [isAsking, setAsking] = useState(false);
  const site = path[0] === "sites" ? path[1] : undefined;
  return (
    <>
      <a class="skip" href="#content" onClick={skip}>
        To the content
      </a>
      <header>
        <Go to={addressOf([])} class="brand">
          <img src="/ui/icon.svg" alt="" width="22" height="22" />
          Locution
        </Go>
        {site && (
          <>
            <span aria-hidden="true">/</span>
            <Go to={addressOf(["sites", site, "map"])} class="here">
              {site}
            </Go>
          </>
        )}
        <span class="grow" />
        <a href="/docs/">API</a>
        <Go to={addressOf(["keys"])} isCurrent={path[0] === "keys"}>
          Keys
        </Go>
        <button type="button" class="plain" onClick={() => setAsking(true)}>
          {key ? "Key in use" : "Use a key"}
        </button>
      </header>
      {/* Another key may see other things, so everything is asked for again. */}
      <Fragmented key={key}>{site ? <SitePage key={site} site={site} /> : path[0] === "keys" ? <KeysPage /> : <SitesPage />}</Fragmented>
      {(isAsking || isWanted) && (
        <KeyDialog
          onClose={() => {
            setAsking(false);
            isKeyWanted.set(false);
          }}
        />
      )}
    </>
  );
}

function Fragmented({ children }: { children: preact.ComponentChildren }) {
  return <>{children}</>;
}

/** The fragment of the address names the view, so the link moves the focus itself. */
function skip(event: Event): void {
  event.preventDefault();
  const content = document.getElementById("content");
  content?.setAttribute("tabindex", "-1");
  content?.focus();
}

const root = document.getElementById("page");
if (root) {
  root.replaceChildren();
  render(<Page />, root);
}
