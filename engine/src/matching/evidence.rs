//! How surprising a chain is, which answers the thesis' open question of how many words are enough (SPEC section 4).
//!
//! A pair of words is worth −log2 P bits, P being the share of the site's words that match the later one. Neighbouring
//! words never have the same class, so words that stand after a word of the same class are what it is compared with;
//! otherwise every pair after the first would look rarer than it is. A chain sums its bits. The number of pairs of
//! paths of that many words through the two texts, times 2^−bits, is how many such chains chance would bring: an
//! E-value, as tools that search sequences report it.

use super::chain::Chain;
use crate::index::{Lattice, Syllables, WordTolerance, WordWindow, num_nodes_covered};
use crate::text::{Direction, WordId};

/// Stands for the class of the word before the first one of a run.
const NO_CLASS: u16 = u16::MAX;

/// What a chain is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainEvidence {
    /// Sum over its pairs of −log2 of the share of words that match.
    pub bits: f64,
    /// Chains as surprising as this one that chance would bring between this text and the whole site.
    pub expected_chance_matches: f64,
}

/// The words of a site, counted; what "by chance" means there.
#[derive(Clone, Debug)]
pub struct TextStatistics {
    tolerance: WordTolerance,
    /// For words up to each level, read forwards and backwards.
    tables: Vec<[WordCounts; 2]>,
}

/// Words by the class before them, in one reading direction.
#[derive(Clone, Debug, Default)]
struct WordCounts {
    /// (class before, word, how often), ascending.
    entries: Vec<(u16, Syllables, u32)>,
    /// Words in all.
    num_words: u64,
    /// Level-0 words in all.
    num_nodes: u64,
}

impl TextStatistics {
    /// Counts the words of a site's texts, for chains through words of levels 0 to `max_level`.
    pub fn new(texts: &[Lattice], max_level: usize, tolerance: WordTolerance) -> Self {
        let table = |max_level| {
            [Direction::Same, Direction::Opposite]
                .map(|direction| WordCounts::new(texts, max_level, direction))
        };
        Self { tolerance, tables: (0..=max_level).map(table).collect() }
    }

    /// The worth of a chain whose later words are of the text `later`; `None` if it is not, or is empty.
    pub fn evidence(&self, chain: &Chain, later: &Lattice) -> Option<ChainEvidence> {
        let counts = &self.tables.get(usize::from(chain.max_level))?[chain.direction as usize];
        let mut bits = 0.0;
        let mut before = None;
        for (_, later_id) in &chain.pairs {
            let word = word_of(later, *later_id)?;
            bits -= counts.share(before, &self.tolerance.window(&word)).log2();
            before = Some(word.class);
        }
        // Each step back may take any of the words that end there, on both sides.
        let choices = counts.num_words as f64 / counts.num_nodes.max(1) as f64;
        let steps = chain.pairs.len().checked_sub(1)? as f64;
        let log2_paths =
            counts.log2_pairs(later, usize::from(chain.max_level)) + 2.0 * steps * choices.log2();
        Some(ChainEvidence { bits, expected_chance_matches: (log2_paths - bits).exp2() })
    }

    /// The worth of a pair of places at which no words match: chance brings as many as there are pairs of words.
    pub fn evidence_of_nothing(&self, later: &Lattice) -> ChainEvidence {
        let num_pairs = self.tables.first().map_or(0.0, |tables| tables[0].log2_pairs(later, 0).exp2());
        ChainEvidence { bits: 0.0, expected_chance_matches: num_pairs }
    }
}

impl WordCounts {
    fn new(texts: &[Lattice], max_level: usize, direction: Direction) -> Self {
        let mut words: Vec<(u16, Syllables)> = Vec::new();
        let mut num_nodes = 0;
        for text in texts {
            num_nodes += text.num_nodes() as u64;
            let class_at = |node: usize| text.word_ending_at(node, 0).map_or(NO_CLASS, |word| word.class);
            for end in 0..text.num_nodes() {
                for level in 0..=max_level {
                    let Some(word) = text.word_ending_at(end, level) else { continue };
                    let before = (end + 1).checked_sub(num_nodes_covered(level) + 1);
                    words.push(match direction {
                        Direction::Same => (before.map_or(NO_CLASS, class_at), word),
                        Direction::Opposite => (class_at(end + 1), word.reversed()),
                    });
                }
            }
        }
        words.sort_unstable();
        let num_words = words.len() as u64;
        let mut entries: Vec<(u16, Syllables, u32)> = Vec::new();
        for (before, word) in words {
            match entries.last_mut() {
                Some(last) if (last.0, last.1) == (before, word) => last.2 += 1,
                _ => entries.push((before, word, 1)),
            }
        }
        Self { entries, num_words, num_nodes }
    }

    /// log2 of the number of pairs of a word of these texts and one of `later`, of levels up to `max_level`.
    fn log2_pairs(&self, later: &Lattice, max_level: usize) -> f64 {
        let num_later = (0..=max_level).map(|level| count_words(later, level)).sum::<u64>() as f64;
        num_later.max(1.0).log2() + (self.num_words as f64).max(1.0).log2()
    }

    /// The share of words that match, among those after a class or among all; half a word more, so that it is never 0.
    fn share(&self, before: Option<u16>, window: &WordWindow) -> f64 {
        let (num_matching, num_words) = match before {
            Some(class) => self.count_after(class, window),
            None => {
                let mut sum = (0, 0);
                let mut rest = self.entries.as_slice();
                while let Some(&(class, ..)) = rest.first() {
                    let counts = self.count_after(class, window);
                    sum = (sum.0 + counts.0, sum.1 + counts.1);
                    rest = &rest[rest.partition_point(|entry| entry.0 <= class)..];
                }
                sum
            }
        };
        (num_matching as f64 + 0.5) / (num_words as f64 + 1.0)
    }

    /// Words after a class that match, and words after it in all.
    fn count_after(&self, class: u16, window: &WordWindow) -> (u64, u64) {
        let start = self.entries.partition_point(|entry| entry.0 < class);
        let after = &self.entries[start..];
        let after = &after[..after.partition_point(|entry| entry.0 == class)];
        let sum = |entries: &[(u16, Syllables, u32)]| entries.iter().map(|entry| u64::from(entry.2)).sum();
        let size_max = window.size_min.saturating_add(window.size_span);
        let from =
            after.partition_point(|entry| (entry.1.class, entry.1.size) < (window.class, window.size_min));
        let to = after.partition_point(|entry| (entry.1.class, entry.1.size) <= (window.class, size_max));
        let is_match = |entry: &&(u16, Syllables, u32)| window.contains(&entry.1);
        let num_matching = after[from..to].iter().filter(is_match).map(|entry| u64::from(entry.2)).sum();
        (num_matching, sum(after))
    }
}

fn word_of(text: &Lattice, id: WordId) -> Option<Syllables> {
    text.word_ending_at(text.end_of(id)?, usize::from(id.level))
}

fn count_words(text: &Lattice, level: usize) -> u64 {
    text.level(level).map_or(0, |columns| columns.num_words() as u64)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::super::chain_tests::random_text;
    use super::super::{MatchingConfig, Relation, find_chains};
    use super::*;

    #[test]
    fn rare_words_are_worth_more() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut words = random_text(&mut rng, 200, 3, 0);
        words[100].class = 7;
        let text = Lattice::from_words(&words).unwrap();
        let statistics = TextStatistics::new(std::slice::from_ref(&text), 0, WordTolerance::default());
        let bits_of = |index: u32| {
            let id = WordId { level: 0, index };
            let chain = Chain { pairs: vec![(id, id)], direction: Direction::Same, max_level: 0 };
            statistics.evidence(&chain, &text).unwrap().bits
        };
        assert!((bits_of(100) - (201.0f64 / 1.5).log2()).abs() < 1e-9, "only itself matches");
        assert!(bits_of(50) < 5.0);
    }

    #[test]
    fn unrelated_texts_bring_about_the_expected_number_of_chains() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for max_level in [0u8, 2] {
            let texts: Vec<Lattice> = (0..6)
                .map(|_| Lattice::from_words(&random_text(&mut rng, 150, 3, max_level)).unwrap())
                .collect();
            let statistics = TextStatistics::new(&texts, usize::from(max_level), WordTolerance::default());
            let mut min_chain_words = vec![1000; usize::from(max_level)];
            min_chain_words.push(2);
            let config = MatchingConfig { min_chain_words, ..MatchingConfig::default() };
            // Below an E-value of 1 a text meets as many chains by chance as the E-values say, to within a factor:
            // of the paths that an E-value counts only maximal ones are reported, and each text meets five others.
            let mut num_found = 0.0f64;
            for later in 0..texts.len() {
                for earlier in (0..texts.len()).filter(|&earlier| earlier != later) {
                    let chains =
                        find_chains(&texts[earlier], &texts[later], Relation::DifferentRuns, &config);
                    let evidence =
                        chains.iter().filter_map(|chain| statistics.evidence(chain, &texts[later]));
                    num_found +=
                        evidence.filter(|evidence| evidence.expected_chance_matches < 1.0).count() as f64;
                }
            }
            // Two directions for each of six texts.
            assert!(
                num_found < 2.0 * 6.0 * 5.0,
                "{num_found} chains below an E-value of 1 at level {max_level}"
            );
        }
    }
}
