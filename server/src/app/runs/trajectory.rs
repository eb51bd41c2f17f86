//! A pose for every scan, in the frame asked for.
//!
//! The engine knows poses at some scans only (keyframes). Between two of them the odometry is carried on from the
//! earlier, and what is left over at the later is spread linearly over the scans between; beyond the ends the odometry
//! is carried on as it is.

use locution_engine::geometry::{Pose2, wrap_angle};

use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{MapVersion, Run};

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
    let anchors = match frame {
        Frame::Odom => Vec::new(),
        Frame::Run => {
            let keyframes = run.stored_keyframes().await?;
            keyframes.iter().map(|keyframe| (keyframe.scan_seq, keyframe.run_from_robot)).collect()
        }
        Frame::Map => {
            let map = site.map(version).await?;
            let in_map = map.record.run(run.idx).ok_or_else(|| AppError::NotReady {
                detail: format!(
                    "the run `{}` came after map version {}",
                    run.record.name, map.record.version
                ),
            })?;
            component = Some(in_map.component);
            let poses = map.poses(in_map).await?;
            poses.iter().map(|pose| (pose.scan_seq, pose.map_from_robot)).collect()
        }
    };
    Ok(Trajectory { component, poses: spread(&stamps, &anchors) })
}

/// A pose for every scan from odometry and the known poses of some scans, in order of their sequence numbers.
pub fn spread(stamps: &[(i64, Pose2)], anchors: &[(u64, Pose2)]) -> Vec<StampedPose> {
    let mut poses = Vec::with_capacity(stamps.len());
    let mut next_anchor = 0;
    for (scan_idx, &(timestamp_ns, odom_from_robot)) in stamps.iter().enumerate() {
        let scan_seq = scan_idx as u64;
        while anchors.get(next_anchor).is_some_and(|(anchor_seq, _)| *anchor_seq <= scan_seq) {
            next_anchor += 1;
        }
        let before = next_anchor.checked_sub(1).map(|idx| anchors[idx]);
        let after = anchors.get(next_anchor).copied();
        let frame_from_robot = match (before, after) {
            (None, None) => odom_from_robot,
            (Some(anchor), None) | (None, Some(anchor)) => carry(stamps, anchor, odom_from_robot),
            (Some(before), Some(after)) => between(stamps, before, after, scan_seq, odom_from_robot),
        };
        poses.push(StampedPose { scan_seq, timestamp_ns, frame_from_robot });
    }
    poses
}

/// The anchor moved on by odometry.
fn carry(stamps: &[(i64, Pose2)], anchor: (u64, Pose2), odom_from_robot: Pose2) -> Pose2 {
    let Some((_, odom_from_anchor)) = stamps.get(anchor.0 as usize) else { return anchor.1 };
    anchor.1.compose(&odom_from_anchor.between(&odom_from_robot))
}

fn between(
    stamps: &[(i64, Pose2)],
    before: (u64, Pose2),
    after: (u64, Pose2),
    scan_seq: u64,
    odom_from_robot: Pose2,
) -> Pose2 {
    let Some((_, odom_at_after)) = stamps.get(after.0 as usize) else { return before.1 };
    let carried = carry(stamps, before, odom_from_robot);
    let carried_after = carry(stamps, before, *odom_at_after);
    let share = (scan_seq - before.0) as f64 / (after.0 - before.0) as f64;
    Pose2::new(
        carried.x + share * (after.1.x - carried_after.x),
        carried.y + share * (after.1.y - carried_after.y),
        carried.theta + share * wrap_angle(after.1.theta - carried_after.theta),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(num: usize) -> Vec<(i64, Pose2)> {
        (0..num).map(|i| (i as i64, Pose2::new(i as f64, 0.0, 0.0))).collect()
    }

    #[test]
    fn without_anchors_odometry_is_served() {
        let stamps = straight(3);
        let poses = spread(&stamps, &[]);
        assert!(poses.iter().zip(&stamps).all(|(pose, stamp)| pose.frame_from_robot == stamp.1));
    }

    #[test]
    fn anchors_are_kept_and_the_rest_is_spread() {
        let stamps = straight(6);
        let anchors = [(1, Pose2::new(0.0, 0.0, 0.0)), (3, Pose2::new(2.0, 1.0, 0.0))];
        let poses: Vec<Pose2> = spread(&stamps, &anchors).iter().map(|pose| pose.frame_from_robot).collect();
        assert_eq!(poses[0], Pose2::new(-1.0, 0.0, 0.0));
        assert_eq!(poses[1], anchors[0].1);
        assert_eq!(poses[2], Pose2::new(1.0, 0.5, 0.0));
        assert_eq!(poses[3], anchors[1].1);
        assert_eq!(poses[5], Pose2::new(4.0, 1.0, 0.0));
    }
}
