//! Words of free-space density (thesis Algorithms 4.3 and 5.1).

use serde::{Deserialize, Serialize};

/// Names a word of a run's text: the `index`-th word of its `level`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct WordId {
    /// 0: words as observed; l ≥ 1: alternative words that fuse l + 2 words of level 0.
    pub level: u8,
    /// Position within its level, from 0.
    pub index: u32,
}

/// A word ⟨d, s, a⟩ with its predecessors and its observations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Word {
    /// Name within the run's text.
    pub id: WordId,
    /// d: density class.
    pub class: u8,
    /// s: number of observations.
    pub size: u32,
    /// a: heading(median → last) − heading(first → median), in (−π, π].
    pub turn_rad: f32,
    /// First and last observation of the region, both inclusive, as indices into the run's observations.
    pub observations: (u32, u32),
    /// Words of any level that may stand directly before this one.
    pub predecessors: Vec<WordId>,
}
