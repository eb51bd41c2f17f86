//! The dynamic programme behind n-gram matching (Algorithm 5.3 as SPEC 3.10 decides it).
//!
//! L(i, j) is the number of words of the longest chain of matching words that ends with the pair (i, j):
//! L(i, j) = 1 + max L(p, q) over the predecessors p of i and q of j, and 0 when i and j do not match. All words that
//! end at one node have the same successors, so it is enough to keep, per pair of nodes, the best over the words that
//! end there. A row holds these for one node of the later text against all nodes of the earlier one, and a word of
//! level l reaches the rows l + 2 above. Read backwards, an earlier word is entered at its last node and left at its
//! first one; its column is then its first node and the shift goes the other way.
//!
//! A row costs a few vector instructions per eight pairs of words and keeps no pointers: a found chain is traced by
//! filling a small block of rows again.

use std::collections::VecDeque;
use std::ops::Range;

use crate::index::{Lattice, LevelColumns, Syllables, WordTolerance, WordWindow, num_nodes_covered};
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

/// Rows of L over a range of columns, the newest last.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    max_level: usize,
    num_kept: usize,
    first_column: usize,
    num_columns: usize,
    next_node: usize,
    rows: VecDeque<Vec<i16>>,
    blank: Vec<i16>,
}

impl Rows {
    /// No rows yet: the first will be that of `first_node`. At most `num_kept` rows are remembered, and no fewer than
    /// the longest word reaches back.
    pub fn new(max_level: usize, first_node: usize, columns: Range<usize>, num_kept: usize) -> Self {
        let padding = num_nodes_covered(max_level);
        Self {
            max_level,
            num_kept: num_kept.max(padding + 1),
            first_column: columns.start,
            num_columns: columns.len(),
            next_node: first_node,
            rows: VecDeque::new(),
            blank: vec![0; columns.len() + 2 * padding],
        }
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
        let num_columns = num_columns.max(self.num_columns);
        let length = num_columns + 2 * self.padding();
        self.rows.iter_mut().for_each(|row| row.resize(length, 0));
        self.blank.resize(length, 0);
        self.num_columns = num_columns;
    }

    /// L at a node of the later text, one value per column; `None` when that row is not remembered.
    pub fn row(&self, node: usize) -> Option<&[i16]> {
        let padding = self.padding();
        self.padded_row(node).map(|row| &row[padding..padding + self.num_columns])
    }

    /// Fills the row of the next node, given what matches the words that end there ([`Comparison::windows`]); returns
    /// the longest chain in it.
    pub fn push(&mut self, texts: &Comparison, windows: &[Option<WordWindow>]) -> i16 {
        let node = self.next_node;
        let mut longest = 0;
        let mut row = if self.rows.len() >= self.num_kept { self.rows.pop_front() } else { None }
            .unwrap_or_else(|| self.blank.clone());
        row.fill(0);
        for (later_level, window) in windows.iter().take(self.max_level + 1).enumerate() {
            let Some(window) = window else { continue };
            let covered = num_nodes_covered(later_level);
            let num_allowed = texts.num_allowed_nodes(node + 1 - covered);
            let previous = node.checked_sub(covered).and_then(|previous| self.padded_row(previous));
            let previous = previous.unwrap_or(&self.blank);
            for earlier_level in 0..=self.max_level {
                let Some(words) = texts.earlier.level(earlier_level) else { continue };
                let longest_here = self.extend_by(
                    texts.direction,
                    (words, earlier_level),
                    window,
                    num_allowed,
                    (previous, &mut row),
                );
                longest = longest_here.max(longest);
            }
        }
        self.rows.push_back(row);
        self.next_node += 1;
        longest
    }

    fn padding(&self) -> usize {
        num_nodes_covered(self.max_level)
    }

    fn padded_row(&self, node: usize) -> Option<&Vec<i16>> {
        let age = self.next_node.checked_sub(node + 1)?;
        self.rows.len().checked_sub(age + 1).map(|position| &self.rows[position])
    }

    /// Lets one word of the later text extend all chains by words of one level of the earlier text; returns the
    /// longest chain in the row.
    fn extend_by(
        &self,
        direction: Direction,
        (words, level): (&LevelColumns, usize),
        window: &WordWindow,
        num_allowed: usize,
        (previous, row): (&[i16], &mut [i16]),
    ) -> i16 {
        let covered = num_nodes_covered(level);
        let end_of_first = match direction {
            Direction::Same => self.first_column,
            Direction::Opposite => self.first_column + covered - 1,
        };
        let end_of_last = (end_of_first + self.num_columns).min(num_allowed);
        let Some(length) = end_of_last.checked_sub(end_of_first) else { return 0 };
        let padding = self.padding();
        let previous_start = match direction {
            Direction::Same => padding - covered,
            Direction::Opposite => padding + covered,
        };
        let row = &mut row[padding..padding + length];
        let previous = &previous[previous_start..previous_start + length];
        if level == 0 {
            let words = words.by_node.slice(end_of_first..end_of_last);
            return extend_chains(row, previous, words, window);
        }
        // Alternative words end at few nodes.
        let first_word = words.ends.partition_point(|&end| (end as usize) < end_of_first);
        let last_word = words.ends.partition_point(|&end| (end as usize) < end_of_last);
        let ends = &words.ends[first_word..last_word];
        let mut longest = 0;
        let (class, size, turn) = words.in_row.slice(first_word..last_word);
        for (((&end, &class), &size), &turn) in ends.iter().zip(class).zip(size).zip(turn) {
            if class == window.class && window.contains(&Syllables { class, size, turn }) {
                let column = end as usize - end_of_first;
                row[column] = previous[column].saturating_add(1).max(row[column]);
                longest = row[column].max(longest);
            }
        }
        longest
    }
}

/// Classes, sizes and turns of words.
type Columns<'a> = (&'a [u16], &'a [u16], &'a [i16]);

/// Words compared at once: two vector registers of every processor that this is built for.
const LANES: usize = 16;

/// One word against a column of words: where they match, a chain grows by one. All slices have the same length.
/// Returns the longest chain in the row.
///
/// Kept out of its caller, whose variables would take the registers that the window should stay in.
#[inline(never)]
fn extend_chains(
    row: &mut [i16],
    previous: &[i16],
    (class, size, turn): Columns,
    window: &WordWindow,
) -> i16 {
    let mut longest = [0; LANES];
    let (rows, row_rest) = row.as_chunks_mut::<LANES>();
    let (befores, before_rest) = previous.as_chunks::<LANES>();
    let (classes, class_rest) = class.as_chunks::<LANES>();
    let (sizes, size_rest) = size.as_chunks::<LANES>();
    let (turns, turn_rest) = turn.as_chunks::<LANES>();
    let words = classes.iter().zip(sizes).zip(turns);
    for ((row, before), ((class, size), turn)) in rows.iter_mut().zip(befores).zip(words) {
        for lane in 0..LANES {
            row[lane] = extended(row[lane], before[lane], (class[lane], size[lane], turn[lane]), window);
            longest[lane] = row[lane].max(longest[lane]);
        }
    }
    let words = class_rest.iter().zip(size_rest).zip(turn_rest);
    for ((length, &before), ((&class, &size), &turn)) in row_rest.iter_mut().zip(before_rest).zip(words) {
        *length = extended(*length, before, (class, size, turn), window);
        longest[0] = longest[0].max(*length);
    }
    longest.into_iter().fold(0, i16::max)
}

/// The chain length at a pair of words: that before it and one more where the words match, if that is longer.
///
/// Arithmetic on masks instead of conditions, because a condition would be compiled to a jump and the loop around it
/// would no longer be vector code.
#[inline(always)]
fn extended(length: i16, before: i16, (class, size, turn): (u16, u16, i16), window: &WordWindow) -> i16 {
    let off_class = class ^ window.class;
    let off_size = size.wrapping_sub(window.size_min).saturating_sub(window.size_span);
    let off_turn = (turn.wrapping_sub(window.turn_min) as u16).saturating_sub(window.turn_span);
    let mask = -i16::from(off_class | off_size | off_turn == 0);
    (before.saturating_add(1) & mask).max(length)
}
