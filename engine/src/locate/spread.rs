//! How sharply a pose is determined: the covariance of the likelihood around it.

use super::served_map::ServedMap;
use crate::geometry::{Point2, Pose2};

/// Covariance of (x, y, θ) in the map's axes, row by row, from the likelihood of `points` (in the robot's frame) on a
/// lattice of poses around `map_from_robot`: wide along a plain corridor, narrow where walls meet.
pub(super) fn covariance_around(map: &ServedMap, points: &[Point2], map_from_robot: &Pose2) -> [[f64; 3]; 3] {
    /// Steps of the lattice.
    const STEP_M: f64 = 0.1;
    const STEP_RAD: f64 = 0.02;
    let unit = map.likelihood.unit_of_evidence() * points.len() as f64;
    let offsets: Vec<[f64; 3]> = (0..7 * 7 * 5)
        .map(|k| {
            let (x, y, turn) = (k % 7 - 3, k / 7 % 7 - 3, k / 49 - 2);
            [f64::from(x) * STEP_M, f64::from(y) * STEP_M, f64::from(turn) * STEP_RAD]
        })
        .collect();
    let scores: Vec<f64> = offsets
        .iter()
        .map(|[x, y, turn]| {
            let pose = Pose2::new(map_from_robot.x + x, map_from_robot.y + y, map_from_robot.theta + turn);
            unit * map.likelihood.mean_code(points, &pose)
        })
        .collect();
    let best = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = scores.iter().map(|score| (score - best).exp()).collect();
    let total: f64 = weights.iter().sum();
    let mut covariance = [[0.0; 3]; 3];
    for (row, entries) in covariance.iter_mut().enumerate() {
        for (column, entry) in entries.iter_mut().enumerate() {
            let moment: f64 =
                weights.iter().zip(&offsets).map(|(weight, off)| weight * off[row] * off[column]).sum();
            *entry = moment / total;
        }
        // The lattice cannot see below its own step.
        let step: f64 = if row == 2 { STEP_RAD } else { STEP_M };
        entries[row] += step * step / 12.0;
    }
    covariance
}
