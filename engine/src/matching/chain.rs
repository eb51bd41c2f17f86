//! Chains of matching words, the n-gram matches of thesis 4.2.3 and 5.2.3.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::config::MatchingConfig;
use super::rows::{Comparison, Rows};
use crate::index::{Lattice, WordWindow, num_nodes_covered};
use crate::text::{Direction, WordId};

/// A maximal n-gram match: words of two texts that match pair by pair along predecessor links (Eq 5.2).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Chain {
    /// (word of the earlier text, word of the later text), in the order in which the later text was driven.
    pub pairs: Vec<(WordId, WordId)>,
    /// Which way the earlier text was read.
    pub direction: Direction,
    /// The lowest number of levels that had to be searched to find it: 0 when level-0 words suffice.
    pub max_level: u8,
}

/// How two texts are related.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// Different runs: any two words may match.
    DifferentRuns,
    /// One run against itself: matched words are separated by the configured gap.
    SameRun,
}

/// A pair of nodes at which a chain of enough words ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ChainEnd {
    later_node: usize,
    earlier_column: usize,
    num_words: i16,
}

/// One search: a direction and the levels allowed.
#[derive(Clone, Debug)]
struct Pass {
    direction: Direction,
    max_level: usize,
    min_words: i16,
    rows: Rows,
    ends: Vec<ChainEnd>,
}

/// Finds chains between two texts while the later one grows: each new word costs one row of comparisons with the
/// whole earlier text.
///
/// The earlier text is complete, or is the same run and grows with the later one.
#[derive(Clone, Debug)]
pub struct ChainFinder {
    config: MatchingConfig,
    relation: Relation,
    passes: Vec<Pass>,
}

/// All maximal chains between two texts, both directions, each level by its threshold; lower levels keep what higher
/// ones would replace (thesis 5.2.3).
pub fn find_chains(
    earlier: &Lattice,
    later: &Lattice,
    relation: Relation,
    config: &MatchingConfig,
) -> Vec<Chain> {
    let mut finder = ChainFinder::new(relation, config.clone());
    finder.extend(earlier, later);
    finder.chains(earlier, later)
}

/// All maximal chains between each of several texts of other runs and a later one, with the number of the text:
/// what [`find_chains`] finds one by one. Short texts are compared as one long text, which costs far less.
pub fn find_chains_in(texts: &[&Lattice], later: &Lattice, config: &MatchingConfig) -> Vec<(usize, Chain)> {
    let joined = Lattice::joined(texts);
    // Where each text begins; empty texts have a node of their own to stand behind.
    let mut starts = Vec::with_capacity(texts.len());
    let mut next = 0;
    for text in texts {
        let start = if next == 0 { 0 } else { next + 1 };
        starts.push(start);
        next = start + text.num_nodes();
    }
    let in_text = |id: WordId| {
        let end = joined.end_of(id)?;
        let text = starts.partition_point(|&start| start <= end).checked_sub(1)?;
        Some((text, texts[text].id_ending_at(end - starts[text], usize::from(id.level))?))
    };
    let mut chains = Vec::new();
    for mut chain in find_chains(&joined, later, Relation::DifferentRuns, config) {
        let mut text_idx = None;
        for (earlier, _) in &mut chain.pairs {
            let Some((text, id)) = in_text(*earlier) else { continue };
            (text_idx, *earlier) = (Some(text), id);
        }
        chains.extend(text_idx.map(|text| (text, chain)));
    }
    chains.sort_by_key(|found| found.0);
    chains
}

impl ChainFinder {
    /// Nothing compared yet.
    pub fn new(relation: Relation, config: MatchingConfig) -> Self {
        let mut passes = Vec::new();
        for direction in [Direction::Same, Direction::Opposite] {
            for (max_level, &min_words) in config.min_chain_words.iter().enumerate() {
                let min_words = i16::try_from(min_words).unwrap_or(i16::MAX);
                let rows = Rows::new(max_level, 0, 0..0, 0);
                passes.push(Pass { direction, max_level, min_words, rows, ends: Vec::new() });
            }
        }
        Self { config, relation, passes }
    }

    /// Compares the words that the later text has gained since the last call.
    ///
    /// Alternative words that end at a node become known with the node after it, so the newest row is filled again.
    pub fn extend(&mut self, earlier: &Lattice, later: &Lattice) {
        for pass in &mut self.passes {
            pass.rows.grow_columns(earlier.num_nodes());
            pass.rows.pop();
            while pass.ends.last().is_some_and(|end| end.later_node >= pass.rows.next_node()) {
                pass.ends.pop();
            }
        }
        // All passes of a direction have come equally far and compare with the same words.
        let max_level = self.config.min_chain_words.len().saturating_sub(1);
        for passes in self.passes.chunk_by_mut(|a, b| a.direction == b.direction) {
            let texts = comparison(&self.config, self.relation, passes[0].direction, earlier, later);
            for node in passes[0].rows.next_node()..later.num_nodes() {
                let windows = texts.windows(node, max_level);
                passes.iter_mut().for_each(|pass| pass.extend(&texts, &windows));
            }
        }
    }

    /// The maximal chains so far: the longest one for each pair of nodes at which none can be continued, in order of
    /// direction, levels and where they end.
    pub fn chains(&self, earlier: &Lattice, later: &Lattice) -> Vec<Chain> {
        let mut chains: Vec<Chain> = Vec::new();
        let mut known = BTreeSet::new();
        let max_level = self.config.min_chain_words.len().saturating_sub(1);
        for passes in self.passes.chunk_by(|a, b| a.direction == b.direction) {
            if passes.iter().all(|pass| pass.ends.is_empty()) {
                continue;
            }
            let texts = comparison(&self.config, self.relation, passes[0].direction, earlier, later);
            let windows: Vec<_> = (0..later.num_nodes()).map(|node| texts.windows(node, max_level)).collect();
            for pass in passes {
                let ends = pass.ends.iter().filter(|end| !continues(&texts, pass.max_level, end));
                for chain in ends.map(|end| trace(&texts, &windows, pass.max_level, end)) {
                    if known.insert((chain.direction, chain.pairs.clone())) {
                        chains.push(chain);
                    }
                }
            }
        }
        chains
    }
}

impl Pass {
    /// Fills the next row and remembers where long chains end in it.
    fn extend(&mut self, texts: &Comparison, windows: &[Option<WordWindow>]) {
        let later_node = self.rows.next_node();
        if self.rows.push(texts, windows) < self.min_words {
            return;
        }
        for (earlier_column, &num_words) in self.rows.row(later_node).unwrap_or_default().iter().enumerate() {
            if num_words >= self.min_words {
                self.ends.push(ChainEnd { later_node, earlier_column, num_words });
            }
        }
    }
}

fn comparison<'a>(
    config: &MatchingConfig,
    relation: Relation,
    direction: Direction,
    earlier: &'a Lattice,
    later: &'a Lattice,
) -> Comparison<'a> {
    let gap_observations = (relation == Relation::SameRun).then_some(config.min_gap_observations);
    Comparison { earlier, later, direction, tolerance: config.tolerance, gap_observations }
}

/// Whether some pair of matching words follows the end of a chain.
fn continues(texts: &Comparison, max_level: usize, end: &ChainEnd) -> bool {
    (0..=max_level).any(|later_level| {
        let node = end.later_node + num_nodes_covered(later_level);
        (0..=max_level).any(|earlier_level| {
            texts
                .earlier_next(end.earlier_column, earlier_level)
                .is_some_and(|column| is_match(texts, (node, later_level), (column, earlier_level)))
        })
    })
}

fn is_match(
    texts: &Comparison,
    (node, later_level): (usize, usize),
    (column, earlier_level): (usize, usize),
) -> bool {
    let Some(window) = texts.window(node, later_level) else { return false };
    let earlier_end = texts.earlier_end(column, earlier_level);
    earlier_end < texts.num_allowed_nodes(node + 1 - num_nodes_covered(later_level))
        && texts.earlier.word_ending_at(earlier_end, earlier_level).is_some_and(|word| window.contains(&word))
}

/// Reads off the longest chain that ends at a pair of nodes, preferring lower levels where chains are equally long.
fn trace(texts: &Comparison, windows: &[Vec<Option<WordWindow>>], max_level: usize, end: &ChainEnd) -> Chain {
    let block = rows_around(texts, windows, max_level, end);
    let mut pairs = Vec::with_capacity(end.num_words as usize);
    let (mut node, mut column, mut remaining) = (end.later_node, end.earlier_column, end.num_words);
    while remaining > 0 {
        let Some((later_level, earlier_level)) = block.last_pair(texts, (node, column), remaining) else {
            break;
        };
        let earlier_end = texts.earlier_end(column, earlier_level);
        let earlier_id = texts.earlier.id_ending_at(earlier_end, earlier_level);
        let later_id = texts.later.id_ending_at(node, later_level);
        pairs.extend(earlier_id.zip(later_id));
        remaining -= 1;
        if remaining > 0 {
            // A chain with words left has predecessors on both sides.
            node -= num_nodes_covered(later_level);
            column = texts.earlier_previous(column, earlier_level).unwrap_or(column);
        }
    }
    pairs.reverse();
    Chain { pairs, direction: texts.direction, max_level: max_level as u8 }
}

/// A block of rows that contains a whole chain.
struct Block {
    rows: Rows,
    first_column: usize,
    max_level: usize,
}

/// Fills rows again around the end of a chain, in a window that grows until it holds a chain of the known length.
fn rows_around(
    texts: &Comparison,
    windows: &[Vec<Option<WordWindow>>],
    max_level: usize,
    end: &ChainEnd,
) -> Block {
    let mut reach = end.num_words as usize + num_nodes_covered(max_level);
    loop {
        let first_node = end.later_node.saturating_sub(reach);
        let columns = match texts.direction {
            Direction::Same => end.earlier_column.saturating_sub(reach)..end.earlier_column + 1,
            Direction::Opposite => {
                end.earlier_column..(end.earlier_column + reach + 1).min(texts.earlier.num_nodes())
            }
        };
        let first_column = columns.start;
        let mut rows = Rows::new(max_level, first_node, columns, reach + 1);
        while rows.next_node() <= end.later_node {
            rows.push(texts, &windows[rows.next_node()]);
        }
        let block = Block { rows, first_column, max_level };
        let is_whole = reach >= texts.later.num_nodes().max(texts.earlier.num_nodes());
        if is_whole || block.length_at(end.later_node, end.earlier_column) >= end.num_words {
            return block;
        }
        reach *= 2;
    }
}

impl Block {
    fn length_at(&self, node: usize, column: usize) -> i16 {
        let row = self.rows.row(node);
        let value = column.checked_sub(self.first_column).and_then(|offset| row?.get(offset));
        value.copied().unwrap_or(0)
    }

    /// The levels of the last pair of a chain of `num_words` that ends at (node, column), lowest first.
    fn last_pair(
        &self,
        texts: &Comparison,
        (node, column): (usize, usize),
        num_words: i16,
    ) -> Option<(usize, usize)> {
        let levels = (0..=self.max_level).flat_map(|sum| (0..=sum).map(move |later| (later, sum - later)));
        let higher = (self.max_level + 1..=2 * self.max_level)
            .flat_map(|sum| (sum - self.max_level..=self.max_level).map(move |later| (later, sum - later)));
        levels.chain(higher).find(|&(later_level, earlier_level)| {
            let before = node
                .checked_sub(num_nodes_covered(later_level))
                .zip(texts.earlier_previous(column, earlier_level))
                .map_or(0, |(node, column)| self.length_at(node, column));
            before == num_words - 1 && is_match(texts, (node, later_level), (column, earlier_level))
        })
    }
}
