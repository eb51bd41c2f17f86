//! Chains of matching words, the n-gram matches of thesis 4.2.3 and 5.2.3.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::config::MatchingConfig;
use super::rows::{Comparison, Rows, WordSearch};
use super::trace::{ChainEnd, MIN_REMEMBERED_WORDS, Tracer};
use crate::index::{Lattice, num_nodes_covered};
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

/// One search: a direction and the levels allowed.
#[derive(Clone, Debug)]
struct Pass {
    direction: Direction,
    max_level: usize,
    min_words: u32,
    rows: Rows,
    /// Where chains end that are worth remembering, ascending.
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
                let (min_words, rows) = (u32::from(min_words), Rows::new(max_level));
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
            while pass.ends.last().is_some_and(|end| end.at.0 >= pass.rows.next_node()) {
                pass.ends.pop();
            }
        }
        // All passes of a direction have come equally far and compare with the same words.
        for passes in self.passes.chunk_by_mut(|a, b| a.direction == b.direction) {
            let texts = comparison(&self.config, self.relation, passes[0].direction, earlier, later);
            let mut search = WordSearch::default();
            for node in passes[0].rows.next_node()..later.num_nodes() {
                fill_rows(&texts, node, passes, &mut search);
            }
        }
    }

    /// The maximal chains so far: the longest one for each pair of nodes at which none can be continued, in order of
    /// direction, levels and where they end.
    pub fn chains(&self, earlier: &Lattice, later: &Lattice) -> Vec<Chain> {
        let mut chains: Vec<Chain> = Vec::new();
        let max_level = self.config.min_chain_words.len().saturating_sub(1);
        for passes in self.passes.chunk_by(|a, b| a.direction == b.direction) {
            let texts = comparison(&self.config, self.relation, passes[0].direction, earlier, later);
            let windows: Vec<_> = (0..later.num_nodes()).map(|node| texts.windows(node, max_level)).collect();
            let mut known = BTreeSet::new();
            for pass in passes {
                let tracer = Tracer::new(&texts, &windows, &pass.ends, pass.max_level);
                let is_long = |end: &&ChainEnd| end.num_words >= pass.min_words;
                for end in pass.ends.iter().filter(is_long).filter(|end| !tracer.continues(end.at)) {
                    let pairs = tracer.trace(end);
                    if known.insert(pairs.clone()) {
                        chains.push(Chain {
                            pairs,
                            direction: pass.direction,
                            max_level: pass.max_level as u8,
                        });
                    }
                }
            }
        }
        chains
    }
}

/// Fills the next row of all passes of a direction: each pair of words is compared once, whatever the number of passes
/// that may use it.
fn fill_rows(texts: &Comparison, node: usize, passes: &mut [Pass], search: &mut WordSearch) {
    let max_level = passes.iter().map(|pass| pass.max_level).max().unwrap_or(0);
    passes.iter_mut().for_each(|pass| pass.rows.begin_row());
    for (later_level, window) in texts.windows(node, max_level).iter().enumerate() {
        let Some(window) = window else { continue };
        let num_allowed = texts.num_allowed_nodes(node + 1 - num_nodes_covered(later_level));
        for earlier_level in 0..=max_level {
            let ends = search.matching_ends(texts.earlier, earlier_level, window, num_allowed);
            for pass in passes.iter_mut().filter(|pass| pass.max_level >= later_level.max(earlier_level)) {
                pass.rows.extend_by(texts.direction, ends, later_level, earlier_level);
            }
        }
    }
    for pass in passes {
        let long = pass.rows.ends_of_at_least(pass.min_words.min(MIN_REMEMBERED_WORDS));
        pass.ends
            .extend(long.into_iter().map(|(column, num_words)| ChainEnd { at: (node, column), num_words }));
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
