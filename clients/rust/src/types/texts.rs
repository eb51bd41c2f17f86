//! Observations, words, trajectories, and questions by words.

use serde::{Deserialize, Serialize};

use super::values::{Direction, Pose};

/// A density sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// Its number in the run.
    pub observation: u64,
    /// Sequence number of the scan taken at this place.
    pub scan_seq: u64,
    /// Timestamp of that scan, nanoseconds.
    pub timestamp_ns: i64,
    /// Distance driven since the run began, metres.
    pub travel_m: f64,
    /// Raw odometry.
    pub odom_from_robot: Pose,
    /// Pose in the run's frame.
    pub run_from_robot: Pose,
    /// Density of each kernel, in [0, 1].
    pub densities: Vec<f32>,
    /// Whether no opening of unknown cells was met.
    pub is_hard: bool,
    /// Groups of free cells on the border of the kernel.
    pub num_frontiers: u8,
}

/// Names a word of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct WordId {
    /// 0: as observed; above: alternatives that fuse several words.
    pub level: u8,
    /// Position in its level.
    pub index: u32,
}

/// A word ⟨d, s, a⟩.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Word {
    /// Its name.
    pub id: WordId,
    /// d: density class.
    pub class: u8,
    /// s: number of observations.
    pub size: u32,
    /// a: turn, radians.
    pub turn_rad: f32,
    /// First and last observation, both inclusive.
    pub observations: [u32; 2],
    /// Words that may stand before it.
    pub predecessors: Vec<WordId>,
}

/// In whose coordinates poses are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// The map that serves.
    Map,
    /// The run's own frame: odometry as sent, or refined.
    #[default]
    Run,
    /// Odometry as sent.
    Odom,
}

impl Frame {
    /// Its name in the API.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Map => "map",
            Self::Run => "run",
            Self::Odom => "odom",
        }
    }
}

/// A pose at the time of a scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StampedPose {
    /// Sequence number of the scan.
    pub scan_seq: u64,
    /// Its timestamp, nanoseconds.
    pub timestamp_ns: i64,
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub theta: f64,
}

/// Poses of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// Component of the map that the poses belong to; null outside the map frame.
    pub component: Option<u32>,
    /// One for every scan that was asked for, in order.
    pub poses: Vec<StampedPose>,
    /// Where the next ones begin, when fewer were wanted than there are.
    pub next_cursor: Option<String>,
}

/// One word of a question; what is left out may be anything.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WordPattern {
    /// d: density class.
    pub class: Option<u8>,
    /// s: number of observations.
    pub size: Option<u32>,
    /// How far the size may be off, as a share of the larger; 0.25 unless said.
    pub size_tolerance: Option<f64>,
    /// a: turn, radians.
    pub turn_rad: Option<f64>,
    /// How far the turn may be off, radians; 30 degrees unless said.
    pub turn_tolerance_rad: Option<f64>,
}

/// A sequence of words to look for, driven either way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WordQuery {
    /// In the order of driving.
    pub words: Vec<WordPattern>,
    /// Most places to answer; 20 unless said.
    pub limit: Option<usize>,
}

/// Where a question fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WordAnswer {
    /// The site.
    pub site: String,
    /// The run.
    pub run: String,
    /// `same`: read forwards; `opposite`: backwards.
    pub direction: Direction,
    /// First and last word of level 0; alternative words make them more than the question has.
    pub words: [u32; 2],
    /// First and last observation.
    pub observations: [u32; 2],
    /// Mean fit of the words, from 0 (just within the tolerances) to 1 (exact).
    pub fit: f64,
    /// Component of the map; null when the run is not in it.
    pub component: Option<u32>,
    /// The middle of the place in that component's frame.
    pub map_from_middle: Option<Pose>,
}
