//! Stretches of driving and how two of them run, said by whoever claims that they are the same place.

use serde::{Deserialize, Serialize};

/// A stretch of one run, by its observations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Interval {
    /// Position of the run in the list given to the map builder.
    pub run_idx: u32,
    /// First observation, inclusive.
    pub first: u32,
    /// Last observation, inclusive.
    pub last: u32,
}

impl Interval {
    /// Whether two stretches have an observation in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.run_idx == other.run_idx && self.first <= other.last && other.first <= self.last
    }
}

/// Whether the place was driven the same way both times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// First observation of one interval pairs with the first of the other.
    Same,
    /// First pairs with last.
    Opposite,
}
