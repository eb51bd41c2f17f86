//! Where a recording was driven in a map: one answer for every scan, whoever asks.
//!
//! The map knows poses at keyframes only. Between two of them the run's own motion is carried on from the earlier, and
//! what is left over at the later is spread evenly over the scans between; beyond the ends it is carried on as it is:
//!
//! ```text
//! own motion      k0 ───────·───────·──────── k1          keyframes, two scans between
//! carried         K0 ───────·───────·──────── +           from the map's pose of k0
//! served          K0 ───────o──────o───────── K1          a third and two thirds of the way from + to K1
//! ```
//!
//! So the way has no step at a keyframe, whatever the graph did to it.

use crate::geometry::{Pose2, wrap_angle};

/// A keyframe in a run's own frame and in the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedKeyframe {
    /// Sequence number of its scan.
    pub scan_seq: u64,
    /// Its pose by the run's own motion.
    pub run_from_robot: Pose2,
    /// Its pose in the map.
    pub map_from_robot: Pose2,
}

/// A run's keyframes in a map, in order of their scans.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunTrajectory {
    keyframes: Vec<PlacedKeyframe>,
}

impl FromIterator<PlacedKeyframe> for RunTrajectory {
    /// The keyframes must come in ascending order of their scans.
    fn from_iter<I: IntoIterator<Item = PlacedKeyframe>>(keyframes: I) -> Self {
        Self { keyframes: keyframes.into_iter().collect() }
    }
}

impl RunTrajectory {
    /// Where the robot was in the map at a scan at which its own motion had brought it to `run_from_robot`; `None`
    /// without keyframes. O(log keyframes).
    pub fn at(&self, scan_seq: u64, run_from_robot: &Pose2) -> Option<Pose2> {
        let next = self.keyframes.partition_point(|keyframe| keyframe.scan_seq <= scan_seq);
        let Some(before) = next.checked_sub(1).map(|idx| &self.keyframes[idx]) else {
            return Some(carry(self.keyframes.first()?, run_from_robot));
        };
        let carried = carry(before, run_from_robot);
        let Some(after) = self.keyframes.get(next) else { return Some(carried) };
        let carried_after = carry(before, &after.run_from_robot);
        let share = (scan_seq - before.scan_seq) as f64 / (after.scan_seq - before.scan_seq) as f64;
        let left_rad = wrap_angle(after.map_from_robot.theta - carried_after.theta);
        Some(Pose2::new(
            carried.x + share * (after.map_from_robot.x - carried_after.x),
            carried.y + share * (after.map_from_robot.y - carried_after.y),
            carried.theta + share * left_rad,
        ))
    }
}

/// The keyframe's pose in the map moved on by the run's own motion.
fn carry(keyframe: &PlacedKeyframe, run_from_robot: &Pose2) -> Pose2 {
    keyframe.map_from_robot.compose(&keyframe.run_from_robot.between(run_from_robot))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn keyframe(scan_seq: u64, run_from_robot: Pose2, map_from_robot: Pose2) -> PlacedKeyframe {
        PlacedKeyframe { scan_seq, run_from_robot, map_from_robot }
    }

    /// One metre a scan along x.
    fn straight(scan_seq: u64) -> Pose2 {
        Pose2::new(scan_seq as f64, 0.0, 0.0)
    }

    #[test]
    fn without_keyframes_nothing_is_known() {
        assert_eq!(RunTrajectory::default().at(3, &straight(3)), None);
    }

    #[test]
    fn keyframes_keep_their_poses_and_the_rest_is_spread_between_them() {
        let placed = [(1, Pose2::new(0.0, 0.0, 0.0)), (3, Pose2::new(2.0, 1.0, 0.0))];
        let run: RunTrajectory =
            placed.iter().map(|(seq, pose)| keyframe(*seq, straight(*seq), *pose)).collect();
        let poses: Vec<Pose2> = (0..6).map(|seq| run.at(seq, &straight(seq)).unwrap()).collect();
        assert_eq!(poses[0], Pose2::new(-1.0, 0.0, 0.0));
        assert_eq!(poses[1], placed[0].1);
        assert_eq!(poses[2], Pose2::new(1.0, 0.5, 0.0));
        assert_eq!(poses[3], placed[1].1);
        assert_eq!(poses[5], Pose2::new(4.0, 1.0, 0.0));
    }

    fn any_pose() -> impl Strategy<Value = Pose2> {
        (-50.0..50.0f64, -50.0..50.0f64, -3.0..3.0f64).prop_map(|(x, y, theta)| Pose2::new(x, y, theta))
    }

    proptest! {
        #[test]
        fn a_map_that_only_moves_the_run_moves_every_scan_with_it(
            map_from_run in any_pose(),
            steps in proptest::collection::vec((any_pose(), any::<bool>()), 1..30),
        ) {
            let own: Vec<Pose2> = steps.iter().map(|(pose, _)| *pose).collect();
            let run: RunTrajectory = (0..)
                .zip(&steps)
                .filter(|(seq, (_, is_keyframe))| *seq == 0 || *is_keyframe)
                .map(|(seq, (pose, _))| keyframe(seq, *pose, map_from_run.compose(pose)))
                .collect();
            for (seq, pose) in (0..).zip(&own) {
                let (found, expected) = (run.at(seq, pose).unwrap(), map_from_run.compose(pose));
                prop_assert!(found.distance(&expected) < 1e-9);
                prop_assert!(wrap_angle(found.theta - expected.theta).abs() < 1e-9);
            }
        }
    }
}
