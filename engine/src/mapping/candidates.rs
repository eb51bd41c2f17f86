//! Candidates from the text: pairs of anchors whose surroundings read alike.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::anchors::AnchorSet;
use super::config::MappingConfig;
use super::run::RunRecord;
use crate::geometry::Pose2;
use crate::retrieval::{ProfileCandidate, ProfileIndex, RunProfile};
use crate::text::{Direction, Interval};

/// A pair of anchors that may be the same place, and how they would then lie to each other.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// Anchor of the earlier stretch.
    pub earlier: usize,
    /// Anchor of the later stretch.
    pub later: usize,
    /// The later anchor seen from the earlier one, as the stretches are aligned.
    pub predicted: Pose2,
    /// What the retrieval said.
    pub profile: ProfileCandidate,
}

/// Profile candidates between different runs, at most one for a pair of anchors and a direction, in order of anchors.
///
/// Every two runs are compared on their own: among the runs of many buildings those of other buildings would take the
/// few places that each window has to give. Of every two runs the best `max_candidates_per_pair` are kept.
pub(crate) fn candidates_across(
    runs: &[RunRecord<'_>],
    set: &AnchorSet,
    config: &MappingConfig,
) -> Vec<Candidate> {
    let spacing_m = config.retrieval.sample_spacing_m;
    let profiles: Vec<RunProfile> =
        runs.iter().map(|run| RunProfile::from_observations(run.observations, spacing_m)).collect();
    let mut found = Vec::new();
    for later_run in 0..runs.len() {
        for earlier_run in 0..later_run {
            let pair = vec![profiles[earlier_run].clone(), profiles[later_run].clone()];
            let index = ProfileIndex::build(pair, config.retrieval.clone());
            let across = index.all_candidates(1).into_iter().filter(|found| found.earlier.run_idx == 0);
            let named = across.filter_map(|mut profile| {
                profile.earlier.run_idx = earlier_run as u32;
                profile.later.run_idx = later_run as u32;
                to_anchors(runs, set, profile)
            });
            found.extend(best_of_pair(named, config.max_candidates_per_pair));
        }
    }
    found.sort_by_key(Candidate::key);
    found
}

impl Candidate {
    fn key(&self) -> (usize, usize, Direction) {
        (self.later, self.earlier, self.profile.direction)
    }
}

/// The best candidate of every two anchors and direction, and of these the best few.
fn best_of_pair(candidates: impl Iterator<Item = Candidate>, num_max: usize) -> Vec<Candidate> {
    let mut best: BTreeMap<(usize, usize, Direction), Candidate> = BTreeMap::new();
    for candidate in candidates {
        let key = candidate.key();
        if best.get(&key).is_none_or(|other| candidate.profile.score > other.profile.score) {
            best.insert(key, candidate);
        }
    }
    let mut ranked: Vec<Candidate> = best.into_values().collect();
    ranked.sort_by(|a, b| b.profile.score.total_cmp(&a.profile.score).then(a.key().cmp(&b.key())));
    ranked.truncate(num_max);
    ranked
}

fn to_anchors(runs: &[RunRecord<'_>], set: &AnchorSet, profile: ProfileCandidate) -> Option<Candidate> {
    let (earlier, run_from_earlier) = nearest_anchor(runs, set, &profile.earlier)?;
    let (later, run_from_later) = nearest_anchor(runs, set, &profile.later)?;
    let turn = match profile.direction {
        Direction::Same => 0.0,
        Direction::Opposite => PI,
    };
    // The middles of the two stretches are one place; walk from one anchor to it and on to the other anchor.
    let to_middle = set.anchors[earlier].run_from_anchor.between(&run_from_earlier);
    let from_middle = run_from_later.between(&set.anchors[later].run_from_anchor);
    let predicted = to_middle.compose(&Pose2::new(0.0, 0.0, turn)).compose(&from_middle);
    Some(Candidate { earlier, later, predicted, profile })
}

/// The anchor nearest to the middle of an interval, and the pose of that middle in the run's frame.
fn nearest_anchor(runs: &[RunRecord<'_>], set: &AnchorSet, interval: &Interval) -> Option<(usize, Pose2)> {
    let run_idx = interval.run_idx as usize;
    let run = runs.get(run_idx)?;
    let middle = run.observations.get(((interval.first + interval.last) / 2) as usize)?;
    let after = run.keyframes.partition_point(|keyframe| keyframe.scan_seq < middle.scan_seq);
    let travel_m = set.travels_m[run_idx].get(after.min(run.keyframes.len().checked_sub(1)?))?;
    Some((set.nearest(run_idx, *travel_m)?, middle.run_from_robot))
}
