//! From runs to one map, the conductor.

use std::collections::BTreeSet;

use super::anchors::AnchorSet;
use super::coarse_graph::{Closure, CoarseGraph};
use super::config::MappingConfig;
use super::guided::guided_closures;
use super::memo::RegistrationMemo;
use super::place_match::Decision;
use super::run::RunRecord;
use super::site_map::{MappedRun, SiteMap};
use crate::geometry::Pose2;
use crate::pose_graph::PoseGraphError;

/// Builds the map of a site.
///
/// # Errors
/// Whatever the pose graph cannot solve.
pub fn map_site(
    config: &MappingConfig,
    runs: &[RunRecord<'_>],
    _decisions: &[Decision],
    memo: &mut RegistrationMemo,
) -> Result<SiteMap, PoseGraphError> {
    memo.prepare(&config.submap);
    let set = AnchorSet::build(runs, config);
    let components: Vec<u32> = (0..runs.len() as u32).collect();
    let mut graph = CoarseGraph::new(&set, runs, config);
    graph.optimise(&set, &[], config)?;
    let mut closures: Vec<Closure> = Vec::new();
    for _round in 0..config.max_rounds {
        let found = guided_closures(&set, &graph, &components, config, memo)?;
        let kept = graph.optimise(&set, &found, config)?;
        let found: Vec<Closure> =
            found.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(closure, _)| closure).collect();
        if std::env::var("V").is_ok() {
            eprintln!("round {_round}: closures {} memo {}", found.len(), memo.len());
        }
        let is_settled = num_changed(&closures, &found) * 100 <= found.len();
        closures = found;
        if is_settled {
            break;
        }
    }
    let runs = (0..runs.len())
        .map(|run_idx| MappedRun {
            component: components[run_idx],
            map_from_keyframes: spread_corrections(&set, runs, run_idx, &graph.poses),
        })
        .collect();
    Ok(SiteMap { matches: Vec::new(), runs, num_components: components.len() as u32 })
}

/// How many pairs stand in one list and not in the other.
fn num_changed(before: &[Closure], after: &[Closure]) -> usize {
    let pairs = |closures: &[Closure]| -> BTreeSet<(usize, usize)> {
        closures.iter().map(|closure| (closure.earlier, closure.later)).collect()
    };
    pairs(before).symmetric_difference(&pairs(after)).count()
}

/// Keyframes between anchors follow the odometry; the closure error is spread along the travel.
fn spread_corrections(
    set: &AnchorSet,
    runs: &[RunRecord<'_>],
    run_idx: usize,
    poses: &[Pose2],
) -> Vec<Pose2> {
    let range = set.of_run(run_idx);
    let keyframes = runs[run_idx].keyframes;
    let mut placed = Vec::with_capacity(keyframes.len());
    let mut from = range.start;
    for (index, keyframe) in keyframes.iter().enumerate() {
        while from + 2 < range.end && set.anchors[from + 1].keyframe as usize <= index {
            from += 1;
        }
        let anchor = &set.anchors[from];
        let by_first = poses[from].compose(&anchor.run_from_anchor.between(&keyframe.run_from_robot));
        let Some(next) = set.anchors[..range.end].get(from + 1) else {
            placed.push(by_first);
            continue;
        };
        let by_next = poses[from + 1].compose(&next.run_from_anchor.between(&keyframe.run_from_robot));
        let travel_m = set.travels_m[run_idx][index];
        let share =
            ((travel_m - anchor.travel_m) / (next.travel_m - anchor.travel_m).max(1e-6)).clamp(0.0, 1.0);
        let error = by_first.between(&by_next);
        placed.push(by_first.compose(&Pose2::new(error.x * share, error.y * share, error.theta * share)));
    }
    placed
}
