//! One density sample of a run (thesis sections 4.2.1 and 6.2.1).

use serde::{Deserialize, Serialize};

use crate::geometry::Pose2;

/// A sample of free-space density, one every 0.1 m of travel.
///
/// With delayed observation (SPEC section 4) the density is evaluated at the pose the robot had some metres of
/// travel ago; every field describes that earlier moment, so nothing downstream needs to know of the delay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// Sequence number in the run of the scan taken nearest to this place.
    pub scan_seq: u64,
    /// Timestamp of that scan, nanoseconds.
    pub timestamp_ns: i64,
    /// Distance driven since the run began, by odometry, metres.
    pub travel_m: f64,
    /// Raw odometry pose, interpolated between the scans before and after.
    pub odom_from_robot: Pose2,
    /// Pose in the run's own frame, interpolated likewise: odometry as sent, or refined against the recent scans.
    pub run_from_robot: Pose2,
    /// Soft density of each configured kernel, in [0, 1] (Algorithm 3.1).
    pub densities: Vec<f32>,
    /// Whether the first kernel's flood fill met no opening of unknown cells, so that its soft density is hard too.
    pub is_hard: bool,
    /// Connected groups of free border cells of the first kernel (Algorithm 6.1).
    pub num_frontiers: u8,
}
