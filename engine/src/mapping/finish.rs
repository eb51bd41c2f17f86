//! The finished map as values, told of the runs in the order in which they were given.

use super::claims::{ClosureIndex, refused_match};
use super::component::{Component, Workshop};
use super::indices::{AnchorIdx, BodyIdx, RunIdx};
use super::joining::Joined;
use super::null::Null;
use super::place_match::PlaceMatch;
use super::placement::place_observations;
use super::run::RunRecord;
use super::site_anchors::SiteAnchors;
use super::site_map::{MappedRun, SiteMap};
use super::stretches::{StretchSettings, find_stretches};
use crate::geometry::Pose2;
use crate::registration::Opinions;

/// Longest stretch, observations: short ones are proportional enough.
const MAX_STRETCH: u32 = 25;

/// A finished map, with what the next one may be founded upon.
pub(crate) struct Finished {
    /// Of exemplars and runs, in the order in which they were told.
    pub map: SiteMap,
    /// For each body where it lies in the map.
    pub map_from_bodies: Vec<Pose2>,
    /// For each component what its places say of each other where closures hold them together, when it will be settled.
    pub opinions: Vec<Opinions>,
    /// Wrong ways to lay runs over themselves.
    pub null: Null,
}

/// Places every keyframe, and makes the claims that the map amounts to. A map that is full will be settled.
pub(crate) fn finished(
    joined: Joined<'_>,
    workshop: Workshop<'_>,
    told: &[RunRecord<'_>],
    is_full: bool,
) -> Finished {
    let Workshop { site, judgements, .. } = workshop;
    let Joined { components, refused, unfit, null } = joined;
    let runs = mapped_runs(&components, site, told.len());
    let poses: Vec<Vec<Pose2>> =
        told.iter().zip(&runs).map(|(run, mapped)| place_observations(run, mapped)).collect();
    let settings = StretchSettings {
        distance_m: site.config.beside_m,
        min_gap_m: site.config.min_gap_m,
        max_observations: MAX_STRETCH,
        max_passes: site.config.max_matched_passes,
    };
    let component_of: Vec<u32> = runs.iter().map(|run| run.component).collect();
    let closures = ClosureIndex::new(site, &components);
    let settled = |mut found: PlaceMatch| {
        judgements.settle(&mut found);
        found
    };
    let is_registered = |a, b| closures.is_registered(a, b);
    let bodies: Vec<Option<BodyIdx>> =
        (0..told.len()).map(|place| site.run_told(place).and_then(|run| site.body_of(run))).collect();
    let matches = find_stretches(told, &poses, (&component_of, &bodies), &is_registered, &settings)
        .iter()
        .map(|stretch| settled(closures.spatial_match(stretch, told)))
        .collect();
    let within = components.iter().flat_map(|component| &component.refused);
    let refused = within.chain(&refused).map(|refusal| settled(refused_match(refusal, site)));
    let refused = refused.chain(unfit).collect();
    let num_components = runs.iter().map(|run| run.component + 1).max().unwrap_or_default();
    let mut opinions = vec![Opinions::default(); num_components as usize];
    for component in components.iter().filter(|_| is_full) {
        let number = runs[site.told(component.graph.runs()[0])].component;
        opinions[number as usize] = component.opinions(workshop);
    }
    let map_from_bodies = map_from_bodies(&components, site);
    Finished { map: SiteMap { matches, refused, runs, num_components }, map_from_bodies, opinions, null }
}

/// For each body where it lies in its component.
fn map_from_bodies(components: &[Component<'_>], site: &SiteAnchors<'_>) -> Vec<Pose2> {
    let mut map_from_bodies = Vec::new();
    for exemplar in site.runs() {
        if site.body_of(exemplar).is_none_or(|body| body.at() != map_from_bodies.len()) {
            continue;
        }
        let is_of_it = |component: &&Component<'_>| component.graph.runs().binary_search(&exemplar).is_ok();
        let Some(component) = components.iter().find(is_of_it) else { continue };
        let map_from_graph = map_from_graph(component, first_told(component));
        map_from_bodies.push(map_from_graph.compose(&component.graph.pose_of_body(exemplar)));
    }
    map_from_bodies
}

/// The run of a component that was told first.
fn first_told(component: &Component<'_>) -> RunIdx {
    let (runs, site) = (component.graph.runs(), component.graph.site);
    *runs.iter().min_by_key(|run| site.told(**run)).unwrap_or(&runs[0])
}

/// The frame of a component is where the run that was told first began, or that of its body if it is an exemplar.
fn map_from_graph(component: &Component<'_>, first: RunIdx) -> Pose2 {
    let site = component.graph.site;
    if site.body_of(first).is_some() {
        return component.graph.pose_of_body(first).inverse();
    }
    let began = AnchorIdx::new(site.of_run(first).start);
    site.anchor(began).run_from_anchor.compose(&component.graph.pose(began).inverse())
}

/// Every run in its component. Components are numbered by the run that was given first, and stand in its frame: what a
/// map's axes mean does not change when runs are added. Runs without keyframes are components of their own.
fn mapped_runs(components: &[Component<'_>], site: &SiteAnchors<'_>, num_runs: usize) -> Vec<MappedRun> {
    let mut component_of: Vec<Option<&Component<'_>>> = vec![None; num_runs];
    for component in components {
        component.graph.runs().iter().for_each(|&run| component_of[site.told(run)] = Some(component));
    }
    let mut mapped: Vec<Option<MappedRun>> = vec![None; num_runs];
    let mut number = 0;
    for place in 0..num_runs {
        if mapped[place].is_some() {
            continue;
        }
        match component_of[place].zip(site.run_told(place)) {
            Some((component, first)) => {
                for (run, keyframes) in in_frame_of(component, first) {
                    let map_from_keyframes = keyframes;
                    mapped[site.told(run)] = Some(MappedRun { component: number, map_from_keyframes });
                }
            }
            None => mapped[place] = Some(MappedRun { component: number, map_from_keyframes: Vec::new() }),
        }
        number += 1;
    }
    mapped.into_iter().map(Option::unwrap_or_default).collect()
}

/// Poses of the keyframes of all runs of a component in the frame of one of them: where that run began.
fn in_frame_of(component: &Component<'_>, first: RunIdx) -> Vec<(RunIdx, Vec<Pose2>)> {
    let site = component.graph.site;
    let map_from_graph = map_from_graph(component, first);
    let placed = |&run: &RunIdx| {
        if site.body_of(run).is_some() {
            let map_from_body = map_from_graph.compose(&component.graph.pose_of_body(run));
            let keyframes = site.record(run).keyframes.iter();
            return (
                run,
                keyframes.map(|keyframe| map_from_body.compose(&keyframe.run_from_robot)).collect(),
            );
        }
        let pose_of = |anchor| map_from_graph.compose(&component.graph.pose(anchor));
        (run, spread_corrections(site, run, pose_of))
    };
    component.graph.runs().iter().map(placed).collect()
}

/// Keyframes between anchors follow the odometry; the closure error is spread along the travel.
fn spread_corrections(
    site: &SiteAnchors<'_>,
    run: RunIdx,
    pose_of: impl Fn(AnchorIdx) -> Pose2,
) -> Vec<Pose2> {
    let anchors: Vec<AnchorIdx> = site.of_run(run).map(AnchorIdx::new).collect();
    let keyframes = site.record(run).keyframes;
    let mut placed = Vec::with_capacity(keyframes.len());
    let mut from = 0;
    for (index, keyframe) in keyframes.iter().enumerate() {
        while from + 2 < anchors.len() && site.anchor(anchors[from + 1]).keyframe.at() <= index {
            from += 1;
        }
        let carried = |by: AnchorIdx| {
            pose_of(by).compose(&site.anchor(by).run_from_anchor.between(&keyframe.run_from_robot))
        };
        let by_first = carried(anchors[from]);
        let Some(&next) = anchors.get(from + 1) else {
            placed.push(by_first);
            continue;
        };
        let (start_m, end_m) = (site.anchor(anchors[from]).travel_m, site.anchor(next).travel_m);
        let share = ((site.travel_m(run, index) - start_m) / (end_m - start_m).max(1e-6)).clamp(0.0, 1.0);
        let error = by_first.between(&carried(next));
        placed.push(by_first.compose(&Pose2::new(error.x * share, error.y * share, error.theta * share)));
    }
    placed
}
