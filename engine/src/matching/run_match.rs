//! One run's text against all texts of a site: what the map builder asks of this room.

use super::chain::{Chain, Relation, find_chains, find_chains_in};
use super::claim::chain_stretches;
use super::config::MatchingConfig;
use super::evidence::{ChainEvidence, TextStatistics};
use crate::index::Lattice;
use crate::text::Interval;

/// A chain that chance would hardly bring, as a claim about stretches of driving.
#[derive(Clone, Debug, PartialEq)]
pub struct RunMatch {
    /// The stretch driven first (or in the run listed first).
    pub earlier: Interval,
    /// The stretch that revisits it.
    pub later: Interval,
    /// The matching words.
    pub chain: Chain,
    /// What they are worth.
    pub evidence: ChainEvidence,
}

/// All matches of a run with the runs before it and with its own past, by the site's automatic threshold: chains of
/// any length count whose E-value is small enough. Ordered by earlier run, direction, levels and place.
pub fn match_run(
    texts: &[Lattice],
    later_run: usize,
    statistics: &TextStatistics,
    config: &MatchingConfig,
) -> Vec<RunMatch> {
    let Some(later) = texts.get(later_run) else { return Vec::new() };
    let any_length = MatchingConfig {
        min_chain_words: vec![config.min_surprising_words; config.min_chain_words.len()],
        ..config.clone()
    };
    let mut matches = Vec::new();
    let others: Vec<&Lattice> = texts[..later_run].iter().collect();
    let with_itself = find_chains(later, later, Relation::SameRun, &any_length);
    let chains = (find_chains_in(&others, later, &any_length).into_iter())
        .chain(with_itself.into_iter().map(|chain| (later_run, chain)));
    for (earlier_run, chain) in chains {
        let earlier = &texts[earlier_run];
        let Some(evidence) = statistics.evidence(&chain, later) else { continue };
        if evidence.expected_chance_matches > config.max_chance_matches {
            continue;
        }
        let Some([earlier_span, later_span]) = chain_stretches(&chain, earlier, later) else { continue };
        let interval = |run_idx: usize, span: (u32, u32)| Interval {
            run_idx: run_idx as u32,
            first: span.0,
            last: span.1,
        };
        matches.push(RunMatch {
            earlier: interval(earlier_run, earlier_span),
            later: interval(later_run, later_span),
            chain,
            evidence,
        });
    }
    matches
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::super::chain_tests::random_text;
    use super::*;
    use crate::index::WordTolerance;
    use crate::text::Direction;

    #[test]
    fn a_lap_driven_again_is_found_whatever_its_number_of_words() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let other = random_text(&mut rng, 120, 5, 2);
        let lap = random_text(&mut rng, 30, 5, 2);
        let texts = [&other, &lap, &lap].map(|words| Lattice::from_words(words).unwrap());
        let config = MatchingConfig::default();
        let statistics = TextStatistics::new(&texts, 2, WordTolerance::default());
        let matches = match_run(&texts, 2, &statistics, &config);
        let whole = matches.iter().find(|found| found.chain.pairs.len() == 30).unwrap();
        assert_eq!((whole.earlier.run_idx, whole.chain.direction), (1, Direction::Same));
        assert_eq!((whole.earlier.first, whole.earlier.last), (whole.later.first, whole.later.last));
        assert!(whole.evidence.expected_chance_matches < 1e-9);
        assert!(
            matches.iter().all(|found| found.evidence.expected_chance_matches <= config.max_chance_matches)
        );
    }
}
