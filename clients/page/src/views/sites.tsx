// All sites, page by page, and what to do on a server that has none.

import { useEffect, useState } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useLoaded } from "../cell";
import { addressOf, go, patch, usePlace } from "../place";
import { Alert, Field, Form, Go, bytes, count, many } from "../ui";
import { isName } from "../upload";

const PAGE = 50;
/** Pages that are looked through for a name before the search stops. */
const PAGES_SEARCHED = 20;

interface Listing {
  sites: Schemas["SiteSummary"][];
  next: string | null;
}

/** One page from a cursor; with a part of a name, as many as it takes to fill one. */
async function loadSites(cursor: string, part: string, signal: AbortSignal): Promise<Listing> {
  const sites: Schemas["SiteSummary"][] = [];
  let next: string | null = cursor;
  for (let page = 0; page < (part ? PAGES_SEARCHED : 1) && next !== null && sites.length < PAGE; page++) {
    const answer: Schemas["SiteSummaryPage"] = await api.get("/v1/sites", { query: { limit: part ? 1000 : PAGE, ...(next ? { cursor: next } : {}) }, signal });
    sites.push(...answer.items.filter(({ site }) => site.toLowerCase().includes(part.toLowerCase())));
    next = answer.next_cursor ?? null;
  }
  return { sites, next };
}

export function SitesPage() {
  const { query } = usePlace();
  const cursor = query.get("from") ?? "";
  const part = query.get("name") ?? "";
  const listing = useLoaded((signal) => loadSites(cursor, part, signal), `${cursor} ${part}`);
  useEffect(() => {
    document.title = "Locution";
  }, []);
  const isEmpty = listing.value?.sites.length === 0 && !cursor && !part;
  return (
    <main class="page" id="content">
      <div class="row">
        <h1 class="grow">Sites</h1>
        {!isEmpty && (
          <Field label="Part of a name" isHidden type="search" placeholder="Part of a name" value={part} onInput={(event) => patch({ name: event.currentTarget.value, from: undefined })} />
        )}
      </div>
      <Alert error={listing.error} />
      {isEmpty && <Empty />}
      {listing.value && !isEmpty && <SiteTable sites={listing.value.sites} />}
      {listing.value?.sites.length === 0 && !isEmpty && <p>No site has such a name.</p>}
      <div class="row">
        {cursor && (
          <Go class="plain" to={addressOf([], { name: part })}>
            First page
          </Go>
        )}
        {listing.value?.next && (
          <Go class="plain" to={addressOf([], { name: part, from: listing.value.next })}>
            Next page
          </Go>
        )}
      </div>
      {!isEmpty && listing.value && <NewSite />}
    </main>
  );
}

function SiteTable({ sites }: { sites: Schemas["SiteSummary"][] }) {
  return (
    <ul class="list sites">
      {sites.map((site) => (
        <li key={site.site}>
          <Go class="item" to={addressOf(["sites", site.site, "map"])}>
            <span class="grow">
              {site.site}
              <small>
                {many(site.num_runs, "run")} · {many(site.num_scans, "scan")} · {many(site.num_words, "word")} · {bytes(site.bytes_on_disk)}
              </small>
            </span>
            {site.state === "unreadable" ? (
              <span class="state failed" title={site.reason ?? ""}>
                unreadable
              </span>
            ) : site.map_version ? (
              <span class="num">map {count(site.map_version)}</span>
            ) : (
              <span class="soft">no map</span>
            )}
          </Go>
        </li>
      ))}
    </ul>
  );
}

function Empty() {
  return (
    <>
      <p class="lead">
        This server has no site yet. A site is one building or one area: robots drive through it, and their runs become its map.
      </p>
      <NewSite isFirst />
      <div class="card">
        <h2>Or from the command line</h2>
        <p>Three simulated robots that map an office floor, on a server of their own:</p>
        <pre tabIndex={0}>locution demo</pre>
        <p>Recordings of your own, as bags of ROS or CARMEN logs:</p>
        <pre tabIndex={0}>{`locution replay my-robot.mcap --url ${location.origin} --site office --wait`}</pre>
        <p>
          Robots send their scans over HTTP; the <a href="/docs/">API</a> says how.
        </p>
      </div>
    </>
  );
}

function NewSite({ isFirst }: { isFirst?: boolean }) {
  const [name, setName] = useState("");
  const make = async () => {
    await api.put("/v1/sites/{site}", { path: { site: name }, body: {} });
    go(["sites", name, "runs"]);
  };
  return (
    <Form class="card" act={make} label="New site">
      <h2>{isFirst ? "Begin in this browser" : "New site"}</h2>
      {isFirst && <p>Give the building a name; then choose the recordings of your robots.</p>}
      <div class="row">
        <Field label="Name of the site" value={name} required maxLength={64} autocomplete="off" onInput={(event) => setName(event.currentTarget.value)} hint="letters, digits, dot, dash and underline" />
        <button type="submit" class="main" disabled={!isName(name)}>
          Make the site
        </button>
      </div>
    </Form>
  );
}
