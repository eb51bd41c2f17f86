// A site: its views beside its map.

import { useEffect, useMemo } from "preact/hooks";
import { api } from "../api";
import type { Schemas } from "../api";
import { useCell, useLoaded } from "../cell";
import { addressOf, patch, usePlace } from "../place";
import { SiteContext, Stage } from "../site";
import type { SiteState } from "../site";
import { Alert, Choice, Go, many } from "../ui";
import { AskView } from "./ask";
import { CompareView } from "./compare";
import { JobsView, useJobs } from "./jobs";
import { LayersView } from "./layers";
import { LocalizeView } from "./localize";
import { ManageView } from "./manage";
import { MapPane } from "./pane";
import { MatchesView } from "./matches";
import { RunView } from "./run";
import { RunsView } from "./runs";

const VIEWS: readonly (readonly [string, string, () => preact.JSX.Element])[] = [
  ["map", "Map", LayersView],
  ["runs", "Runs", RunsView],
  ["matches", "Matches", MatchesView],
  ["ask", "Ask", AskView],
  ["localize", "Localize", LocalizeView],
  ["versions", "Versions", CompareView],
  ["jobs", "Jobs", JobsView],
  ["manage", "Manage", ManageView],
];

/** Parameters that go along from view to view. */
const KEPT_PARAMETERS = ["version", "component", "layers", "color", "state", "channel", "at"];

export function SitePage({ site }: { site: string }) {
  const place = usePlace();
  const view = place.path[2] ?? "map";
  const asked = place.query.get("version") ?? undefined;
  const stage = useMemo(() => new Stage(), [site]);
  const jobs = useJobs(site);
  const map = useLoaded(
    async (signal) => {
      // A site without a map refuses to show one, so the site is asked first whether it has any.
      const { map_version: newest } = await api.get("/v1/sites/{site}", { path: { site }, signal });
      if (!newest) return undefined;
      return api.get("/v1/sites/{site}/map", { path: { site }, query: asked ? { version: Number(asked) } : {}, signal });
    },
    `${site} ${asked ?? ""}`,
  );
  // A build that ended has made a version.
  const numBuilt = jobs.list.filter((job) => job.state === "done").map((job) => job.id).join();
  useEffect(() => {
    if (jobs.isLoaded && !asked) map.reload();
  }, [numBuilt]);
  useEffect(() => {
    document.title = `${site} · Locution`;
  }, [site]);
  if (map.error !== undefined) return <Missing site={site} error={map.error} />;

  const state: SiteState = {
    site,
    map: map.value,
    isLoading: map.isLoading && !map.value,
    component: componentShown(map.value, place.query.get("component")),
    jobs: jobs.list,
    stage,
    reload: () => {
      map.reload();
      jobs.reload();
    },
  };
  const known = VIEWS.find(([name]) => name === view) ?? VIEWS[0]!;
  const Shown = view === "runs" && place.path[3] ? RunView : known[2];
  return (
    <SiteContext.Provider value={state}>
      <SiteHead current={known[0]} />
      <main class={known[0] === "versions" ? "site wide" : "site"} id="content">
        <section class="panel" aria-label={known[1]} key={place.path.join("/")}>
          <Shown />
        </section>
        {known[0] !== "versions" && <MapPane />}
      </main>
    </SiteContext.Provider>
  );
}

function componentShown(map: Schemas["Map"] | undefined, asked: string | null): number {
  const wanted = Number(asked ?? NaN);
  if (map?.components.some(({ component }) => component === wanted)) return wanted;
  return map?.components[0]?.component ?? 0;
}

function SiteHead({ current }: { current: string }) {
  const place = usePlace();
  const site = place.path[1] ?? "";
  const kept = new URLSearchParams([...place.query].filter(([name]) => KEPT_PARAMETERS.includes(name)));
  return (
    <nav class="tabs" aria-label={`Views of ${site}`}>
      {VIEWS.map(([name, title]) => (
        <Go key={name} to={addressOf(["sites", site, name], kept)} isCurrent={name === current}>
          {title}
        </Go>
      ))}
    </nav>
  );
}

function Missing({ site, error }: { site: string; error: unknown }) {
  return (
    <main class="page" id="content">
      <h1>{site}</h1>
      <Alert error={error} />
      <p>
        <Go to={addressOf([])}>All sites</Go>
      </p>
    </main>
  );
}

/** Which version and which component is shown. */
export function MapChoice({ state }: { state: SiteState }) {
  const { map } = state;
  const place = usePlace();
  useCell(state.stage.tool);
  if (!map) return null;
  const newest = Math.max(...map.versions);
  return (
    <div class="row choices">
      <Choice
        label="Version"
        value={place.query.get("version") ?? ""}
        options={[["", `newest (${newest})`], ...[...map.versions].reverse().map((version) => [String(version), String(version)] as const)]}
        onChange={(version) => patch({ version, match: undefined }, false)}
      />
      <Choice
        label="Component"
        value={String(state.component)}
        options={map.components.map(({ component, runs }) => [String(component), `${component}: ${many(runs.length, "run")} (${shortened(runs.join(", "))})`] as const)}
        onChange={(component) => patch({ component, at: undefined }, false)}
      />
    </div>
  );
}

function shortened(text: string): string {
  return text.length > 28 ? `${text.slice(0, 27)}…` : text;
}
