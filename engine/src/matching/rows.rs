//! The dynamic programme behind n-gram matching (Algorithm 5.3 as SPEC 3.10 decides it).
//!
//! L(i, j) is the number of words of the longest chain of matching words that ends with the pair (i, j):
//! L(i, j) = 1 + max L(p, q) over the predecessors p of i and q of j, and 0 when i and j do not match. All words that
//! end at one node have the same successors, so it is enough to keep, per pair of nodes, the best over the words that
//! end there. A row holds these for one node of the later text against all nodes of the earlier one, and a word of
//! level l reaches the rows l + 2 above. Read backwards, an earlier word is entered at its last node and left at its
//! first one; its column is then its first node and the shift goes the other way.
//!
//! Two words can only match within one class, and words without a match leave nothing behind. So a word is compared
//! with the words of its class, which stand in a row, and a row remembers which of its entries are not 0. No pointers
//! are kept: [`super::trace`] finds the way back when a chain is wanted.

use std::collections::VecDeque;

use crate::index::{Lattice, WordTolerance, WordWindow, num_nodes_covered};
use crate::text::Direction;

/// What a dynamic programme compares.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison<'a> {
    /// The text that is searched, the columns.
    pub earlier: &'a Lattice,
    /// The text that searches, the rows.
    pub later: &'a Lattice,
    /// Which way the earlier text is read.
    pub direction: Direction,
    /// When two words match.
    pub tolerance: WordTolerance,
    /// Both texts are the same run and matched words lie at least this many observations apart.
    pub gap_observations: Option<u32>,
}

impl Comparison<'_> {
    /// Number of leading nodes of the earlier text at which a word may end that matches a word of the later text
    /// beginning at `later_node`.
    pub fn num_allowed_nodes(&self, later_node: usize) -> usize {
        let Some(gap) = self.gap_observations else { return self.earlier.num_nodes() };
        let (first, _) = self.later.observations(later_node, later_node);
        first.checked_sub(gap).map_or(0, |limit| self.earlier.num_nodes_before(limit))
    }

    /// What matches the later text's word of `level` that ends at `node`.
    pub fn window(&self, node: usize, level: usize) -> Option<WordWindow> {
        let word = self.later.word_ending_at(node, level)?;
        let as_read = match self.direction {
            Direction::Same => word,
            Direction::Opposite => word.reversed(),
        };
        Some(self.tolerance.window(&as_read))
    }

    /// What matches the later text's words that end at `node`, level by level.
    pub fn windows(&self, node: usize, max_level: usize) -> Vec<Option<WordWindow>> {
        (0..=max_level).map(|level| self.window(node, level)).collect()
    }

    /// The node at which the earlier text's word of `level` ends whose column is `column`.
    pub fn earlier_end(&self, column: usize, level: usize) -> usize {
        match self.direction {
            Direction::Same => column,
            Direction::Opposite => column + num_nodes_covered(level) - 1,
        }
    }

    /// The column of the predecessors of a word of `level` in `column`, if the text goes that far.
    pub fn earlier_previous(&self, column: usize, level: usize) -> Option<usize> {
        let covered = num_nodes_covered(level);
        match self.direction {
            Direction::Same => column.checked_sub(covered),
            Direction::Opposite => (column + covered < self.earlier.num_nodes()).then_some(column + covered),
        }
    }

    /// The column of a word of `level` whose predecessors are in `column`.
    pub fn earlier_next(&self, column: usize, level: usize) -> Option<usize> {
        let covered = num_nodes_covered(level);
        match self.direction {
            Direction::Same => (column + covered < self.earlier.num_nodes()).then_some(column + covered),
            Direction::Opposite => column.checked_sub(covered),
        }
    }
}

/// The last rows of L, as many as the longest word reaches back.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    padding: usize,
    num_columns: usize,
    next_node: usize,
    rows: VecDeque<Row>,
}

/// L at one node of the later text.
#[derive(Clone, Debug, Default)]
struct Row {
    /// One value per column and as many zeros at both ends as the longest word reaches.
    lengths: Vec<u32>,
    /// Where they are not 0, in no order.
    filled: Vec<u32>,
}

impl Rows {
    /// No rows yet: the first will be that of node 0.
    pub fn new(max_level: usize) -> Self {
        Self { padding: num_nodes_covered(max_level), num_columns: 0, next_node: 0, rows: VecDeque::new() }
    }

    /// The node whose row comes next.
    pub fn next_node(&self) -> usize {
        self.next_node
    }

    /// Forgets the newest row, so that it is filled again.
    pub fn pop(&mut self) {
        if self.rows.pop_back().is_some() {
            self.next_node -= 1;
        }
    }

    /// Makes room for an earlier text that has grown at its end.
    pub fn grow_columns(&mut self, num_columns: usize) {
        self.num_columns = num_columns.max(self.num_columns);
        let length = self.num_columns + 2 * self.padding;
        self.rows.iter_mut().for_each(|row| row.lengths.resize(length, 0));
    }

    /// Begins the row of the next node, without any chain.
    pub fn begin_row(&mut self) {
        let oldest = if self.rows.len() > self.padding { self.rows.pop_front() } else { None };
        let mut row = oldest.unwrap_or_default();
        row.filled.drain(..).for_each(|place| row.lengths[place as usize] = 0);
        row.lengths.resize(self.num_columns + 2 * self.padding, 0);
        self.rows.push_back(row);
        self.next_node += 1;
    }

    /// Lets a word of `later_level` that ends at the newest row's node extend all chains by words of `earlier_level`
    /// that match it and end at the nodes `ends`.
    pub fn extend_by(
        &mut self,
        direction: Direction,
        ends: &[u32],
        later_level: usize,
        earlier_level: usize,
    ) {
        let Some(mut row) = self.rows.pop_back() else { return };
        let covered = num_nodes_covered(earlier_level);
        let (column_of_first, previous_of_first) = match direction {
            Direction::Same => (self.padding, self.padding - covered),
            Direction::Opposite => (self.padding + 1 - covered, self.padding + 1),
        };
        // The newest row is taken out, so the row before it is now the last.
        let previous = self.rows.len().checked_sub(num_nodes_covered(later_level));
        let previous = previous.map_or(&[][..], |idx| &self.rows[idx].lengths);
        for &end in ends {
            let before = previous.get(end as usize + previous_of_first).copied().unwrap_or(0);
            let place = end as usize + column_of_first;
            let length = &mut row.lengths[place];
            if *length == 0 {
                row.filled.push(place as u32);
            }
            *length = (before + 1).max(*length);
        }
        self.rows.push_back(row);
    }

    /// Columns of the newest row at which chains of at least `min_words` words end, and their words; ascending.
    pub fn ends_of_at_least(&self, min_words: u32) -> Vec<(usize, u32)> {
        let Some(row) = self.rows.back() else { return Vec::new() };
        let lengths = row.filled.iter().map(|&place| (place as usize, row.lengths[place as usize]));
        let long = lengths.filter(|&(_, length)| length >= min_words);
        let mut ends: Vec<_> = long.map(|(place, length)| (place - self.padding, length)).collect();
        ends.sort_unstable();
        ends
    }
}

/// Finds the words of the earlier text that lie in a window; keeps its memory from one search to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct WordSearch {
    /// 1 for each word that matches, else 0.
    is_match: Vec<u8>,
    ends: Vec<u32>,
}

impl WordSearch {
    /// The nodes at which the matching words of a level end, ascending; only words that end at the first
    /// `num_allowed` nodes count.
    pub fn matching_ends(
        &mut self,
        earlier: &Lattice,
        level: usize,
        window: &WordWindow,
        num_allowed: usize,
    ) -> &[u32] {
        self.is_match.clear();
        self.ends.clear();
        let Some(words) = earlier.level(level).and_then(|words| words.of_class(window.class)) else {
            return &[];
        };
        let num_words = words.ends.partition_point(|&end| (end as usize) < num_allowed);
        let ends = &words.ends[..num_words];
        // First all comparisons, which become vector code, then the few words that match, eight at a look.
        let syllables = words.size[..num_words].iter().zip(&words.turn[..num_words]);
        self.is_match.extend(syllables.map(|(&size, &turn)| u8::from(window.contains_of_class(size, turn))));
        let (groups, rest) = self.is_match.as_chunks::<8>();
        for (group, ends) in groups.iter().zip(ends.chunks_exact(8)) {
            let mut matches = u64::from_le_bytes(*group);
            while matches != 0 {
                self.ends.push(ends[matches.trailing_zeros() as usize / 8]);
                matches &= matches - 1;
            }
        }
        let rest = rest.iter().zip(&ends[num_words - rest.len()..]);
        self.ends.extend(rest.filter(|(is_match, _)| **is_match != 0).map(|(_, &end)| end));
        &self.ends
    }
}
