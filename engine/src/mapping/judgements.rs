//! A person's word: vetoes keep two places apart, confirmations stand whatever the evidence.
//!
//! A decision is about two stretches of driving. For the graph it becomes two ranges of anchors that may not be
//! registered with each other; for the finished map it settles every match that overlaps both stretches.

use std::ops::Range;

use super::anchors::AnchorSet;
use super::place_match::{Decision, MatchState, PlaceMatch, RejectionReason};
use super::run::RunRecord;
use crate::geometry::Pose2;
use crate::text::Interval;

/// Decisions in terms of anchors.
pub(crate) struct Judgements<'a> {
    decisions: &'a [Decision],
    vetoes: Vec<Veto>,
}

/// Anchors that no closure may bring together.
struct Veto {
    earlier: Range<usize>,
    later: Range<usize>,
}

impl<'a> Judgements<'a> {
    /// Finds the anchors whose submaps reach into the stretches of each veto.
    pub fn new(decisions: &'a [Decision], runs: &[RunRecord<'_>], set: &AnchorSet, reach_m: f64) -> Self {
        let vetoes = decisions
            .iter()
            .filter(|decision| !decision.is_same_place)
            .filter_map(|decision| {
                Some(Veto {
                    earlier: anchors_at(&decision.earlier, runs, set, reach_m)?,
                    later: anchors_at(&decision.later, runs, set, reach_m)?,
                })
            })
            .collect();
        Self { decisions, vetoes }
    }

    /// True when a person said that these two anchors are different places.
    pub fn forbid(&self, a: usize, b: usize) -> bool {
        self.vetoes.iter().any(|veto| {
            (veto.earlier.contains(&a) && veto.later.contains(&b))
                || (veto.earlier.contains(&b) && veto.later.contains(&a))
        })
    }

    /// True when these poses lay two places over each other, one for which `is_guest` and one for which it is not,
    /// that a person said are different.
    pub fn contradict(&self, poses: &[Pose2], near_m: f64, is_guest: impl Fn(usize) -> bool) -> bool {
        self.vetoes.iter().any(|veto| {
            let is_across = is_guest(veto.earlier.start) != is_guest(veto.later.start);
            let middle = |range: &Range<usize>| &poses[(range.start + range.end - 1) / 2];
            is_across && middle(&veto.earlier).distance(middle(&veto.later)) <= near_m
        })
    }

    /// Settles a match on which a person spoke; the latest word counts.
    pub fn settle(&self, found: &mut PlaceMatch) {
        let on_it = self.decisions.iter().rev().find(|decision| decision.is_about(found));
        let Some(decision) = on_it else { return };
        (found.state, found.probability) = match decision.is_same_place {
            true => (MatchState::Verified, 1.0),
            false => (MatchState::Rejected(RejectionReason::Vetoed), 0.0),
        };
    }
}

/// Anchors within `reach_m` of travel of an interval; none when the run does not hold it.
fn anchors_at(
    interval: &Interval,
    runs: &[RunRecord<'_>],
    set: &AnchorSet,
    reach_m: f64,
) -> Option<Range<usize>> {
    let run_idx = interval.run_idx as usize;
    let run = runs.get(run_idx)?;
    let travel_at = |observation: u32| {
        let scan_seq = run.observations.get(observation as usize)?.scan_seq;
        let after = run.keyframes.partition_point(|keyframe| keyframe.scan_seq < scan_seq);
        set.travels_m[run_idx].get(after.min(run.keyframes.len().checked_sub(1)?)).copied()
    };
    let (first_m, last_m) = (travel_at(interval.first)? - reach_m, travel_at(interval.last)? + reach_m);
    let range = set.of_run(run_idx);
    let anchors = &set.anchors[range.clone()];
    let start = range.start + anchors.partition_point(|anchor| anchor.travel_m < first_m);
    let end = range.start + anchors.partition_point(|anchor| anchor.travel_m <= last_m);
    (start < end).then_some(start..end)
}
