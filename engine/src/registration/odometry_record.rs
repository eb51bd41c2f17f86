//! What the odometry of a run has been worth so far.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::geometry::{Pose2, wrap_angle};

/// Weight that older motions keep from one keyframe to the next.
const MEMORY: f64 = 0.995;
/// Squared travel that is taken to have been right before anything was driven, square metres.
const GOOD_FAITH_M2: f64 = 1.0;
/// Distances are never corrected by more than this factor, either way.
const SCALE_MAX: f64 = 2.0;

/// Distance and heading of the odometry compared with what registration found, motion by motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct OdometryRecord {
    told_m2: f64,
    excess_m2: f64,
    /// Information about headings may come where there is none about distances.
    turn_told_m2: f64,
    turn_excess: f64,
    /// Probability that the odometry lies now.
    pub doubt: f64,
    /// Found travel during which odometry has not moved at all, metres.
    pub mute_m: f64,
    /// True once it has.
    has_moved: bool,
}

/// Odometry that has not moved for this much travel is none, metres.
const MUTE_M: f64 = 0.4;

impl OdometryRecord {
    /// A motion as odometry told it, with its errors so far taken out.
    pub fn corrected(&self, told: &Pose2) -> Pose2 {
        let scale = 1.0 + self.excess_m2 / (self.told_m2 + GOOD_FAITH_M2);
        let scale = scale.clamp(1.0 / SCALE_MAX, SCALE_MAX);
        let length_m = told.x.hypot(told.y);
        let turn = length_m * self.turn_excess / (self.turn_told_m2 + GOOD_FAITH_M2);
        Pose2::new(told.x * scale, told.y * scale, told.theta + turn)
    }

    /// How far odometry is believed, by what it did before this step.
    pub fn belief(&self, step: &Pose2) -> f64 {
        let is_still = *step == Pose2::identity();
        let ceiling = match (is_still, self.has_moved) {
            (true, _) if self.mute_m > MUTE_M => 0.01,
            (true, false) => 0.5,
            _ => 1.0,
        };
        (1.0 - self.doubt).min(ceiling)
    }

    /// True when a step says nothing because there is no odometry, or none any more.
    pub fn is_mute(&self, step: &Pose2) -> bool {
        *step == Pose2::identity() && (self.mute_m > MUTE_M || !self.has_moved)
    }

    /// Takes note of a step of the odometry and of what was found instead.
    pub fn witness(&mut self, step: &Pose2, found: &Pose2) {
        if *step == Pose2::identity() {
            self.mute_m += found.x.hypot(found.y);
        } else {
            (self.mute_m, self.has_moved) = (0.0, true);
        }
    }

    /// Takes note of a motion between keyframes: as told, as found, and the information of (x, y, θ) that the scan
    /// alone and the prior alone have of it, in the axes of the motion.
    pub fn learn(&mut self, told: &Pose2, found: &Pose2, by_scan: &Matrix3<f64>, by_prior: &Matrix3<f64>) {
        let length_m = told.x.hypot(told.y);
        if length_m < 0.02 {
            return;
        }
        let (cos, sin) = (told.x / length_m, told.y / length_m);
        let along = nalgebra::Vector3::new(cos, sin, 0.0);
        let of = |information: &Matrix3<f64>| (along.transpose() * information * along)[0];
        let share = |scan: f64, prior: f64| scan.max(0.0) / (scan.max(0.0) + prior + 1e-9);
        let driven_m = found.x * cos + found.y * sin;
        let turned = wrap_angle(found.theta - told.theta);
        // What is further off is a fault of the moment, not a habit.
        if (driven_m - length_m).abs() > 0.4 * length_m + 0.02 || turned.abs() > 0.4 * length_m + 0.02 {
            return;
        }
        let weight = share(of(by_scan), of(by_prior));
        self.told_m2 = MEMORY * self.told_m2 + weight * length_m * length_m;
        self.excess_m2 = MEMORY * self.excess_m2 + weight * length_m * (driven_m - length_m);
        let weight = share(by_scan[(2, 2)], by_prior[(2, 2)]);
        self.turn_told_m2 = MEMORY * self.turn_told_m2 + weight * length_m * length_m;
        self.turn_excess = MEMORY * self.turn_excess + weight * length_m * turned;
    }
}
