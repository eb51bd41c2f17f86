//! A person's word: vetoes keep two places apart, confirmations stand whatever the evidence.
//!
//! A decision is about two stretches of driving. For the graph it becomes two ranges of anchors that may not be
//! registered with each other; for the finished map it settles every match that overlaps both stretches.

use std::ops::Range;

use super::coarse_graph::CoarseGraph;
use super::indices::{AnchorIdx, RunIdx};
use super::place_match::{Decision, MatchState, PlaceMatch, RejectionReason};
use super::site_anchors::SiteAnchors;
use crate::text::Interval;

/// Decisions in terms of anchors.
pub(crate) struct Judgements<'a> {
    decisions: &'a [Decision],
    vetoes: Vec<Veto>,
    /// For each run where it belongs, when somebody said.
    areas: Vec<Option<&'a str>>,
}

/// Anchors that no closure may bring together.
struct Veto {
    earlier: Range<usize>,
    later: Range<usize>,
}

impl<'a> Judgements<'a> {
    /// Finds the anchors whose submaps reach into the stretches of each veto.
    pub fn new(decisions: &'a [Decision], site: &SiteAnchors<'a>) -> Self {
        let vetoes = decisions
            .iter()
            .filter(|decision| !decision.is_same_place)
            .filter_map(|decision| {
                Some(Veto {
                    earlier: anchors_at(&decision.earlier, site)?,
                    later: anchors_at(&decision.later, site)?,
                })
            })
            .collect();
        let areas = site.runs().map(|run| site.record(run).area).collect();
        Self { decisions, vetoes, areas }
    }

    /// True when a person said that these two anchors are different places.
    pub fn forbid(&self, a: AnchorIdx, b: AnchorIdx) -> bool {
        let (a, b) = (a.at(), b.at());
        self.vetoes.iter().any(|veto| {
            (veto.earlier.contains(&a) && veto.later.contains(&b))
                || (veto.earlier.contains(&b) && veto.later.contains(&a))
        })
    }

    /// True when some of these runs were said to belong to another area than some of those.
    pub fn keep_apart(&self, these: &[RunIdx], those: &[RunIdx]) -> bool {
        let areas =
            |runs: &[RunIdx]| -> Vec<&str> { runs.iter().filter_map(|run| self.areas[run.at()]).collect() };
        let those = areas(those);
        areas(these).iter().any(|area| those.iter().any(|other| other != area))
    }

    /// True when a graph lays two places over each other, one for which `is_guest` and one for which it is not, that a
    /// person said are different.
    pub fn contradict(
        &self,
        graph: &CoarseGraph<'_>,
        near_m: f64,
        is_guest: impl Fn(AnchorIdx) -> bool,
    ) -> bool {
        self.vetoes.iter().any(|veto| {
            let middle = |range: &Range<usize>| AnchorIdx::new((range.start + range.end - 1) / 2);
            let (a, b) = (middle(&veto.earlier), middle(&veto.later));
            let is_across = graph.holds(a) && graph.holds(b) && is_guest(a) != is_guest(b);
            is_across && graph.pose(a).distance(&graph.pose(b)) <= near_m
        })
    }

    /// Settles a match on which a person spoke; the latest word counts.
    pub fn settle(&self, found: &mut PlaceMatch) {
        settle(self.decisions, found);
    }
}

/// Settles a match on which a person spoke; the latest word counts.
pub(crate) fn settle(decisions: &[Decision], found: &mut PlaceMatch) {
    let on_it = decisions.iter().rev().find(|decision| decision.is_about(found));
    let Some(decision) = on_it else { return };
    (found.state, found.probability) = match decision.is_same_place {
        true => (MatchState::Verified, 1.0),
        false => (MatchState::Rejected(RejectionReason::Vetoed), 0.0),
    };
}

/// Anchors whose submaps reach into an interval; none when the run does not hold it.
fn anchors_at(interval: &Interval, site: &SiteAnchors<'_>) -> Option<Range<usize>> {
    let run = site.run_told(interval.run_idx as usize)?;
    let reach_m = site.config.submap_half_length_m;
    let (first_m, last_m) = (site.travel_at(run, interval.first)?, site.travel_at(run, interval.last)?);
    let is_before = |index: &usize, travel_m: f64| site.anchor(AnchorIdx::new(*index)).travel_m < travel_m;
    let range = site.of_run(run);
    let start = range.clone().find(|index| !is_before(index, first_m - reach_m))?;
    let end = range.clone().find(|index| !is_before(index, last_m + reach_m)).unwrap_or(range.end);
    (start < end).then_some(start..end)
}
