//! Places anything of a run in the map: nearest keyframe, then the run's own odometry.

use super::run::{Keyframe, RunRecord};
use super::site_map::MappedRun;
use crate::geometry::Pose2;

/// Pose in the map of whatever the run saw at scan `scan_seq` from `run_from_robot`; none for a run without keyframes.
///
/// The keyframe at or before the scan carries it: its pose in the map, then the run's own motion since.
pub fn place_in_map(
    keyframes: &[Keyframe],
    mapped: &MappedRun,
    scan_seq: u64,
    run_from_robot: &Pose2,
) -> Option<Pose2> {
    let after = keyframes.partition_point(|keyframe| keyframe.scan_seq <= scan_seq);
    let index = after.saturating_sub(1);
    let keyframe = keyframes.get(index)?;
    let map_from_keyframe = mapped.map_from_keyframes.get(index)?;
    Some(map_from_keyframe.compose(&keyframe.run_from_robot.between(run_from_robot)))
}

/// Poses in the map of all observations of a run, in order.
pub fn place_observations(run: &RunRecord<'_>, mapped: &MappedRun) -> Vec<Pose2> {
    run.observations
        .iter()
        .map(|observation| {
            place_in_map(run.keyframes, mapped, observation.scan_seq, &observation.run_from_robot)
                .unwrap_or(observation.run_from_robot)
        })
        .collect()
}
