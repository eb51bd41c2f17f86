//! Runs and their scans.

use serde::{Deserialize, Serialize};

use super::values::Pose;

/// What all scans of a run share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Readings per scan, at most the server's limit.
    pub num_ranges: usize,
    /// Direction of the first beam in the laser's frame.
    pub angle_min_rad: f64,
    /// From one beam to the next; negative when the sweep runs clockwise.
    pub angle_increment_rad: f64,
    /// A reading at or above this means "no return".
    pub range_max_m: f64,
    /// Where the laser sits on the robot; at its centre looking ahead unless said.
    #[serde(default)]
    pub robot_from_laser: Pose,
}

/// Whether a run takes more scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// It does.
    Open,
    /// It does not.
    Finished,
}

/// A run and how far it has come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Its name.
    pub run: String,
    /// The robot.
    pub robot: Option<String>,
    /// The laser.
    pub geometry: Geometry,
    /// Whether it takes more scans.
    pub state: RunState,
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Scans stored.
    pub num_scans: u64,
    /// Observations so far.
    pub num_observations: u64,
    /// Words of all levels so far.
    pub num_words: u64,
}

/// The answer to an accepted batch, also when it is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Receipt {
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Observations of the run after this batch.
    pub num_observations: u64,
    /// Words of all levels of the run after this batch.
    pub num_words: u64,
}

/// A stored scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredScan {
    /// Sequence number.
    pub scan_seq: u64,
    /// As sent.
    pub timestamp_ns: i64,
    /// As sent.
    pub odom_from_robot: Pose,
    /// As sent; readings without a return are null.
    pub ranges_m: Ranges,
}
