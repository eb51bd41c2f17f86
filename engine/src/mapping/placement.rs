//! Places the observations of a run in the map.

use super::run::{Keyframe, RunRecord};
use super::site_map::MappedRun;
use crate::geometry::Pose2;
use crate::recording::{PlacedKeyframe, RunTrajectory};

impl MappedRun {
    /// Where the run was in the map at any scan.
    pub fn trajectory(&self, keyframes: &[Keyframe]) -> RunTrajectory {
        let placed = keyframes.iter().zip(&self.map_from_keyframes);
        placed
            .map(|(keyframe, map_from_robot)| PlacedKeyframe {
                scan_seq: keyframe.scan_seq,
                run_from_robot: keyframe.run_from_robot,
                map_from_robot: *map_from_robot,
            })
            .collect()
    }
}

/// Poses in the map of all observations of a run, in order; those of a run without keyframes stay in its own frame.
pub fn place_observations(run: &RunRecord<'_>, mapped: &MappedRun) -> Vec<Pose2> {
    let trajectory = mapped.trajectory(run.keyframes);
    run.observations
        .iter()
        .map(|observation| {
            let own = observation.run_from_robot;
            trajectory.at(observation.scan_seq, &own).unwrap_or(own)
        })
        .collect()
}
