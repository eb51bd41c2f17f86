//! A pose for every scan, in the frame asked for.
//!
//! Poses are known at some scans only (keyframes); `RunTrajectory` says how odometry fills what lies between.

use locution_engine::geometry::Pose2;
use locution_engine::recording::{PlacedKeyframe, RunTrajectory};

use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{Map, MapRecord, MapRun, MapVersion, Run};

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
    /// One for every scan, in order; in the map frame those of the pieces that lie in the component.
    pub poses: Vec<StampedPose>,
}

/// The trajectory of a run; `version` and `component` count in the map frame only, where the component is that of the
/// first piece of the run unless said.
///
/// # Errors
/// [`AppError::NotReady`] in the map frame before the first build, [`AppError::NotFound`] when no piece of the run lies in
/// the component; those of the storage.
pub async fn trajectory(
    site: &Site,
    run: &Run,
    frame: Frame,
    version: Option<MapVersion>,
    component: Option<u32>,
) -> Result<Trajectory, AppError> {
    if frame == Frame::Map {
        let map = site.map(version).await?;
        let pieces: Vec<&MapRun> = map.record.pieces_of(run.idx).collect();
        let first = pieces.first().ok_or_else(|| not_in(run, &map.record))?;
        let component = component.unwrap_or(first.component);
        let mut poses = Vec::new();
        for piece in pieces.into_iter().filter(|piece| piece.component == component) {
            poses.extend(trajectory_of(&map, piece, run).await?);
        }
        if poses.is_empty() {
            return Err(AppError::not_found("component", component));
        }
        return Ok(Trajectory { component: Some(component), poses });
    }
    let stamps = run.stamps().await?;
    // Poses that are known in the frame, by the sequence numbers of their scans.
    let known: Vec<(u64, Pose2)> = match frame {
        Frame::Run => {
            let keyframes = run.stored_keyframes().await?;
            keyframes.iter().map(|keyframe| (keyframe.scan_seq, keyframe.run_from_robot)).collect()
        }
        Frame::Odom | Frame::Map => Vec::new(),
    };
    let mut ends: Vec<u64> = run.cuts().await?.iter().map(|cut| cut.scan_seq).collect();
    ends.push(stamps.len() as u64);
    let mut poses = Vec::with_capacity(stamps.len());
    for end in ends {
        let scans = poses.len() as u64..end;
        let of_piece: Vec<(u64, Pose2)> =
            known.iter().filter(|(scan_seq, _)| scans.contains(scan_seq)).copied().collect();
        poses.extend(spread(scans.start, &stamps[scans.start as usize..end as usize], &of_piece));
    }
    Ok(Trajectory { component: None, poses })
}

/// Where a run, or a piece of one, was in a map: a pose for every scan of it. What a run has gone on since the map was
/// built carries its last piece on.
///
/// # Errors
/// Those of the storage.
pub async fn trajectory_of(map: &Map, piece: &MapRun, run: &Run) -> Result<Vec<StampedPose>, AppError> {
    let known: Vec<(u64, Pose2)> =
        map.poses(piece).await?.iter().map(|pose| (pose.scan_seq, pose.map_from_robot)).collect();
    let stamps = run.stamps().await?;
    let next_cut = run.cuts().await?.iter().map(|cut| cut.scan_seq).find(|seq| *seq > piece.first_scan);
    let end = next_cut.unwrap_or(stamps.len() as u64);
    let of_piece = stamps.get(piece.first_scan as usize..end as usize).unwrap_or_default();
    Ok(spread(piece.first_scan, of_piece, &known))
}

/// A map version from before a run.
pub(super) fn not_in(run: &Run, map: &MapRecord) -> AppError {
    let detail = format!("the run `{}` came after map version {}", run.record.name, map.version);
    AppError::NotReady { detail }
}

/// A pose for every scan from number `first` on, from odometry and the poses of some of them.
fn spread(first: u64, stamps: &[(i64, Pose2)], known: &[(u64, Pose2)]) -> Vec<StampedPose> {
    let placed = known.iter().filter_map(|&(scan_seq, map_from_robot)| {
        let (_, run_from_robot) = *stamps.get(usize::try_from(scan_seq.checked_sub(first)?).ok()?)?;
        Some(PlacedKeyframe { scan_seq, run_from_robot, map_from_robot })
    });
    let run: RunTrajectory = placed.collect();
    let pose = |(scan_seq, &(timestamp_ns, odom_from_robot)): (u64, &(i64, Pose2))| {
        let frame_from_robot = run.at(scan_seq, &odom_from_robot).unwrap_or(odom_from_robot);
        StampedPose { scan_seq, timestamp_ns, frame_from_robot }
    };
    (first..).zip(stamps).map(pose).collect()
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
        let poses = spread(0, &stamps, &[]);
        assert!(poses.iter().zip(&stamps).all(|(pose, stamp)| pose.frame_from_robot == stamp.1));
    }

    #[test]
    fn every_scan_has_a_pose_with_its_number_and_time() {
        let poses = spread(5, &straight(4), &[(6, Pose2::new(5.0, 0.0, 0.0))]);
        let told: Vec<_> = poses.iter().map(|pose| (pose.scan_seq, pose.timestamp_ns)).collect();
        assert_eq!(told, [(5, 0), (6, 1), (7, 2), (8, 3)]);
        assert_eq!(poses[3].frame_from_robot, Pose2::new(7.0, 0.0, 0.0));
    }
}
