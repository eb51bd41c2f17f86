//! What the map does not bear out, kept visible: fits that contradict it, and profiles that read alike where the submaps
//! do not fit.

use super::candidates::Candidate;
use super::coarse_graph::Closure;
use super::indices::RunIdx;
use super::place_match::{Channel, Evidence, MatchState, PlaceMatch, RejectionReason};
use super::site_anchors::SiteAnchors;
use crate::retrieval::ProfileCandidate;
use crate::text::Interval;

/// A fit that does not constrain the map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusal {
    /// What found it.
    pub channel: Channel,
    /// The fit.
    pub closure: Closure,
    /// Why it does not.
    pub reason: RejectionReason,
}

/// Refused candidates that are listed, those that read most alike.
const NUM_REFUSED_MAX: usize = 200;

/// Candidates whose submaps do not fit, best first; of those that overlap only the best.
pub(crate) fn unfit_matches<'c>(
    unfit: impl Iterator<Item = &'c Candidate>,
    site: &SiteAnchors<'_>,
) -> Vec<PlaceMatch> {
    let mut matches: Vec<PlaceMatch> = Vec::new();
    for profile in best_apart(unfit) {
        let told = |interval: &Interval| Interval {
            run_idx: site.told(RunIdx::new(interval.run_idx as usize)) as u32,
            ..*interval
        };
        let (mut earlier, mut later) = (told(&profile.earlier), told(&profile.later));
        if earlier.run_idx > later.run_idx {
            std::mem::swap(&mut earlier, &mut later);
        }
        matches.push(PlaceMatch {
            earlier,
            later,
            direction: profile.direction,
            channel: Channel::Profile,
            evidence: Evidence { ambiguity: Some(profile.ambiguity), ..Evidence::default() },
            probability: 0.0,
            state: MatchState::Rejected(RejectionReason::Registration),
        });
    }
    matches
}

/// The candidates that read most alike, none of which overlaps a better one.
fn best_apart<'c>(candidates: impl Iterator<Item = &'c Candidate>) -> Vec<&'c ProfileCandidate> {
    let mut ranked: Vec<&ProfileCandidate> = candidates.map(|candidate| &candidate.profile).collect();
    ranked.sort_by(|a, b| {
        let place = |profile: &ProfileCandidate| (profile.later, profile.earlier);
        b.score.total_cmp(&a.score).then_with(|| place(a).cmp(&place(b)))
    });
    let mut chosen: Vec<&ProfileCandidate> = Vec::new();
    for profile in ranked {
        let is_listed = chosen.iter().any(|other| {
            other.direction == profile.direction
                && other.earlier.overlaps(&profile.earlier)
                && other.later.overlaps(&profile.later)
        });
        if !is_listed && chosen.len() < NUM_REFUSED_MAX {
            chosen.push(profile);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::super::indices::AnchorIdx;
    use super::*;
    use crate::geometry::Pose2;
    use crate::text::Direction;

    fn candidate(first: u32, score: f64) -> Candidate {
        let profile = ProfileCandidate {
            earlier: Interval { run_idx: 0, first, last: first + 50 },
            later: Interval { run_idx: 1, first: 100, last: 150 },
            direction: Direction::Same,
            resemblance: 0.9,
            score,
            ambiguity: 0.5,
        };
        let (earlier, later) = (AnchorIdx::new(0), AnchorIdx::new(1));
        Candidate { earlier, later, predicted: Pose2::identity(), profile }
    }

    #[test]
    fn the_best_of_each_pair_of_places_is_listed() {
        let candidates = [candidate(0, 2.0), candidate(40, 3.0), candidate(500, 1.0)];
        let firsts: Vec<u32> =
            best_apart(candidates.iter()).iter().map(|found| found.earlier.first).collect();
        assert_eq!(firsts, [40, 500]);
    }

    #[test]
    fn a_bounded_number_is_listed() {
        let candidates: Vec<Candidate> = (0..500).map(|idx| candidate(idx * 100, f64::from(idx))).collect();
        let listed = best_apart(candidates.iter());
        assert_eq!((listed.len(), listed[0].earlier.first), (200, 49_900));
    }
}
