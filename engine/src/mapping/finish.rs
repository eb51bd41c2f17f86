//! The finished map as values, told of the runs in the order in which they were given.

use super::claims::{ClosureIndex, refused_match};
use super::component::Component;
use super::indices::{AnchorIdx, RunIdx};
use super::joining::Joined;
use super::judgements::Judgements;
use super::place_match::PlaceMatch;
use super::placement::place_observations;
use super::run::RunRecord;
use super::site_anchors::SiteAnchors;
use super::site_map::{MappedRun, SiteMap};
use super::stretches::{StretchSettings, find_stretches};
use crate::geometry::Pose2;

/// Longest stretch, observations: short ones are proportional enough.
const MAX_STRETCH: u32 = 25;

/// Places every keyframe, and makes the claims that the map amounts to.
pub(crate) fn finished(
    joined: Joined<'_>,
    site: &SiteAnchors<'_>,
    judgements: &Judgements<'_>,
    told: &[RunRecord<'_>],
) -> SiteMap {
    let Joined { components, refused, unfit } = joined;
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
    let matches = find_stretches(told, &poses, &component_of, &is_registered, &settings)
        .iter()
        .map(|stretch| settled(closures.spatial_match(stretch, told)))
        .collect();
    let within = components.iter().flat_map(|component| &component.refused);
    let refused = within.chain(&refused).map(|refusal| settled(refused_match(refusal, site)));
    let refused = refused.chain(unfit).collect();
    let num_components = runs.iter().map(|run| run.component + 1).max().unwrap_or_default();
    SiteMap { matches, refused, runs, num_components }
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
    let beginning = site.of_run(first).start;
    let began = AnchorIdx::new(beginning);
    let map_from_graph = site.anchor(began).run_from_anchor.compose(&component.graph.pose(began).inverse());
    let placed = |&run: &RunIdx| {
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
