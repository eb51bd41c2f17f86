//! What the map builder is told of each run.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose2;
use crate::scan::ScanGeometry;
use crate::text::{Observation, Word};

/// A scan that registration used, about every 0.2 m of travel; the graph's nodes are made of these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Sequence number in the run.
    pub scan_seq: u64,
    /// As the robot's clock said, nanoseconds.
    pub timestamp_ns: i64,
    /// Raw odometry.
    pub odom_from_robot: Pose2,
    /// Pose in the run's own frame: odometry as sent, or refined against the recent scans.
    pub run_from_robot: Pose2,
    /// Covariance of the motion since the previous keyframe, (x, y, θ) in that keyframe's axes, row by row.
    pub motion_covariance: [[f64; 3]; 3],
    /// Readings in metres.
    pub ranges_m: Vec<f32>,
}

/// One run as the map builder sees it.
#[derive(Clone, Copy, Debug)]
pub struct RunRecord<'a> {
    /// The laser.
    pub geometry: &'a ScanGeometry,
    /// Density samples in order of travel.
    pub observations: &'a [Observation],
    /// The text, all levels.
    pub words: &'a [Word],
    /// Registered scans in order of travel.
    pub keyframes: &'a [Keyframe],
    /// Where the run belongs, for instance a floor, when somebody said; runs of different areas are never joined.
    pub area: Option<&'a str>,
}
