//! Questions to a text: sequences of words with tolerances.

use serde::{Deserialize, Serialize};

use super::lattice::{Lattice, num_nodes_covered};
use super::occurrence::ClassSet;
use super::packed::PackedWord;
use super::tolerance::{Syllables, WordTolerance, binary_angle};
use crate::config_error::ConfigError;

/// What a word of a pattern may be; all bounds inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordConstraint {
    /// Lowest and highest density class.
    pub class: (u8, u8),
    /// Smallest and largest number of observations.
    pub size: (u32, u32),
    /// The arc of turns from the first to the second, counter-clockwise, radians.
    pub turn_rad: (f64, f64),
}

impl WordConstraint {
    /// Any word.
    pub const ANY: Self = Self {
        class: (0, u8::MAX),
        size: (0, u32::MAX),
        turn_rad: (-std::f64::consts::PI, std::f64::consts::PI),
    };
}

/// A set of words: a range of classes, a range of sizes and an arc of turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WordBox {
    class: (u8, u8),
    size: (u16, u16),
    turn_min: i16,
    turn_span: u16,
}

impl WordBox {
    fn around(word: &Syllables, tolerance: &WordTolerance) -> Self {
        let window = tolerance.window(word);
        let class = window.class as u8;
        let size = (window.size_min, window.size_min + window.size_span);
        Self { class: (class, class), size, turn_min: window.turn_min, turn_span: window.turn_span }
    }

    fn of(constraint: &WordConstraint) -> Self {
        let size = |size: u32| u16::try_from(size).unwrap_or(u16::MAX);
        let (from_rad, to_rad) = constraint.turn_rad;
        let is_circle = to_rad - from_rad >= std::f64::consts::TAU - 1e-9;
        let turn_min = binary_angle(from_rad);
        let turn_span = if is_circle { u16::MAX } else { binary_angle(to_rad).wrapping_sub(turn_min) as u16 };
        Self {
            class: constraint.class,
            size: (size(constraint.size.0), size(constraint.size.1)),
            turn_min,
            turn_span,
        }
    }

    pub fn contains(&self, word: &PackedWord) -> bool {
        (self.class.0..=self.class.1).contains(&word.class)
            && (self.size.0..=self.size.1).contains(&word.size)
            && word.turn.wrapping_sub(self.turn_min) as u16 <= self.turn_span
    }

    /// The classes of its words modulo 64, as bits.
    pub fn classes(&self) -> ClassSet {
        if self.class.1.saturating_sub(self.class.0) >= 63 {
            return ClassSet::from(u64::MAX);
        }
        (self.class.0..=self.class.1).fold(0, |set, class| set | 1 << (class & 63))
    }

    /// Whether a word with this code could be in the box.
    pub fn may_contain_code(&self, code: u16) -> bool {
        let class = (code >> 10) as u8;
        // Classes share six bits, so a range of 64 classes or more, or one that wraps, holds all of them.
        let num_classes = self.class.1.saturating_sub(self.class.0);
        let offset = class.wrapping_sub(self.class.0) & 63;
        let (half_octave_min, half_octave_max) = (half_octave(self.size.0), half_octave(self.size.1));
        let half_octave = code >> 5 & 31;
        // A turn's code is an arc of 2¹¹ units; it and the box meet unless each begins behind the other's end.
        let arc_start = (code << 11) as i16;
        let meets = (arc_start.wrapping_sub(self.turn_min) as u16) <= self.turn_span
            || (self.turn_min.wrapping_sub(arc_start) as u16) < 1 << 11;
        (num_classes >= 63 || offset <= num_classes)
            && (half_octave_min..=half_octave_max).contains(&half_octave)
            && meets
    }
}

fn half_octave(size: u16) -> u16 {
    let word = Syllables { class: 0, size, turn: 0 };
    word.code().map_or(0, |code| code >> 5 & 31)
}

/// A word of a question: the nodes it covers and what matches it.
#[derive(Clone, Copy, Debug)]
pub(super) struct QueryWord {
    /// First node.
    pub start: usize,
    /// The node after its last.
    pub end: usize,
    pub accepts: WordBox,
}

/// A question to a text: a lattice of sets of words, to be matched from its first node to its last.
#[derive(Clone, Debug)]
pub struct TextQuery {
    num_nodes: usize,
    words: Vec<QueryWord>,
}

impl TextQuery {
    /// Words in a row, each under its constraint.
    ///
    /// # Errors
    /// An empty pattern or one of more than 64 words, an empty range, or an angle that is not a number.
    pub fn from_pattern(pattern: &[WordConstraint]) -> Result<Self, ConfigError> {
        if pattern.is_empty() || pattern.len() > 64 {
            return Err(ConfigError::new("pattern", "needs 1 to 64 words"));
        }
        for (idx, constraint) in pattern.iter().enumerate() {
            if constraint.class.0 > constraint.class.1 {
                return Err(ConfigError::new(format!("pattern[{idx}].class"), "must not be an empty range"));
            }
            if constraint.size.0 > constraint.size.1 {
                return Err(ConfigError::new(format!("pattern[{idx}].size"), "must not be an empty range"));
            }
            if !(constraint.turn_rad.0.is_finite() && constraint.turn_rad.1.is_finite()) {
                return Err(ConfigError::new(format!("pattern[{idx}].turn_rad"), "must be numbers"));
            }
        }
        let words = pattern.iter().enumerate().map(|(node, constraint)| QueryWord {
            start: node,
            end: node + 1,
            accepts: WordBox::of(constraint),
        });
        Ok(Self { num_nodes: pattern.len(), words: words.collect() })
    }

    /// A stretch of a text with its alternative words, each matched within the tolerance.
    pub fn from_text(text: &Lattice, nodes: std::ops::Range<usize>, tolerance: &WordTolerance) -> Self {
        let num_nodes = nodes.end.min(text.num_nodes()).saturating_sub(nodes.start);
        let mut words = Vec::new();
        for end in 0..num_nodes {
            for level in 0..text.num_levels() {
                let Some(start) = (end + 1).checked_sub(num_nodes_covered(level)) else { continue };
                let Some(word) = text.word_ending_at(nodes.start + end, level) else { continue };
                words.push(QueryWord { start, end: end + 1, accepts: WordBox::around(&word, tolerance) });
            }
        }
        Self { num_nodes, words }
    }

    /// The same stretch of text as it reads when driven the other way.
    pub fn reversed(&self) -> Self {
        let words = self.words.iter().map(|word| {
            let accepts = word.accepts;
            // The arc of the negated turns begins at the negated end.
            let turn_min = accepts.turn_min.wrapping_add(accepts.turn_span as i16).wrapping_neg();
            QueryWord {
                start: self.num_nodes - word.end,
                end: self.num_nodes - word.start,
                accepts: WordBox { turn_min, ..accepts },
            }
        });
        Self { num_nodes: self.num_nodes, words: words.collect() }
    }

    /// Number of level-0 words.
    pub fn num_nodes(&self) -> usize {
        self.num_nodes
    }

    pub(super) fn words(&self) -> &[QueryWord] {
        &self.words
    }
}
