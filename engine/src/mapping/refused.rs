//! Candidates that registration refused, kept visible: profiles that read alike where the submaps do not fit.

use super::candidates::Candidate;
use super::coarse_graph::Closure;
use super::place_match::{Channel, Evidence, MatchState, PlaceMatch, RejectionReason};
use crate::text::Interval;

/// Refused candidates that are listed, those that read most alike.
const NUM_REFUSED_MAX: usize = 200;

/// The refused among candidates and their registrations, best first; of those that overlap only the best.
pub(crate) fn refused_matches(candidates: &[Candidate], registered: &[Option<Closure>]) -> Vec<PlaceMatch> {
    let refused = candidates.iter().zip(registered).filter(|(_, closure)| closure.is_none());
    let mut refused: Vec<&Candidate> = refused.map(|(candidate, _)| candidate).collect();
    refused.sort_by(|a, b| {
        let place = |candidate: &Candidate| (candidate.profile.later, candidate.profile.earlier);
        b.profile.score.total_cmp(&a.profile.score).then_with(|| place(a).cmp(&place(b)))
    });
    let mut matches: Vec<PlaceMatch> = Vec::new();
    for Candidate { profile, .. } in refused {
        if matches.len() >= NUM_REFUSED_MAX {
            break;
        }
        let is_listed = matches.iter().any(|found| {
            found.direction == profile.direction
                && overlap(&found.earlier, &profile.earlier)
                && overlap(&found.later, &profile.later)
        });
        if is_listed {
            continue;
        }
        matches.push(PlaceMatch {
            earlier: profile.earlier,
            later: profile.later,
            direction: profile.direction,
            channel: Channel::Profile,
            evidence: Evidence { ambiguity: Some(profile.ambiguity), ..Evidence::default() },
            probability: 0.0,
            state: MatchState::Rejected(RejectionReason::Registration),
        });
    }
    matches
}

fn overlap(a: &Interval, b: &Interval) -> bool {
    a.run_idx == b.run_idx && a.first <= b.last && b.first <= a.last
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::retrieval::ProfileCandidate;
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
        Candidate { earlier: 0, later: 1, predicted: Pose2::identity(), profile }
    }

    #[test]
    fn the_best_of_each_pair_of_places_is_listed() {
        let candidates = [candidate(0, 2.0), candidate(40, 3.0), candidate(500, 1.0)];
        let listed = refused_matches(&candidates, &[None, None, None]);
        let firsts: Vec<u32> = listed.iter().map(|found| found.earlier.first).collect();
        assert_eq!(firsts, [40, 500]);
        assert!(
            listed.iter().all(|found| found.state == MatchState::Rejected(RejectionReason::Registration))
        );
    }

    #[test]
    fn a_bounded_number_is_listed() {
        let candidates: Vec<Candidate> = (0..500).map(|idx| candidate(idx * 100, f64::from(idx))).collect();
        let listed = refused_matches(&candidates, &vec![None; 500]);
        assert_eq!((listed.len(), listed[0].earlier.first), (200, 49_900));
    }
}
