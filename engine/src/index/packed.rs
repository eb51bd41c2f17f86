//! A word in twelve bytes, and a site's words as one sequence of them.
//!
//! Words stand in the order of the nodes they end at: each level-0 word is followed by the alternatives that end with
//! it. Predecessors need no links: the words that may stand before a word are the group in front of its first node,
//! and how many nodes it covers follows from its level.

use super::lattice::{Lattice, num_nodes_covered};
use super::tolerance::Syllables;

/// Bytes of a stored word.
pub const STORED_WORD_BYTES: usize = 10;

/// The flag of the first word of a run; the other bits are the level.
const FIRST_OF_RUN: u8 = 0x80;

/// A word as the index keeps it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PackedWord {
    pub first_observation: u32,
    pub size: u16,
    pub turn: i16,
    /// Rank of the word's code among the codes of the site.
    pub rank: u16,
    pub class: u8,
    flags: u8,
}

impl PackedWord {
    pub fn level(&self) -> usize {
        usize::from(self.flags & !FIRST_OF_RUN)
    }

    pub fn is_first_of_run(&self) -> bool {
        self.flags & FIRST_OF_RUN != 0
    }

    pub fn is_node(&self) -> bool {
        self.flags & !FIRST_OF_RUN == 0
    }

    pub fn syllables(&self) -> Syllables {
        Syllables { class: u16::from(self.class), size: self.size, turn: self.turn }
    }

    pub fn last_observation(&self) -> u32 {
        self.first_observation.saturating_add(u32::from(self.size).saturating_sub(1))
    }

    /// The word as it is stored.
    pub fn to_stored(self) -> [u8; STORED_WORD_BYTES] {
        stored_word(&self.syllables(), self.level(), self.first_observation)
    }

    /// A coarse name of the word, class before size before turn, so that similar words have neighbouring codes.
    pub fn code(&self) -> u16 {
        code_of(self.class, self.size, self.turn)
    }
}

/// Six bits of class, five of size in half octaves (31 steps), five of turn in steps of 11.25°.
///
/// Classes beyond 63 share codes with lower ones; whoever looks up a code checks the word itself afterwards.
fn code_of(class: u8, size: u16, turn: i16) -> u16 {
    let size = u32::from(size.max(1));
    let octave = size.ilog2();
    // The upper half of an octave begins at √2, compared without rounding.
    let is_upper = u64::from(size).pow(2) >= 2u64 << (2 * octave);
    let half_octave = (2 * octave + u32::from(is_upper)).min(30) as u16;
    let turn = (turn as u16) >> 11;
    u16::from(class & 63) << 10 | half_octave << 5 | turn
}

impl Syllables {
    /// The code of an equal word of a text; `None` for a class that no word has.
    pub(super) fn code(&self) -> Option<u16> {
        Some(code_of(u8::try_from(self.class).ok()?, self.size, self.turn))
    }
}

/// Writes a run's text as bytes to be stored: ten per word, little endian, in the order of the index.
pub fn store_words(lattice: &Lattice) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(lattice.num_words() * STORED_WORD_BYTES);
    for node in 0..lattice.num_nodes() {
        for level in 0..lattice.num_levels() {
            let Some(word) = lattice.word_ending_at(node, level) else { continue };
            let (first, _) = lattice.observations(node + 1 - num_nodes_covered(level), node);
            bytes.extend_from_slice(&stored_word(&word, level, first));
        }
    }
    bytes
}

fn stored_word(word: &Syllables, level: usize, first_observation: u32) -> [u8; STORED_WORD_BYTES] {
    let ([a, b], [c, d]) = (word.size.to_le_bytes(), word.turn.to_le_bytes());
    let [e, f, g, h] = first_observation.to_le_bytes();
    [word.class as u8, level as u8, a, b, c, d, e, f, g, h]
}

/// Reads what [`store_words`] wrote onto the end of a site's words; `None`, with nothing added, when it is not that.
pub(super) fn load_words(bytes: &[u8], words: &mut Vec<PackedWord>) -> Option<()> {
    let (chunks, rest) = bytes.as_chunks::<STORED_WORD_BYTES>();
    let start = words.len();
    let mut num_nodes = 0;
    words.reserve(chunks.len());
    for &[class, level, size_low, size_high, turn_low, turn_high, a, b, c, d] in chunks {
        num_nodes += usize::from(level == 0);
        // An alternative covers words that stand before it.
        if level >= FIRST_OF_RUN || num_nodes < num_nodes_covered(usize::from(level)) {
            words.truncate(start);
            return None;
        }
        words.push(PackedWord {
            first_observation: u32::from_le_bytes([a, b, c, d]),
            size: u16::from_le_bytes([size_low, size_high]),
            turn: i16::from_le_bytes([turn_low, turn_high]),
            rank: 0,
            class,
            flags: level,
        });
    }
    if let Some(first) = words.get_mut(start) {
        first.flags |= FIRST_OF_RUN;
    }
    if !rest.is_empty() {
        words.truncate(start);
    }
    rest.is_empty().then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_ordered_by_class_size_and_turn() {
        assert!(code_of(1, 40_000, 30_000) < code_of(2, 1, -30_000));
        assert!(code_of(1, 11, 0) < code_of(1, 12, 0), "√2 · 8 lies between 11 and 12");
        assert_eq!(code_of(1, 8, 0), code_of(1, 11, 0));
        assert_eq!(code_of(3, 9, 100), code_of(3, 9, 2000));
        assert_ne!(code_of(3, 9, 100), code_of(3, 9, -100));
    }

    #[test]
    fn bytes_that_are_no_words_are_refused() {
        let mut words = Vec::new();
        assert_eq!(load_words(&[0; 9], &mut words), None);
        assert_eq!(load_words(&[1, 1, 5, 0, 0, 0, 0, 0, 0, 0], &mut words), None);
        assert!(words.is_empty());
        assert_eq!(load_words(&[1, 0, 5, 0, 0, 0, 7, 0, 0, 0], &mut words), Some(()));
        assert!(words[0].is_first_of_run() && words[0].is_node());
        assert_eq!((words[0].first_observation, words[0].last_observation()), (7, 11));
    }
}
