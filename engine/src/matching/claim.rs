//! What a chain of words claims about observations (thesis 5.2.4, SPEC section 9).

use super::alignment::align_words;
use super::chain::Chain;
use super::config::MatchingConfig;
use crate::index::Lattice;
use crate::text::{Direction, Observation};

/// Two observations asserted to be the same place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ObservationPair {
    /// Index into the earlier run's observations.
    pub earlier: u32,
    /// Index into the later run's observations.
    pub later: u32,
}

/// First and last observation of the earlier and of the later stretch that a chain matches, all inclusive; `None` if
/// the chain is not of these texts or is empty.
pub fn chain_stretches(chain: &Chain, earlier: &Lattice, later: &Lattice) -> Option<[(u32, u32); 2]> {
    let (first, last) = (chain.pairs.first()?, chain.pairs.last()?);
    let (earlier_first, earlier_last) = (earlier.observations_of(first.0)?, earlier.observations_of(last.0)?);
    let (later_first, later_last) = (later.observations_of(first.1)?, later.observations_of(last.1)?);
    let earlier_stretch = match chain.direction {
        Direction::Same => (earlier_first.0, earlier_last.1),
        Direction::Opposite => (earlier_last.0, earlier_first.1),
    };
    Some([earlier_stretch, (later_first.0, later_last.1)])
}

/// Every observation of the later stretch with its counterpart, each matched word stretched over its partner
/// proportionally: what SPEC section 9 judges.
pub fn claimed_pairs(chain: &Chain, earlier: &Lattice, later: &Lattice) -> Vec<ObservationPair> {
    let mut pairs = Vec::new();
    for (earlier_id, later_id) in &chain.pairs {
        let Some(spans) = earlier.observations_of(*earlier_id).zip(later.observations_of(*later_id)) else {
            continue;
        };
        pairs.extend(proportional_pairs(spans.0, spans.1, chain.direction));
    }
    pairs
}

/// Pairs of observations at uniform distances, each matched word aligned by raw densities: what becomes constraints.
///
/// The nodes are the later run's observations whose index is a multiple of the configured spacing, so that all
/// matches of a run share its nodes; a word may be an alternative one of any length.
pub fn aligned_nodes(
    chain: &Chain,
    (earlier, earlier_observations): (&Lattice, &[Observation]),
    (later, later_observations): (&Lattice, &[Observation]),
    config: &MatchingConfig,
) -> Vec<ObservationPair> {
    let spacing = config.node_spacing_observations.max(1);
    let mut pairs = Vec::new();
    for (earlier_id, later_id) in &chain.pairs {
        let Some(spans) = earlier.observations_of(*earlier_id).zip(later.observations_of(*later_id)) else {
            continue;
        };
        let alignment = align_words(
            (earlier_observations, spans.0),
            (later_observations, spans.1),
            chain.direction,
            config.alignment_reach_observations,
        );
        let Some(alignment) = alignment else { continue };
        let earlier_size = spans.0.1 - spans.0.0 + 1;
        for node in (spans.1.0.next_multiple_of(spacing)..=spans.1.1).step_by(spacing as usize) {
            let offset = alignment.earlier_offset(node - spans.1.0, earlier_size, chain.direction);
            pairs.extend(offset.map(|offset| ObservationPair { earlier: spans.0.0 + offset, later: node }));
        }
    }
    pairs
}

/// What a match of two stretches claims: as many pairs as the longer one has observations.
pub(crate) fn claimed_between(
    earlier: (u32, u32),
    later: (u32, u32),
    direction: Direction,
) -> impl Iterator<Item = ObservationPair> {
    let is_earlier_longer = earlier.1 - earlier.0 > later.1 - later.0;
    let (shorter, longer) = if is_earlier_longer { (later, earlier) } else { (earlier, later) };
    proportional_pairs(shorter, longer, direction).map(move |pair| match is_earlier_longer {
        true => ObservationPair { earlier: pair.later, later: pair.earlier },
        false => pair,
    })
}

/// Pairs each observation of `later` with the one at the same share of `earlier`, rounded to the nearest.
fn proportional_pairs(
    earlier: (u32, u32),
    later: (u32, u32),
    direction: Direction,
) -> impl Iterator<Item = ObservationPair> {
    let (steps, earlier_steps) = (u64::from(later.1 - later.0).max(1), u64::from(earlier.1 - earlier.0));
    (later.0..=later.1).map(move |observation| {
        let along = ((u64::from(observation - later.0) * earlier_steps * 2 + steps) / (2 * steps)) as u32;
        let counterpart = match direction {
            Direction::Same => earlier.0 + along,
            Direction::Opposite => earlier.1 - along,
        };
        ObservationPair { earlier: counterpart, later: observation }
    })
}

#[cfg(test)]
mod tests {
    use super::super::alignment::tests::run_of;
    use super::*;
    use crate::text::{Word, WordId};

    fn text(spans: &[(u32, u32)]) -> Lattice {
        let word = |(index, &observations): (usize, &(u32, u32))| Word {
            id: WordId { level: 0, index: index as u32 },
            class: 0,
            size: observations.1 - observations.0 + 1,
            turn_rad: 0.0,
            observations,
            predecessors: vec![],
        };
        Lattice::from_words(&spans.iter().enumerate().map(word).collect::<Vec<_>>()).unwrap()
    }

    fn chain(direction: Direction, indices: &[(u32, u32)]) -> Chain {
        let id = |index| WordId { level: 0, index };
        Chain { pairs: indices.iter().map(|&(a, b)| (id(a), id(b))).collect(), direction, max_level: 0 }
    }

    #[test]
    fn a_chain_driven_back_claims_its_observations_backwards() {
        let (earlier, later) = (text(&[(0, 9), (10, 30)]), text(&[(0, 20), (21, 25)]));
        let back = chain(Direction::Opposite, &[(1, 0), (0, 1)]);
        assert_eq!(chain_stretches(&back, &earlier, &later), Some([(0, 30), (0, 25)]));
        let pairs = claimed_pairs(&back, &earlier, &later);
        assert_eq!(pairs.len(), 26);
        assert_eq!(pairs[0], ObservationPair { earlier: 30, later: 0 });
        assert_eq!(pairs[20], ObservationPair { earlier: 10, later: 20 });
        assert_eq!(pairs[21], ObservationPair { earlier: 9, later: 21 });
        assert_eq!(pairs[25], ObservationPair { earlier: 0, later: 25 });
    }

    #[test]
    fn nodes_are_uniform_and_follow_the_densities() {
        let wave = |idx: i32| 0.5 + 0.3 * (idx as f32 * 0.15).sin();
        let earlier_run = run_of((0..40).map(wave));
        let later_run = run_of((0..40).map(|idx| wave(idx + 4)));
        let same = chain(Direction::Same, &[(0, 0)]);
        let text = text(&[(0, 39)]);
        let config = MatchingConfig::default();
        let pairs = aligned_nodes(&same, (&text, &earlier_run), (&text, &later_run), &config);
        assert_eq!(pairs[0], ObservationPair { earlier: 4, later: 0 });
        assert!(pairs.windows(2).all(|pair| pair[1].later - pair[0].later == 5));
        assert!(pairs.iter().all(|pair| pair.earlier == pair.later + 4));
    }
}
