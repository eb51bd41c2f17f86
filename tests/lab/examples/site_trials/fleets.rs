//! Fleets with unknown starts: which robots were laid over each other, and which should have been.

use std::time::Instant;

use locution_engine::config::EngineConfig;
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::mapping::{RegistrationMemo, RunRecord, SiteMap, map_site};
use serde::Serialize;

use crate::Failure;
use crate::driven::Driven;

/// A join is false when it puts the other run farther than this from the truth, metres.
const FALSE_M: f64 = 1.0;
/// Runs share a place where they come within this of each other, metres.
const SHARED_M: f64 = 1.0;
/// Runs that share this much should be joined, metres.
const MISSED_M: f64 = 30.0;

/// What became of one fleet.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FleetReport {
    pub name: String,
    pub num_runs: usize,
    pub num_components: u32,
    /// Pairs of runs of one component that the map puts elsewhere than the truth, and by how much; nothing is known of
    /// runs in different buildings.
    pub false_joins: Vec<(usize, usize, Option<f64>)>,
    /// Pairs of runs in different components that share much, and how much.
    pub missed_joins: Vec<(usize, usize, f64)>,
    /// True when every robot can be reached from every other over neighbors that share enough.
    pub should_be_one: bool,
    pub seconds: f64,
}

/// Builds the map, and says how long that took.
pub fn mapped(runs: &[Driven]) -> Result<(SiteMap, f64), Failure> {
    let records: Vec<RunRecord<'_>> = runs.iter().map(Driven::record).collect();
    let began = Instant::now();
    let map = map_site(&EngineConfig::default().mapping, &records, &[], &mut RegistrationMemo::default())?;
    Ok((map, began.elapsed().as_secs_f64()))
}

/// Judges the components of a map by the truth.
pub fn judged(name: &str, runs: &[Driven], map: &SiteMap, seconds: f64) -> FleetReport {
    let mut report = FleetReport {
        name: name.to_owned(),
        num_runs: runs.len(),
        num_components: map.num_components,
        seconds,
        ..FleetReport::default()
    };
    let mut reachable: Vec<usize> = (0..runs.len()).collect();
    for later in 0..runs.len() {
        for earlier in 0..later {
            let (a, b) = (&runs[earlier], &runs[later]);
            let is_joined = map.runs[earlier].component == map.runs[later].component;
            let shared_m = if a.place == b.place { shared_m(a, b).min(shared_m(b, a)) } else { 0.0 };
            if shared_m >= MISSED_M {
                let (from, to) = (reachable[later], reachable[earlier]);
                reachable.iter_mut().filter(|root| **root == from).for_each(|root| *root = to);
                if !is_joined {
                    report.missed_joins.push((earlier, later, shared_m));
                }
            }
            if is_joined {
                let error_m = (a.place == b.place).then(|| misplaced_m(runs, map, earlier, later));
                if error_m.is_none_or(|error_m| error_m > FALSE_M) {
                    report.false_joins.push((earlier, later, error_m));
                }
            }
        }
    }
    report.should_be_one = reachable.iter().all(|root| *root == reachable[0]);
    report
}

/// Travel of `b` within reach of any place of `a`, metres.
fn shared_m(a: &Driven, b: &Driven) -> f64 {
    let is_near = |pose: &Pose2| a.truth.iter().any(|other| other.distance(pose) <= SHARED_M);
    b.truth.windows(2).filter(|pair| is_near(&pair[1])).map(|pair| pair[0].distance(&pair[1])).sum()
}

/// Median distance of a run from the truth when the map is laid over the truth by another run, whichever way is less.
fn misplaced_m(runs: &[Driven], map: &SiteMap, first: usize, second: usize) -> f64 {
    let error = |by: usize, of: usize| {
        let world_from_map = world_from_map(&runs[by].truth, &map.runs[by].map_from_keyframes);
        let mut errors: Vec<f64> = map.runs[of]
            .map_from_keyframes
            .iter()
            .zip(&runs[of].truth)
            .map(|(pose, truth)| world_from_map.compose(pose).distance(truth))
            .collect();
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    error(first, second).min(error(second, first))
}

/// The rigid motion that lays poses best over the truth.
pub fn world_from_map(truth: &[Pose2], poses: &[Pose2]) -> Pose2 {
    let num = poses.len() as f64;
    let mean =
        |of: &[Pose2]| of.iter().fold((0.0, 0.0), |sum, pose| (sum.0 + pose.x / num, sum.1 + pose.y / num));
    let (from, to) = (mean(poses), mean(truth));
    let (mut sin, mut cos) = (0.0, 0.0);
    for (pose, truth) in poses.iter().zip(truth) {
        let (p, q) = ((pose.x - from.0, pose.y - from.1), (truth.x - to.0, truth.y - to.1));
        sin += p.0 * q.1 - p.1 * q.0;
        cos += p.0 * q.0 + p.1 * q.1;
    }
    let turn = Pose2::new(0.0, 0.0, f64::atan2(sin, cos));
    let turned = turn.transform_point(&Point2::new(from.0, from.1));
    Pose2::new(to.0 - turned.x, to.1 - turned.y, turn.theta)
}
