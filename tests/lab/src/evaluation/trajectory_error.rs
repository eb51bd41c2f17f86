//! Error of a whole trajectory against the truth, after the rigid motion that fits best.

use serde::{Deserialize, Serialize};

use super::summary::MeanSd;
use locution_engine::geometry::{Pose2, angle_between};

/// How far estimated poses are from true ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryError {
    /// Pairs of poses compared.
    pub poses: usize,
    /// Distance between the positions, metres.
    pub translation_m: MeanSd,
    /// Angle between the headings, degrees.
    pub rotation_deg: MeanSd,
    /// Largest distance, metres.
    pub translation_max_m: f64,
}

/// Compares pairs of (estimated, true) poses of one connected part of a map, after moving the estimate as a whole to
/// where the squared distances of the positions are least.
pub fn judge_trajectory(pairs: &[(Pose2, Pose2)]) -> TrajectoryError {
    let truth_from_map = best_fit(pairs);
    let moved: Vec<(Pose2, Pose2)> =
        pairs.iter().map(|(estimated, truth)| (truth_from_map.compose(estimated), *truth)).collect();
    let translations_m: Vec<f64> = moved.iter().map(|(estimated, truth)| estimated.distance(truth)).collect();
    let rotations_deg: Vec<f64> = moved
        .iter()
        .map(|(estimated, truth)| angle_between(estimated.theta, truth.theta).to_degrees())
        .collect();
    TrajectoryError {
        poses: pairs.len(),
        translation_m: MeanSd::of(&translations_m),
        rotation_deg: MeanSd::of(&rotations_deg),
        translation_max_m: translations_m.into_iter().fold(0.0, f64::max),
    }
}

/// Rotation and translation of the plane that bring the first points nearest to the second (least squares, closed
/// form).
fn best_fit(pairs: &[(Pose2, Pose2)]) -> Pose2 {
    if pairs.is_empty() {
        return Pose2::identity();
    }
    let num = pairs.len() as f64;
    let mean = |of: &dyn Fn(&(Pose2, Pose2)) -> f64| pairs.iter().map(of).sum::<f64>() / num;
    let (from_x, from_y) = (mean(&|pair| pair.0.x), mean(&|pair| pair.0.y));
    let (to_x, to_y) = (mean(&|pair| pair.1.x), mean(&|pair| pair.1.y));
    let (mut along, mut across) = (0.0, 0.0);
    for (from, to) in pairs {
        let ((fx, fy), (tx, ty)) = ((from.x - from_x, from.y - from_y), (to.x - to_x, to.y - to_y));
        along += fx * tx + fy * ty;
        across += fx * ty - fy * tx;
    }
    let theta = across.atan2(along);
    let (sin, cos) = theta.sin_cos();
    Pose2::new(to_x - cos * from_x + sin * from_y, to_y - sin * from_x - cos * from_y, theta)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_copy_has_no_error() {
        let motion = Pose2::new(3.0, -2.0, 2.5);
        let truth: Vec<Pose2> = (0..20)
            .map(|idx| Pose2::new(f64::from(idx), f64::from(idx * idx) * 0.1, 0.2 * f64::from(idx)))
            .collect();
        let pairs: Vec<(Pose2, Pose2)> = truth.iter().map(|pose| (motion.compose(pose), *pose)).collect();
        let error = judge_trajectory(&pairs);
        assert!(error.translation_max_m < 1e-9 && error.rotation_deg.mean < 1e-6, "{error:?}");
    }

    #[test]
    fn a_bent_copy_has_one() {
        let pairs: Vec<(Pose2, Pose2)> = (0..3)
            .map(|idx| {
                let x = f64::from(idx - 1);
                (Pose2::new(x, if idx == 1 { 0.3 } else { 0.0 }, 0.1), Pose2::new(x, 0.0, 0.0))
            })
            .collect();
        let error = judge_trajectory(&pairs);
        assert!((error.translation_max_m - 0.2).abs() < 1e-9 && error.poses == 3, "{error:?}");
        assert_eq!(judge_trajectory(&[]).poses, 0);
    }
}
