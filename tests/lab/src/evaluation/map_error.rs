//! Error of a map against hand-verified relative poses, as the Freiburg SLAM benchmark defines it
//! (Kümmerle et al. 2009).

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::summary::MeanSd;
use locution_engine::formats::Relation;
use locution_engine::geometry::Pose2;

/// Where the map says the robot was at one scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedPose {
    /// Timestamp of the scan, exactly as in its log.
    pub timestamp_ns: i64,
    /// Connected part of the map; poses of different parts have no relation to each other.
    pub component: u64,
    /// In the part's frame.
    pub map_from_robot: Pose2,
}

/// Mean and spread of (estimated relative pose) ⊖ (given) over all relations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapErrorReport {
    /// Relations that were judged.
    pub relations: usize,
    /// Relations that name a moment without a scan, or moments of two parts of the map.
    pub skipped: usize,
    /// Length of the translational difference, metres.
    pub translation_m: MeanSd,
    /// Size of the rotational difference, degrees.
    pub rotation_deg: MeanSd,
}

/// Judges estimated poses against relations.
pub fn judge_map(poses: &[EstimatedPose], relations: &[Relation]) -> MapErrorReport {
    let mut by_timestamp: HashMap<i64, &EstimatedPose> = HashMap::new();
    for pose in poses {
        by_timestamp.entry(pose.timestamp_ns).or_insert(pose);
    }
    let (mut translations_m, mut rotations_deg) = (Vec::new(), Vec::new());
    for relation in relations {
        let (first, second) = (by_timestamp.get(&relation.first_ns), by_timestamp.get(&relation.second_ns));
        let (Some(first), Some(second)) = (first, second) else { continue };
        if first.component != second.component {
            continue;
        }
        let estimated = first.map_from_robot.between(&second.map_from_robot);
        let difference = relation.first_from_second.between(&estimated);
        translations_m.push(difference.x.hypot(difference.y));
        rotations_deg.push(difference.theta.abs().to_degrees());
    }
    MapErrorReport {
        relations: translations_m.len(),
        skipped: relations.len() - translations_m.len(),
        translation_m: MeanSd::of(&translations_m),
        rotation_deg: MeanSd::of(&rotations_deg),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_taken_in_the_robots_frame() {
        let pose = |timestamp_ns, component, x, y, theta| EstimatedPose {
            timestamp_ns,
            component,
            map_from_robot: Pose2::new(x, y, theta),
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        let poses = [pose(1, 0, 5.0, 5.0, quarter), pose(2, 0, 5.0, 6.5, 0.0), pose(3, 1, 0.0, 0.0, 0.0)];
        let relation = |first_ns, second_ns, x, y, theta| Relation {
            first_ns,
            second_ns,
            first_from_second: Pose2::new(x, y, theta),
        };
        let relations = [
            relation(1, 2, 1.0, 0.0, -quarter),
            relation(2, 1, 0.0, -1.5, quarter - 0.1),
            relation(1, 3, 0.0, 0.0, 0.0),
            relation(1, 9, 0.0, 0.0, 0.0),
        ];
        let report = judge_map(&poses, &relations);
        assert_eq!((report.relations, report.skipped), (2, 2));
        assert!(
            (report.translation_m.mean - 0.25).abs() < 1e-12
                && (report.translation_m.sd - 0.25).abs() < 1e-12
        );
        assert!((report.rotation_deg.mean - 0.05f64.to_degrees()).abs() < 1e-9);
    }
}
