// The panel beside the map: what is shown, figures, downloads.

import { save, sitePath } from "../api";
import { CHANGE_COLORS, STATE_COLORS } from "../colors";
import { addressOf, patch, usePlace } from "../place";
import { useSite } from "../site";
import { Act, Choice, Figures, Go, Tick, count, metres } from "../ui";
import { CHANNELS, LAYERS, STATES, useChoice } from "./chosen";
import type { LayerName } from "./chosen";
import { NewAnnotation } from "./named";
import { RouteForm } from "./route";

export function LayersView() {
  const { site, map, jobs } = useSite();
  const choice = useChoice();
  const running = jobs.find((job) => job.state === "running" || job.state === "queued");
  const toggle = (name: LayerName, isOn: boolean) => {
    const shown = LAYERS.map(([layer]) => layer).filter((layer) => (layer === name ? isOn : choice.shown.has(layer)));
    patch({ layers: shown.join() || "none" });
  };
  return (
    <>
      <h1>{site}</h1>
      {running && (
        <p class="soft">
          <Go to={addressOf(["sites", site, "jobs"])}>A build is {running.state}</Go>: {running.detail}
        </p>
      )}
      {!map && <FirstSteps site={site} />}
      {map && (
        <>
          <fieldset>
            <legend>Layers</legend>
            {LAYERS.map(([name, title]) => (
              <div key={name}>
                <Tick label={title} isOn={choice.shown.has(name)} onChange={(isOn) => toggle(name, isOn)} />
                {name === "matches" && choice.shown.has(name) && <MatchFilters />}
                {name === "words" && choice.shown.has(name) && <WordColors />}
                {name === "changes" && choice.shown.has(name) && <Sessions />}
                {name === "rooms" && choice.shown.has(name) && <small class="sub soft">Click a room to name it.</small>}
                {name === "annotations" && choice.shown.has(name) && <NewAnnotation />}
              </div>
            ))}
          </fieldset>
          <RouteForm />
          <MapFigures />
        </>
      )}
    </>
  );
}

function FirstSteps({ site }: { site: string }) {
  return (
    <div class="card">
      <p>This site has no map yet. A map is made of recordings: one run for each drive of a robot.</p>
      <p>
        <Go class="main" to={addressOf(["sites", site, "runs"])}>
          Send recordings
        </Go>
      </p>
    </div>
  );
}

function MatchFilters() {
  const choice = useChoice();
  const changed = (chosen: Set<string>, all: readonly string[], name: string, isOn: boolean) =>
    all.filter((one) => (one === name ? isOn : chosen.has(one))).join() || "none";
  return (
    <div class="sub" role="group" aria-label="Which matches">
      {STATES.map((state) => (
        <Tick key={state} label={state} swatch={STATE_COLORS[state]} isOn={choice.states.has(state)} onChange={(isOn) => patch({ state: changed(choice.states, STATES, state, isOn) })} />
      ))}
      <span class="soft">found by</span>
      {CHANNELS.map((channel) => (
        <Tick key={channel} label={CHANNEL_TITLES[channel]} isOn={choice.channels.has(channel)} onChange={(isOn) => patch({ channel: changed(choice.channels, CHANNELS, channel, isOn) })} />
      ))}
    </div>
  );
}

export const CHANNEL_TITLES: Record<string, string> = { spatial: "nearness in the map", words: "words", profile: "density profile" };

function WordColors() {
  const choice = useChoice();
  return (
    <div class="sub">
      <Choice
        label="Color by"
        value={choice.isByDensity ? "density" : "class"}
        options={[["class", "density class of the word"], ["density", "density as observed"]]}
        onChange={(color) => patch({ color: color === "class" ? undefined : color })}
      />
    </div>
  );
}

/** Which sessions are compared for changes. */
function Sessions() {
  const { map } = useSite();
  const { query } = usePlace();
  const runs = map?.runs.map((run) => run.run) ?? [];
  const options = [["", "latest against all others"] as const, ...runs.map((run) => [run, run] as const)];
  return (
    <div class="sub" role="group" aria-label="Sessions compared">
      <Choice label="After" value={query.get("after") ?? ""} options={options} onChange={(after) => patch({ after })} />
      <Choice label="Before" value={query.get("before") ?? ""} options={[["", "all others"], ...runs.map((run) => [run, run] as const)]} onChange={(before) => patch({ before })} />
      <small class="soft">
        <span class="key" style={{ background: CHANGE_COLORS["appeared"] }} /> appeared <span class="key" style={{ background: CHANGE_COLORS["disappeared"] }} /> disappeared
      </small>
    </div>
  );
}

/** Forms of the map that other programs read. */
const FORMS = [
  ["grid.pgm", "Grid for map_server (PGM)"],
  ["grid.yaml", "Its YAML"],
  ["grid.png", "Grid (PNG)"],
  ["picture.svg", "Picture (SVG)"],
  ["trajectory.tum", "Trajectories (TUM)"],
  ["graph.g2o", "Pose graph (g2o)"],
  ["rooms.geojson", "Rooms and doors (GeoJSON)"],
] as const;

function MapFigures() {
  const { site, map, component } = useSite();
  if (!map) return null;
  const { statistics } = map;
  const prefix = `${site}-${map.version}-${component}-`;
  const saved = (name: string) => {
    // The YAML names its image, which lies beside it under the name that it was given here.
    const edit = name === "grid.yaml" ? (text: string) => text.replace(/^image: .*$/m, `image: ${prefix}grid.pgm`) : undefined;
    return save(`${sitePath(site)}/map/${name}?version=${map.version}&component=${component}`, prefix + name, edit);
  };
  return (
    <>
      <h2>This version</h2>
      <Figures
        figures={[
          ["Version", map.version],
          ["Runs", map.runs.length],
          ["Components", map.components.length],
          ["Driven", metres(statistics.length_m)],
          ["Keyframes", count(statistics.num_keyframes)],
          ["Matches", `${count(statistics.num_verified)} of ${count(statistics.num_matches)} verified`],
          ["Built in", `${statistics.duration_s.toFixed(1)} s`],
        ]}
      />
      <h2>Take it along</h2>
      <ul class="plainlist">
        {FORMS.map(([name, title]) => (
          <li key={name}>
            <Act act={() => saved(name)}>{title}</Act>
          </li>
        ))}
      </ul>
    </>
  );
}
