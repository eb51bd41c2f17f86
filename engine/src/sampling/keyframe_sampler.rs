//! Keyframes: the scans that registration and the pose graph work with.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{OdometryNoise, SamplingConfig};
use crate::geometry::{Pose2, angle_between};

/// What the translator knows of a keyframe; the readings stay with the scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyframePose {
    /// Sequence number of the scan.
    pub scan_seq: u64,
    /// Timestamp of the scan, nanoseconds.
    pub timestamp_ns: i64,
    /// Raw odometry.
    pub odom_from_robot: Pose2,
    /// Pose in the run's frame.
    pub run_from_robot: Pose2,
    /// Covariance of the motion since the previous keyframe, (x, y, θ) in that keyframe's axes, row by row; the first
    /// keyframe of a run has no motion to speak of.
    pub motion_covariance: [[f64; 3]; 3],
}

/// Chooses keyframes by distance and turn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyframeSampler {
    config: SamplingConfig,
    latest: Option<Pose2>,
    previous: Option<Pose2>,
    /// Driven and turned since the latest keyframe, metres and radians.
    driven_m: f64,
    turned_rad: f64,
}

impl KeyframeSampler {
    /// A sampler that has seen nothing. The config must have passed its check.
    pub fn new(config: &SamplingConfig) -> Self {
        Self { config: config.clone(), latest: None, previous: None, driven_m: 0.0, turned_rad: 0.0 }
    }

    /// Moves on to the pose of the next scan; returns its motion covariance if it makes a keyframe.
    pub fn drive(&mut self, odom_from_robot: &Pose2) -> Option<[[f64; 3]; 3]> {
        if let Some(previous) = self.previous.replace(*odom_from_robot) {
            self.driven_m += previous.distance(odom_from_robot);
            self.turned_rad += angle_between(odom_from_robot.theta, previous.theta);
        }
        let is_keyframe = self.latest.is_none_or(|latest| {
            latest.distance(odom_from_robot) >= self.config.keyframe_distance_m
                || angle_between(odom_from_robot.theta, latest.theta) >= self.config.keyframe_turn_rad
        });
        if !is_keyframe {
            return None;
        }
        let covariance = self.config.odometry_noise.covariance(self.driven_m, self.turned_rad);
        (self.latest, self.driven_m, self.turned_rad) = (Some(*odom_from_robot), 0.0, 0.0);
        Some(covariance)
    }
}

impl OdometryNoise {
    /// Covariance of a motion that drove and turned so much, (x, y, θ), row by row.
    pub fn covariance(&self, driven_m: f64, turned_rad: f64) -> [[f64; 3]; 3] {
        let position = self.floor_m + self.translation_per_m * driven_m;
        let heading =
            self.floor_rad + self.rotation_rad_per_m * driven_m + self.rotation_per_rad * turned_rad;
        Matrix3::from_diagonal(&Vector3::new(position * position, position * position, heading * heading))
            .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keyframes_come_by_distance_or_turn() {
        let mut sampler = KeyframeSampler::new(&SamplingConfig::default());
        let mut is_keyframe = |x: f64, theta: f64| sampler.drive(&Pose2::new(x, 0.0, theta)).is_some();
        assert!(is_keyframe(0.0, 0.0));
        assert!(!is_keyframe(0.15, 0.0));
        assert!(is_keyframe(0.21, 0.0));
        assert!(!is_keyframe(0.21, 0.1));
        assert!(is_keyframe(0.21, 0.2));
    }
}
