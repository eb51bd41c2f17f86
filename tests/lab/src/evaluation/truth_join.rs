//! A true pose for every scan from true poses at some of them.

use std::collections::HashMap;

use locution_engine::formats::TruthPose;
use locution_engine::geometry::{Pose2, wrap_angle};

/// Before the first and after the last true pose, odometry is trusted for this far.
const BEYOND_ENDS_M: f64 = 1.0;

/// Odometry at one scan of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryPose {
    /// Timestamp of the scan, exactly as in its log.
    pub timestamp_ns: i64,
    /// Raw odometry.
    pub odom_from_robot: Pose2,
}

/// True poses of all scans, in their order: at key frames as given, in between composed from odometry with the
/// closure error spread linearly over the distance driven (SPEC section 9). `None` where the truth says nothing:
/// more than a metre before its first or after its last pose.
///
/// Timestamps may jitter and repeat; truth is matched to scans in file order.
pub fn join_truth(scans: &[OdometryPose], truth: &[TruthPose]) -> Vec<Option<Pose2>> {
    let anchors = anchors(scans, truth);
    let travel_m = travel(scans);
    let mut joined = vec![None; scans.len()];
    for pair in anchors.windows(2) {
        let ((from, from_truth), (to, to_truth)) = (pair[0], pair[1]);
        let odometry = |idx: usize| scans[from].odom_from_robot.between(&scans[idx].odom_from_robot);
        let carried = from_truth.compose(&odometry(to));
        let (error_x, error_y) = (to_truth.x - carried.x, to_truth.y - carried.y);
        let error_rad = wrap_angle(to_truth.theta - carried.theta);
        for idx in from..=to {
            let driven_m = travel_m[to] - travel_m[from];
            let share = if driven_m > 0.0 {
                (travel_m[idx] - travel_m[from]) / driven_m
            } else {
                (idx - from) as f64 / (to - from) as f64
            };
            let pose = from_truth.compose(&odometry(idx));
            let spread = Pose2::new(
                pose.x + share * error_x,
                pose.y + share * error_y,
                pose.theta + share * error_rad,
            );
            joined[idx] = Some(spread);
        }
    }
    for &(anchor, truth_pose) in anchors.first().iter().chain(anchors.last().iter()).copied() {
        for idx in 0..scans.len() {
            let is_outside =
                joined[idx].is_none() && (travel_m[idx] - travel_m[anchor]).abs() <= BEYOND_ENDS_M;
            if is_outside {
                let moved = scans[anchor].odom_from_robot.between(&scans[idx].odom_from_robot);
                joined[idx] = Some(truth_pose.compose(&moved));
            }
        }
    }
    joined
}

/// Scans that have a true pose, strictly ascending.
fn anchors(scans: &[OdometryPose], truth: &[TruthPose]) -> Vec<(usize, Pose2)> {
    let mut by_timestamp: HashMap<i64, Vec<usize>> = HashMap::new();
    for (idx, scan) in scans.iter().enumerate() {
        by_timestamp.entry(scan.timestamp_ns).or_default().push(idx);
    }
    let mut anchors: Vec<(usize, Pose2)> = Vec::with_capacity(truth.len());
    for pose in truth {
        let next = anchors.last().map_or(0, |&(idx, _)| idx + 1);
        let candidates = by_timestamp.get(&pose.timestamp_ns).map_or(&[][..], Vec::as_slice);
        if let Some(&idx) = candidates.iter().find(|&&idx| idx >= next) {
            anchors.push((idx, pose.truth_from_robot));
        }
    }
    anchors
}

/// Metres driven from the first scan to each.
fn travel(scans: &[OdometryPose]) -> Vec<f64> {
    let mut driven_m = 0.0;
    (0..scans.len())
        .map(|idx| {
            if idx > 0 {
                driven_m += scans[idx - 1].odom_from_robot.distance(&scans[idx].odom_from_robot);
            }
            driven_m
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(timestamp_ns: i64, x: f64) -> OdometryPose {
        OdometryPose { timestamp_ns, odom_from_robot: Pose2::new(x, 0.0, 0.0) }
    }

    fn truth(timestamp_ns: i64, x: f64, y: f64) -> TruthPose {
        TruthPose { timestamp_ns, truth_from_robot: Pose2::new(x, y, 0.0) }
    }

    #[test]
    fn the_closure_error_is_spread_over_the_distance() {
        let scans: Vec<OdometryPose> = (0..=4).map(|idx| scan(idx, idx as f64)).collect();
        let joined = join_truth(&scans, &[truth(0, 10.0, 0.0), truth(4, 14.0, 0.4)]);
        for (idx, pose) in joined.iter().enumerate() {
            let pose = pose.unwrap();
            assert!((pose.x - 10.0 - idx as f64).abs() < 1e-12 && (pose.y - 0.1 * idx as f64).abs() < 1e-12);
        }
    }

    #[test]
    fn truth_is_not_stretched_beyond_a_meter() {
        let scans: Vec<OdometryPose> = (0..=6).map(|idx| scan(idx, 0.6 * idx as f64)).collect();
        let joined = join_truth(&scans, &[truth(3, 0.0, 0.0)]);
        let known: Vec<bool> = joined.iter().map(Option::is_some).collect();
        assert_eq!(known, [false, false, true, true, true, false, false]);
    }

    #[test]
    fn repeated_and_jumping_timestamps_keep_file_order() {
        let scans = [scan(5, 0.0), scan(7, 1.0), scan(5, 2.0), scan(6, 3.0)];
        let joined = join_truth(
            &scans,
            &[truth(5, 0.0, 0.0), truth(5, 2.0, 0.0), truth(99, 9.0, 9.0), truth(6, 3.0, 0.0)],
        );
        let xs: Vec<f64> = joined.iter().map(|pose| pose.unwrap().x).collect();
        assert_eq!(xs, [0.0, 1.0, 2.0, 3.0]);
    }
}
