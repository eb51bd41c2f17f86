//! A pose for every scan, in the frame asked for.
//!
//! Poses are known at some scans only (keyframes); `RunTrajectory` says how odometry fills what lies between.

use locution_engine::geometry::Pose2;
use locution_engine::recording::{PlacedKeyframe, RunTrajectory};

use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{MapRecord, MapVersion, Run};

/// In whose coordinates poses are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// The optimised map, per component.
    Map,
    /// The run's own frame: odometry as sent, or refined.
    Run,
    /// Odometry as sent.
    Odom,
}

/// A pose at the time of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedPose {
    /// Sequence number of the scan.
    pub scan_seq: u64,
    /// Its timestamp, nanoseconds.
    pub timestamp_ns: i64,
    /// Pose of the robot in the frame asked for.
    pub frame_from_robot: Pose2,
}

/// Poses of one run.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// The component of the map that the poses belong to, in the map frame.
    pub component: Option<u32>,
    /// One for every scan, in order.
    pub poses: Vec<StampedPose>,
}

/// The trajectory of a run; `version` counts in the map frame only.
///
/// # Errors
/// [`AppError::NotReady`] in the map frame before the first build; those of the storage.
pub async fn trajectory(
    site: &Site,
    run: &Run,
    frame: Frame,
    version: Option<MapVersion>,
) -> Result<Trajectory, AppError> {
    let stamps = run.stamps().await?;
    let mut component = None;
    // Poses that are known in the frame, by the sequence numbers of their scans.
    let known: Vec<(u64, Pose2)> = match frame {
        Frame::Odom => Vec::new(),
        Frame::Run => {
            let keyframes = run.stored_keyframes().await?;
            keyframes.iter().map(|keyframe| (keyframe.scan_seq, keyframe.run_from_robot)).collect()
        }
        Frame::Map => {
            let map = site.map(version).await?;
            let in_map = map.record.run(run.idx).ok_or_else(|| not_in(run, &map.record))?;
            component = Some(in_map.component);
            let poses = map.poses(in_map).await?;
            poses.iter().map(|pose| (pose.scan_seq, pose.map_from_robot)).collect()
        }
    };
    Ok(Trajectory { component, poses: spread(&stamps, &known) })
}

/// A map version from before a run.
pub(super) fn not_in(run: &Run, map: &MapRecord) -> AppError {
    let detail = format!("the run `{}` came after map version {}", run.record.name, map.version);
    AppError::NotReady { detail }
}

/// A pose for every scan, from odometry and the poses of some scans.
fn spread(stamps: &[(i64, Pose2)], known: &[(u64, Pose2)]) -> Vec<StampedPose> {
    let placed = known.iter().filter_map(|&(scan_seq, map_from_robot)| {
        let (_, run_from_robot) = *stamps.get(usize::try_from(scan_seq).ok()?)?;
        Some(PlacedKeyframe { scan_seq, run_from_robot, map_from_robot })
    });
    let run: RunTrajectory = placed.collect();
    let pose = |(scan_seq, &(timestamp_ns, odom_from_robot)): (u64, &(i64, Pose2))| {
        let frame_from_robot = run.at(scan_seq, &odom_from_robot).unwrap_or(odom_from_robot);
        StampedPose { scan_seq, timestamp_ns, frame_from_robot }
    };
    (0..).zip(stamps).map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(num: usize) -> Vec<(i64, Pose2)> {
        (0..num).map(|i| (i as i64, Pose2::new(i as f64, 0.0, 0.0))).collect()
    }

    #[test]
    fn without_known_poses_odometry_is_served() {
        let stamps = straight(3);
        let poses = spread(&stamps, &[]);
        assert!(poses.iter().zip(&stamps).all(|(pose, stamp)| pose.frame_from_robot == stamp.1));
    }

    #[test]
    fn every_scan_has_a_pose_with_its_number_and_time() {
        let poses = spread(&straight(4), &[(1, Pose2::new(5.0, 0.0, 0.0))]);
        let told: Vec<_> = poses.iter().map(|pose| (pose.scan_seq, pose.timestamp_ns)).collect();
        assert_eq!(told, [(0, 0), (1, 1), (2, 2), (3, 3)]);
        assert_eq!(poses[3].frame_from_robot, Pose2::new(7.0, 0.0, 0.0));
    }
}
