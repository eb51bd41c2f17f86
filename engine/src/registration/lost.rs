//! When a robot is lost while it is being mapped: neither its odometry nor what it sees tells where it went.
//!
//! A run is cut there, and the map joins its pieces again as it joins runs that never met. A cut that was not needed
//! costs little, so it is made when in doubt; but a scan that fits badly may only show people, or what was hidden behind
//! a door. So some scans are waited for. While the doubt lasts nothing is added to what is known of the surroundings,
//! and as soon as a scan fits them again the run goes on as if nothing had been.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::recent_scan::RecentScan;
use crate::geometry::{Pose2, wrap_angle};
use crate::scan::ScanGeometry;

/// Why a run was cut: what could not be bridged between one scan and the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutReason {
    /// Odometry stepped farther than a robot can, and the scans do not fit what was seen before.
    Jump,
    /// Nothing was recorded for a while, and what was seen then does not fit what was seen before.
    Gap,
    /// The laser saw nothing for a while, and what it saw then does not fit what it saw before.
    NoReturns,
    /// By its odometry the robot hardly moved, but it saw through what had been there: it was carried.
    Carried,
    /// There is no odometry to be believed, and the scans changed faster than they could be followed.
    Unfollowed,
}

/// A doubt that the robot is where it is thought to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Doubt {
    pub reason: CutReason,
    /// True when odometry cannot have brought it there.
    pub is_elsewhere: bool,
    /// Scans so far that saw something and did not fit.
    pub num_scans: u32,
}

/// The latest scans are compared that have together about so many points…
const NUM_POINTS: usize = 300;
/// … and at least so many.
const NUM_SCANS_MIN: usize = 3;
/// What lies farther off is not compared, for a little turn moves it far, metres.
const REACH_M: f64 = 8.0;
/// Seen through by less than this may be noise, metres.
const MARGIN_M: f64 = 0.4;
/// Fewer points than this tell nothing.
const MIN_POINTS: usize = 20;

/// Share of the points of recent scans in a scan's view that it sees through from a pose: there is nothing where
/// something was. People who come hide things, and a door gives new things to see, but neither takes any away.
pub(super) fn seen_through<'a>(
    geometry: &ScanGeometry,
    ranges_m: &[f32],
    start_from_robot: &Pose2,
    recent: impl DoubleEndedIterator<Item = &'a RecentScan>,
) -> f64 {
    let laser_from_start = start_from_robot.compose(&geometry.robot_from_laser).inverse();
    let (mut num_seen, mut num_through) = (0usize, 0usize);
    let mut num_compared = 0usize;
    let compared = recent.rev().enumerate().take_while(|(idx, scan)| {
        let is_wanted = *idx < NUM_SCANS_MIN || num_compared < NUM_POINTS;
        num_compared += scan.points().count();
        is_wanted
    });
    for point in compared.flat_map(|(_, scan)| scan.points()) {
        let at = laser_from_start.transform_point(&point);
        let distance_m = at.x.hypot(at.y);
        if distance_m > REACH_M {
            continue;
        }
        let Some(nearest_m) = nearest_reading(geometry, ranges_m, at.y.atan2(at.x)) else { continue };
        num_seen += 1;
        num_through += usize::from(nearest_m > distance_m + MARGIN_M);
    }
    if num_seen < MIN_POINTS { 0.0 } else { num_through as f64 / num_seen as f64 }
}

/// The nearest of the readings about a direction of the laser, metres; none where one of them says nothing.
fn nearest_reading(geometry: &ScanGeometry, ranges_m: &[f32], angle_rad: f64) -> Option<f64> {
    let mut beam = wrap_angle(angle_rad - geometry.angle_min_rad) / geometry.angle_increment_rad;
    if beam.round() < 0.0 {
        beam += TAU / geometry.angle_increment_rad.abs();
    }
    let beam = beam.round() as usize;
    let about = ranges_m.get(beam.saturating_sub(1)..(beam + 2).min(ranges_m.len()))?;
    if !about.iter().all(|&range_m| geometry.is_return(range_m)) {
        return None;
    }
    about.iter().copied().map(f64::from).reduce(f64::min)
}
