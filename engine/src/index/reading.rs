//! Reading a stretch of an indexed text word by word, once a question has found it.

use super::lattice::num_nodes_covered;
use super::occurrence::OccurrenceIndex;
use super::tolerance::Syllables;
use crate::text::Interval;

/// The words of a stretch of text, of all levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextReading {
    /// Number of its first level-0 word within the run.
    pub first_node: u32,
    /// Number of its level-0 words.
    pub num_nodes: usize,
    /// All words that lie within it, in order of where they end.
    pub words: Vec<ReadWord>,
}

/// A word of a stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadWord {
    /// The first level-0 word it covers, counted from the beginning of the stretch.
    pub start: usize,
    /// The level-0 word behind its last one, likewise.
    pub end: usize,
    /// The word.
    pub syllables: Syllables,
}

impl OccurrenceIndex {
    /// The words of a stretch; `None` for a run that is not in the index. Costs a binary search in the run.
    pub fn read(&self, stretch: &Interval) -> Option<TextReading> {
        let range = self.run_range(stretch.run_idx as usize)?;
        // Words stand in the order in which they end.
        let words = &self.words[range.clone()];
        let first = range.start + words.partition_point(|word| word.last_observation() < stretch.first);
        let last = range.start + words.partition_point(|word| word.last_observation() <= stretch.last);
        let first_node = self.num_nodes_before(first) - self.num_nodes_before(range.start);
        let mut reading = TextReading { first_node: first_node as u32, num_nodes: 0, words: Vec::new() };
        for word in &self.words[first..last.max(first)] {
            reading.num_nodes += usize::from(word.is_node());
            let end = reading.num_nodes;
            let start = end.checked_sub(num_nodes_covered(word.level()));
            reading.words.extend(start.map(|start| ReadWord { start, end, syllables: word.syllables() }));
        }
        Some(reading)
    }

    /// A run's text as bytes to be stored, as [`super::store_words`] writes it; empty for an unknown run.
    pub fn stored_run(&self, run_idx: usize) -> Vec<u8> {
        let range = self.run_range(run_idx).unwrap_or_default();
        self.words[range].iter().flat_map(|word| word.to_stored()).collect()
    }
}
