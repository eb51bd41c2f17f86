//! The occurrence index: where each word of a site occurs (thesis Algorithm 5.3, SPEC section 5).
//!
//! [`Lattice`] is one run's text arranged for comparing it with another, [`OccurrenceIndex`] is all texts of a site
//! packed for questions.

mod fits;
mod lattice;
mod occurrence;
mod packed;
mod pattern;
mod radix;
mod reading;
mod search;
mod tolerance;

#[cfg(test)]
mod search_tests;

pub use fits::{PatternFit, WordPattern, WordSequence};
pub use lattice::{AlikeColumns, Lattice, LatticeError, LevelColumns, num_nodes_covered};
pub use occurrence::OccurrenceIndex;
pub use packed::{STORED_WORD_BYTES, store_words};
pub use pattern::{TextQuery, WordConstraint};
pub use reading::{ReadWord, TextReading};
pub use search::TextMatch;
pub use tolerance::{Syllables, WordTolerance, WordWindow, binary_angle};
