//! What ties a place to a map whose poses change: the keyframes around it.
//!
//! A point that a person draws lies between walls, and what knows where those walls are now are the scans that saw them. So
//! a point moves as the keyframes near it moved, the nearer the more, and so does every other point that is to outlive the
//! map in which it was given.

use serde::{Deserialize, Serialize};

use crate::geometry::{Point2, Pose2};

/// Points are anchored to keyframes of so many runs, so that they hold when one of those is deleted.
const NUM_RUNS_MAX: usize = 4;
/// So many points of a long line get anchors of their own; the others lie between.
const NUM_POINTS_MAX: usize = 32;
/// Within this distance all keyframes count about the same, metres.
const NEAR_M: f64 = 0.5;

/// A keyframe with its pose in the map in which something was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// Number of its run in the site.
    pub run_idx: u32,
    /// Sequence number of its scan in the run.
    pub scan_seq: u64,
    /// Where it was then.
    pub map_from_robot: Pose2,
}

/// A keyframe's pose in one map and in another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovedPose {
    /// In the map from which points are carried.
    pub from: Pose2,
    /// In the map into which.
    pub to: Pose2,
}

/// The keyframes that are to carry some points: for each point the nearest of each of the nearest runs. They come in the
/// order of runs and scans.
pub fn anchors_near(points: &[Point2], keyframes: &[Anchor]) -> Vec<Anchor> {
    let step = points.len().div_ceil(NUM_POINTS_MAX).max(1);
    let mut anchors: Vec<Anchor> = Vec::new();
    for point in points.iter().step_by(step) {
        let distance = |anchor: &Anchor| anchor.map_from_robot.position().distance(point);
        let mut nearest: Vec<(f64, &Anchor)> = Vec::new();
        for anchor in keyframes {
            let (away_m, last) = (distance(anchor), nearest.last_mut());
            match last {
                Some(best) if best.1.run_idx == anchor.run_idx => {
                    if away_m < best.0 {
                        *best = (away_m, anchor);
                    }
                }
                _ => nearest.push((away_m, anchor)),
            }
        }
        nearest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.run_idx.cmp(&b.1.run_idx)));
        anchors.extend(nearest.into_iter().take(NUM_RUNS_MAX).map(|(_, anchor)| *anchor));
    }
    anchors.sort_by_key(|anchor| (anchor.run_idx, anchor.scan_seq));
    anchors.dedup_by_key(|anchor| (anchor.run_idx, anchor.scan_seq));
    anchors
}

/// Where a point of one map lies in another: the mean of where each keyframe takes it, by inverse squared distance. `None`
/// without keyframes.
pub fn carry_point(point: &Point2, keyframes: &[MovedPose]) -> Option<Point2> {
    let (mut sum, mut weights) = (Point2::default(), 0.0);
    for moved in keyframes {
        let robot_from_point = moved.from.inverse().transform_point(point);
        let carried = moved.to.transform_point(&robot_from_point);
        let weight = 1.0 / (NEAR_M * NEAR_M + robot_from_point.x.powi(2) + robot_from_point.y.powi(2));
        sum = Point2::new(sum.x + weight * carried.x, sum.y + weight * carried.y);
        weights += weight;
    }
    (weights > 0.0).then(|| Point2::new(sum.x / weights, sum.y / weights))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(run_idx: u32, y: f64) -> impl Iterator<Item = Anchor> {
        (0..50).map(move |step| Anchor {
            run_idx,
            scan_seq: 10 * step,
            map_from_robot: Pose2::new(0.2 * step as f64, y, 0.0),
        })
    }

    #[test]
    fn the_nearest_keyframe_of_each_run_carries() {
        let keyframes: Vec<Anchor> = (0..6).flat_map(|run_idx| drive(run_idx, f64::from(run_idx))).collect();
        let anchors = anchors_near(&[Point2::new(4.02, 5.3)], &keyframes);
        let chosen: Vec<(u32, u64)> =
            anchors.iter().map(|anchor| (anchor.run_idx, anchor.scan_seq)).collect();
        assert_eq!(chosen, [(2, 200), (3, 200), (4, 200), (5, 200)]);
        assert!(anchors_near(&[Point2::default()], &[]).is_empty());
    }

    #[test]
    fn a_point_moves_with_a_map_that_moves_and_bends() {
        let point = Point2::new(5.0, 1.0);
        let shift = Pose2::new(3.0, -2.0, 0.7);
        let moved: Vec<MovedPose> = drive(0, 0.0)
            .map(|anchor| MovedPose {
                from: anchor.map_from_robot,
                to: shift.compose(&anchor.map_from_robot),
            })
            .collect();
        let carried = carry_point(&point, &moved).unwrap();
        assert!(carried.distance(&shift.transform_point(&point)) < 1e-9);
        // One end of the corridor moved by a meter, the other stayed: what is near an end goes with it.
        let bent = |at: &Point2| {
            let bend = |pose: Pose2| Pose2::new(pose.x, pose.y + if pose.x > 5.0 { 1.0 } else { 0.0 }, 0.0);
            let moved: Vec<MovedPose> = drive(0, 0.0)
                .map(|anchor| MovedPose { from: anchor.map_from_robot, to: bend(anchor.map_from_robot) })
                .collect();
            carry_point(at, &moved).unwrap().y - at.y
        };
        assert!(bent(&Point2::new(0.5, 0.5)) < 0.1 && bent(&Point2::new(9.5, 0.5)) > 0.9);
        assert_eq!(carry_point(&point, &[]), None);
    }
}
