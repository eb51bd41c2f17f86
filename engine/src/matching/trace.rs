//! The way back along a chain: which words it has, once it is known where it ends.
//!
//! Pairs of words are many and long chains few, so the dynamic programme remembers where chains of some words end and
//! how long they are, but no pointers. The way back looks for a matching pair with a chain before it that is one word
//! shorter; the first few words, whose chains nobody remembers, are found by trying.

use super::rows::Comparison;
use crate::index::{WordWindow, num_nodes_covered};
use crate::text::WordId;

/// Chains shorter than this are not remembered but tried.
pub(super) const MIN_REMEMBERED_WORDS: u32 = 3;

/// A node of the later text and a column of the earlier one.
type NodePair = (usize, usize);

/// Levels of a pair of words, (later, earlier).
type Levels = (usize, usize);

/// A pair of nodes at which a chain ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ChainEnd {
    /// Where.
    pub at: NodePair,
    /// L: words of the longest chain that ends there.
    pub num_words: u32,
}

/// Reads off chains of one search.
pub(super) struct Tracer<'a> {
    texts: &'a Comparison<'a>,
    windows: &'a [Vec<Option<WordWindow>>],
    ends: &'a [ChainEnd],
    /// Lowest first.
    levels: Vec<Levels>,
}

impl<'a> Tracer<'a> {
    /// `windows` is what matches the later text's words ([`Comparison::windows`]), by node; `ends` is where all chains
    /// of [`MIN_REMEMBERED_WORDS`] or more words end, ascending.
    pub fn new(
        texts: &'a Comparison,
        windows: &'a [Vec<Option<WordWindow>>],
        ends: &'a [ChainEnd],
        max_level: usize,
    ) -> Self {
        let pairs = (0..=max_level).flat_map(|later| (0..=max_level).map(move |earlier| (later, earlier)));
        let mut levels: Vec<Levels> = pairs.collect();
        levels.sort_by_key(|&(later, earlier)| (later + earlier, later));
        Self { texts, windows, ends, levels }
    }

    /// Whether some pair of matching words follows the end of a chain.
    pub fn continues(&self, (node, column): NodePair) -> bool {
        self.levels.iter().any(|&(later_level, earlier_level)| {
            let next = self.texts.earlier_next(column, earlier_level);
            let node = node + num_nodes_covered(later_level);
            next.is_some_and(|column| self.is_match((node, column), (later_level, earlier_level)))
        })
    }

    /// The words of the longest chain with an end, (earlier, later), preferring lower levels where chains are equally
    /// long.
    pub fn trace(&self, end: &ChainEnd) -> Vec<(WordId, WordId)> {
        let mut pairs = Vec::with_capacity(end.num_words as usize);
        let mut here = Some(end.at);
        for num_words in (1..=end.num_words).rev() {
            let Some((node, column)) = here else { break };
            let is_last = |levels: &&Levels| self.has_chain_by((node, column), **levels, num_words);
            let Some(&(later_level, earlier_level)) = self.levels.iter().find(is_last) else { break };
            let earlier_end = self.texts.earlier_end(column, earlier_level);
            let earlier_id = self.texts.earlier.id_ending_at(earlier_end, earlier_level);
            pairs.extend(earlier_id.zip(self.texts.later.id_ending_at(node, later_level)));
            here = self.before((node, column), (later_level, earlier_level));
        }
        pairs.reverse();
        pairs
    }

    /// Whether a chain of at least `num_words` words ends here with a pair of words of these levels.
    fn has_chain_by(&self, here: NodePair, levels: Levels, num_words: u32) -> bool {
        self.is_match(here, levels)
            && (num_words == 1
                || self.before(here, levels).is_some_and(|before| self.has_chain(before, num_words - 1)))
    }

    fn has_chain(&self, here: NodePair, num_words: u32) -> bool {
        if num_words < MIN_REMEMBERED_WORDS {
            return self.levels.iter().any(|&levels| self.has_chain_by(here, levels, num_words));
        }
        let place = self.ends.binary_search_by_key(&here, |end| end.at);
        place.is_ok_and(|place| self.ends[place].num_words >= num_words)
    }

    /// The pair of nodes before the first of a pair of words, if both texts go back that far.
    fn before(&self, (node, column): NodePair, (later_level, earlier_level): Levels) -> Option<NodePair> {
        let node = node.checked_sub(num_nodes_covered(later_level));
        node.zip(self.texts.earlier_previous(column, earlier_level))
    }

    fn is_match(&self, (node, column): NodePair, (later_level, earlier_level): Levels) -> bool {
        let window = self.windows.get(node).and_then(|windows| windows.get(later_level)?.as_ref());
        let Some(window) = window else { return false };
        let earlier_end = self.texts.earlier_end(column, earlier_level);
        earlier_end < self.texts.num_allowed_nodes(node + 1 - num_nodes_covered(later_level))
            && self
                .texts
                .earlier
                .word_ending_at(earlier_end, earlier_level)
                .is_some_and(|word| window.contains(&word))
    }
}
