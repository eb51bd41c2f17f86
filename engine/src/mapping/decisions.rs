//! What people decided about pairs of places.
//!
//! A decision is made on two stretches of driving and holds for everything that lies in both: a registration between
//! them that was vetoed is never a constraint, and a match that overlaps both says so.

use super::anchors::AnchorSet;
use super::coarse_graph::Closure;
use super::place_match::{Decision, MatchState, PlaceMatch, RejectionReason};
use super::run::RunRecord;
use crate::text::Interval;

/// A point of driving: position of the run, observation.
type Point = (u32, u32);

/// Whether a registration joins two stretches that somebody said are not the same place.
pub(crate) fn is_vetoed(
    closure: &Closure,
    decisions: &[Decision],
    set: &AnchorSet,
    runs: &[RunRecord<'_>],
) -> bool {
    if decisions.iter().all(|decision| decision.is_same_place) {
        return false;
    }
    let [earlier, later] = [closure.earlier, closure.later].map(|anchor| observation_at(anchor, set, runs));
    decisions.iter().filter(|decision| !decision.is_same_place).any(|decision| {
        let joins = |a: Point, b: Point| holds(&decision.earlier, a) && holds(&decision.later, b);
        joins(earlier, later) || joins(later, earlier)
    })
}

/// Marks the matches that were vetoed.
pub(crate) fn mark_vetoed(matches: &mut [PlaceMatch], decisions: &[Decision]) {
    for found in matches {
        let is_vetoed = decisions.iter().any(|decision| {
            !decision.is_same_place
                && decision.direction == found.direction
                && overlap(&decision.earlier, &found.earlier)
                && overlap(&decision.later, &found.later)
        });
        if is_vetoed {
            found.state = MatchState::Rejected(RejectionReason::Vetoed);
        }
    }
}

/// The observation made next to an anchor.
fn observation_at(anchor: usize, set: &AnchorSet, runs: &[RunRecord<'_>]) -> Point {
    let anchor = &set.anchors[anchor];
    let run = &runs[anchor.run_idx as usize];
    let scan_seq = run.keyframes[anchor.keyframe as usize].scan_seq;
    (anchor.run_idx, run.observations.partition_point(|observation| observation.scan_seq < scan_seq) as u32)
}

fn holds(interval: &Interval, point: Point) -> bool {
    interval.run_idx == point.0 && (interval.first..=interval.last).contains(&point.1)
}

fn overlap(a: &Interval, b: &Interval) -> bool {
    a.run_idx == b.run_idx && a.first <= b.last && b.first <= a.last
}
