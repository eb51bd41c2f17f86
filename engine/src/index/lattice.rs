//! A text with its alternative words, arranged for matching.
//!
//! Level-0 words stand in a row; call them nodes 0, 1, 2, … An alternative word of level l covers l + 2 of them. All
//! words that may stand before a word are those that end at the node before its first (Algorithm 5.2 builds exactly
//! these predecessors), so a text is a set of columns, one per level, indexed by the node a word ends at:
//!
//! ```text
//! node       0   1   2   3   4
//! level 0    A   B   C   B   A
//! level 1            .   B'  .      B' covers nodes 1..=3; its predecessors end at node 0
//! ```
//!
//! A step from a word of one level to its predecessors is then a constant shift, which is what makes matching a loop
//! over contiguous memory.

use thiserror::Error;

use super::tolerance::Syllables;
use crate::text::{Word, WordId};

/// Marks a node at which no word of a level ends; no word has this class.
const ABSENT: u16 = u16::MAX;

/// Words that do not form a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum LatticeError {
    /// A level-0 word is missing or out of order.
    #[error("level-0 word {index} is missing or out of order")]
    Gap {
        /// The expected index.
        index: u32,
    },
    /// An alternative word is missing or out of order, or does not begin and end with words of level 0 that lie level + 2 apart.
    #[error("alternative word {index} of level {level} is out of order or does not cover level + 2 words")]
    Span {
        /// Level of the offending word.
        level: u8,
        /// Its index.
        index: u32,
    },
}

/// Number of level-0 words that a word of `level` covers (thesis 5.2.2).
pub const fn num_nodes_covered(level: usize) -> usize {
    if level == 0 { 1 } else { level + 2 }
}

/// The words of one level: by the node they end at, and by class.
#[derive(Clone, Debug, Default)]
pub struct LevelColumns {
    by_node: WordColumns,
    by_class: Vec<ClassColumns>,
    /// Where each word of the level ends, by its index.
    ends: Vec<u32>,
    /// Index of the word within its level, one entry per node.
    index: Vec<u32>,
}

/// Words as columns of their syllables, one entry per node; [`ABSENT`] is the class where no word of the level ends.
#[derive(Clone, Debug, Default)]
struct WordColumns {
    class: Vec<u16>,
    size: Vec<u16>,
    turn: Vec<i16>,
}

/// The words of one class and level, in the order in which they end: all that a word of the class can match.
#[derive(Clone, Debug, Default)]
pub struct ClassColumns {
    /// The node each word ends at, ascending.
    pub ends: Vec<u32>,
    /// Number of observations of each word.
    pub size: Vec<u16>,
    /// Turn of each word as a binary angle.
    pub turn: Vec<i16>,
}

impl LevelColumns {
    /// Number of words of this level.
    pub fn num_words(&self) -> usize {
        self.ends.len()
    }

    /// The words of one class; `None` if the class is beyond all that occur.
    pub fn of_class(&self, class: u16) -> Option<&ClassColumns> {
        self.by_class.get(usize::from(class))
    }

    fn push_absent(&mut self) {
        self.by_node.class.push(ABSENT);
        self.by_node.size.push(0);
        self.by_node.turn.push(0);
        self.index.push(u32::MAX);
    }

    fn append(&mut self, other: &Self, first_node: usize) {
        let first_word = self.ends.len() as u32;
        let moved = |end: &u32| end + first_node as u32;
        self.by_node.class.extend_from_slice(&other.by_node.class);
        self.by_node.size.extend_from_slice(&other.by_node.size);
        self.by_node.turn.extend_from_slice(&other.by_node.turn);
        self.ends.extend(other.ends.iter().map(moved));
        // The mark of a node without a word stays as it is.
        let renumbered = |&index: &u32| if index == u32::MAX { index } else { index + first_word };
        self.index.extend(other.index.iter().map(renumbered));
        self.make_room_for_classes(other.by_class.len());
        for (words, others) in self.by_class.iter_mut().zip(&other.by_class) {
            words.ends.extend(others.ends.iter().map(moved));
            words.size.extend_from_slice(&others.size);
            words.turn.extend_from_slice(&others.turn);
        }
    }

    fn set(&mut self, node: usize, word: &Word) {
        let syllables = Syllables::of(word);
        self.by_node.class[node] = syllables.class;
        self.by_node.size[node] = syllables.size;
        self.by_node.turn[node] = syllables.turn;
        self.index[node] = word.id.index;
        self.ends.push(node as u32);
        let class = usize::from(syllables.class);
        self.make_room_for_classes(class + 1);
        let alike = &mut self.by_class[class];
        alike.ends.push(node as u32);
        alike.size.push(syllables.size);
        alike.turn.push(syllables.turn);
    }

    fn make_room_for_classes(&mut self, num_classes: usize) {
        let num_classes = num_classes.max(self.by_class.len());
        self.by_class.resize_with(num_classes, ClassColumns::default);
    }
}

/// The text of one run, all levels, by the node at which words end.
#[derive(Clone, Debug, Default)]
pub struct Lattice {
    levels: Vec<LevelColumns>,
    observations: Vec<(u32, u32)>,
}

impl Lattice {
    /// Arranges a run's words, in any order of levels; each level in order of its indices.
    ///
    /// # Errors
    /// [`LatticeError`] when the words are not a text as Algorithm 5.2 builds it.
    pub fn from_words(words: &[Word]) -> Result<Self, LatticeError> {
        let mut lattice = Self::default();
        lattice.extend(words)?;
        Ok(lattice)
    }

    /// Several texts one after the other, with a node at which no word ends between any two, so that no chain leads from
    /// one to the next. Words and observations are numbered anew.
    pub fn joined(texts: &[&Self]) -> Self {
        let mut joined = Self::default();
        let num_levels = texts.iter().map(|text| text.num_levels()).max().unwrap_or(0);
        joined.levels.resize_with(num_levels, LevelColumns::default);
        for text in texts {
            if !joined.observations.is_empty() {
                let last = joined.last_observation();
                joined.observations.push((last, last));
                joined.levels.iter_mut().for_each(LevelColumns::push_absent);
            }
            let (first_node, offset) = (joined.num_nodes(), joined.last_observation());
            joined
                .observations
                .extend(text.observations.iter().map(|span| (span.0 + offset, span.1 + offset)));
            for (level, columns) in joined.levels.iter_mut().enumerate() {
                match text.levels.get(level) {
                    Some(other) => columns.append(other, first_node),
                    None => (0..text.num_nodes()).for_each(|_| columns.push_absent()),
                }
            }
        }
        joined
    }

    fn last_observation(&self) -> u32 {
        self.observations.last().map_or(0, |span| span.1)
    }

    /// Adds words at the end of the text: level-0 words that follow the last one and the alternatives among them.
    ///
    /// # Errors
    /// As [`Self::from_words`]; the words before the offending one stay.
    pub fn extend(&mut self, words: &[Word]) -> Result<(), LatticeError> {
        for word in words.iter().filter(|word| word.id.level == 0) {
            if word.id.index as usize != self.num_nodes() {
                return Err(LatticeError::Gap { index: self.num_nodes() as u32 });
            }
            self.push_node(word);
        }
        for word in words.iter().filter(|word| word.id.level > 0) {
            self.set_alternative(word)?;
        }
        Ok(())
    }

    fn push_node(&mut self, word: &Word) {
        if self.levels.is_empty() {
            self.levels.push(LevelColumns::default());
        }
        for level in &mut self.levels {
            level.push_absent();
        }
        self.observations.push(word.observations);
        self.levels[0].set(self.observations.len() - 1, word);
    }

    fn set_alternative(&mut self, word: &Word) -> Result<(), LatticeError> {
        let level = word.id.level as usize;
        let misplaced = LatticeError::Span { level: word.id.level, index: word.id.index };
        let (first, last) = word.observations;
        let start = self.observations.binary_search_by_key(&first, |span| span.0).map_err(|_| misplaced)?;
        let end = start + num_nodes_covered(level) - 1;
        if self.observations.get(end).is_none_or(|span| span.1 != last) {
            return Err(misplaced);
        }
        while self.levels.len() <= level {
            let mut columns = LevelColumns::default();
            (0..self.num_nodes()).for_each(|_| columns.push_absent());
            self.levels.push(columns);
        }
        let columns = &self.levels[level];
        let is_in_order = columns.ends.last().is_none_or(|&before| (before as usize) < end);
        if columns.ends.len() != word.id.index as usize || !is_in_order {
            return Err(misplaced);
        }
        self.levels[level].set(end, word);
        Ok(())
    }

    /// Number of level-0 words.
    pub fn num_nodes(&self) -> usize {
        self.observations.len()
    }

    /// Number of levels, level 0 included.
    pub fn num_levels(&self) -> usize {
        self.levels.len()
    }

    /// Number of words over all levels.
    pub fn num_words(&self) -> usize {
        self.levels.iter().map(|level| level.ends.len()).sum()
    }

    /// The columns of a level; empty for a level that no word has.
    pub fn level(&self, level: usize) -> Option<&LevelColumns> {
        self.levels.get(level)
    }

    /// The word of `level` that ends at `node`, if there is one.
    pub fn word_ending_at(&self, node: usize, level: usize) -> Option<Syllables> {
        let columns = &self.levels.get(level)?.by_node;
        let class = *columns.class.get(node)?;
        (class != ABSENT).then(|| Syllables { class, size: columns.size[node], turn: columns.turn[node] })
    }

    /// The name of the word of `level` that ends at `node`, if there is one.
    pub fn id_ending_at(&self, node: usize, level: usize) -> Option<WordId> {
        let index = *self.levels.get(level)?.index.get(node)?;
        (index != u32::MAX).then_some(WordId { level: level as u8, index })
    }

    /// The node a word ends at.
    pub fn end_of(&self, id: WordId) -> Option<usize> {
        self.levels.get(usize::from(id.level))?.ends.get(id.index as usize).map(|&end| end as usize)
    }

    /// First and last observation of a word, both inclusive.
    pub fn observations_of(&self, id: WordId) -> Option<(u32, u32)> {
        let end = self.end_of(id)?;
        Some(self.observations(end + 1 - num_nodes_covered(usize::from(id.level)), end))
    }

    /// First and last observation of a stretch of nodes, both inclusive.
    pub fn observations(&self, first_node: usize, last_node: usize) -> (u32, u32) {
        (self.observations[first_node].0, self.observations[last_node].1)
    }

    /// Number of leading nodes whose last observation is below `observation`.
    pub fn num_nodes_before(&self, observation: u32) -> usize {
        self.observations.partition_point(|span| span.1 < observation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(level: u8, index: u32, observations: (u32, u32)) -> Word {
        let size = observations.1 - observations.0 + 1;
        Word {
            id: WordId { level, index },
            class: 1,
            size,
            turn_rad: 0.0,
            observations,
            predecessors: vec![],
        }
    }

    #[test]
    fn an_alternative_ends_where_its_last_word_ends() {
        let words = [
            word(0, 0, (0, 4)),
            word(0, 1, (5, 9)),
            word(0, 2, (10, 19)),
            word(0, 3, (20, 22)),
            word(1, 0, (5, 22)),
        ];
        let lattice = Lattice::from_words(&words).unwrap();
        assert_eq!(lattice.id_ending_at(3, 1), Some(WordId { level: 1, index: 0 }));
        assert_eq!(lattice.id_ending_at(2, 1), None);
        assert_eq!(lattice.word_ending_at(3, 1).unwrap().size, 18);
        assert_eq!(lattice.num_words(), 5);
        assert_eq!(lattice.num_nodes_before(20), 3);
    }

    #[test]
    fn words_that_are_no_text_are_refused() {
        let misplaced = [word(0, 0, (0, 4)), word(0, 1, (5, 9)), word(1, 0, (0, 9))];
        assert_eq!(Lattice::from_words(&misplaced).unwrap_err(), LatticeError::Span { level: 1, index: 0 });
        // Two words of one level, the one that ends first last.
        let plain = (0..5).map(|index| word(0, index, (index * 5, index * 5 + 4)));
        let swapped: Vec<Word> = plain.chain([word(1, 0, (5, 19)), word(1, 1, (0, 14))]).collect();
        assert_eq!(Lattice::from_words(&swapped).unwrap_err(), LatticeError::Span { level: 1, index: 1 });
        assert_eq!(Lattice::from_words(&[word(0, 1, (0, 4))]).unwrap_err(), LatticeError::Gap { index: 0 });
    }
}
