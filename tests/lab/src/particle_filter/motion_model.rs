//! The odometry motion model: a step is a turn, a drive and a turn, each with noise (Probabilistic Robotics,
//! section 5.4).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use pulp::{Arch, Simd, WithSimd};
use rand::Rng;
use serde::{Deserialize, Serialize};

use super::noise::Noise;
use super::particles::Particles;
use crate::turns::{sin_cos_turns, wrap_turns};
use locution_engine::config_error::ConfigError;
use locution_engine::geometry::{Pose2, wrap_angle};

/// Noise of the odometry; variances per squared radian or squared metre of the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryMotionModel {
    /// α₁: variance of a turn by turning.
    pub alpha1: f64,
    /// α₂: variance of a turn by driving, rad²/m².
    pub alpha2: f64,
    /// α₃: variance of the distance by driving.
    pub alpha3: f64,
    /// α₄: variance of the distance by turning, m²/rad².
    pub alpha4: f64,
}

impl Default for OdometryMotionModel {
    fn default() -> Self {
        Self { alpha1: 0.02, alpha2: 0.005, alpha3: 0.02, alpha4: 0.005 }
    }
}

/// A step as the model sees it, with standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    first_turn: f32,
    drive_m: f32,
    second_turn: f32,
    first_turn_sd: f32,
    drive_sd_m: f32,
    second_turn_sd: f32,
}

impl OdometryMotionModel {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that is negative or not finite.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let fields = [
            ("alpha1", self.alpha1),
            ("alpha2", self.alpha2),
            ("alpha3", self.alpha3),
            ("alpha4", self.alpha4),
        ];
        for (name, value) in fields {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must be finite and not negative"));
            }
        }
        Ok(())
    }

    /// Moves every particle by the odometry step `previous_from_robot`, with noise of its own.
    pub(super) fn predict(&self, particles: &mut Particles, previous_from_robot: &Pose2, rng: &mut impl Rng) {
        let step = self.step(previous_from_robot);
        let noises = std::array::from_fn(|_| Noise::new(rng));
        Arch::new().dispatch(Prediction { step, noises, particles });
    }

    /// Splits a step into turn, drive and turn; a robot that backs up turns little, not by half a circle.
    fn step(&self, previous_from_robot: &Pose2) -> Step {
        /// Below this the direction of the drive is noise.
        const STANDING_M: f64 = 0.01;
        let drive = previous_from_robot.x.hypot(previous_from_robot.y);
        let bearing = previous_from_robot.y.atan2(previous_from_robot.x);
        let (first, signed_drive) = match drive {
            d if d < STANDING_M => (0.0, previous_from_robot.x),
            _ if bearing.abs() > FRAC_PI_2 => (wrap_angle(bearing + PI), -drive),
            _ => (bearing, drive),
        };
        let second = wrap_angle(previous_from_robot.theta - first);
        let turn_sd = |turn: f64| (self.alpha1 * turn * turn + self.alpha2 * drive * drive).sqrt();
        let turns_squared = first * first + second * second;
        let turns = |angle: f64| (angle / TAU) as f32;
        Step {
            first_turn: turns(first),
            drive_m: signed_drive as f32,
            second_turn: turns(second),
            first_turn_sd: turns(turn_sd(first)),
            drive_sd_m: (self.alpha3 * drive * drive + self.alpha4 * turns_squared).sqrt() as f32,
            second_turn_sd: turns(turn_sd(second)),
        }
    }
}

/// A step of all particles, a loop for the widest vectors at hand.
struct Prediction<'a> {
    step: Step,
    noises: [Noise; 3],
    particles: &'a mut Particles,
}

impl WithSimd for Prediction<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { step, noises: [first, drive, second], particles } = self;
        let Particles { x_m, y_m, heading_turns, .. } = particles;
        for (index, ((x, y), heading)) in (0..).zip(x_m.iter_mut().zip(y_m).zip(heading_turns)) {
            let towards = wrap_turns(*heading + step.first_turn + step.first_turn_sd * first.normal(index));
            let drive_m = step.drive_m + step.drive_sd_m * drive.normal(index);
            let (sin, cos) = sin_cos_turns(towards);
            *x += drive_m * cos;
            *y += drive_m * sin;
            *heading = wrap_turns(towards + step.second_turn + step.second_turn_sd * second.normal(index));
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use locution_engine::geometry::Point2;

    fn moved(model: &OdometryMotionModel, start: &Pose2, step: &Pose2, count: usize) -> Vec<Pose2> {
        let origin = Point2::new(-20.0, 5.0);
        let mut particles = Particles::default();
        (0..count).for_each(|_| particles.push(start, &origin));
        model.predict(&mut particles, step, &mut ChaCha8Rng::seed_from_u64(1));
        (0..count).map(|index| particles.pose(index, &origin)).collect()
    }

    #[test]
    fn without_noise_a_step_is_a_composition() {
        let still = OdometryMotionModel { alpha1: 0.0, alpha2: 0.0, alpha3: 0.0, alpha4: 0.0 };
        let start = Pose2::new(3.0, 9.0, 2.8);
        for step in [Pose2::new(0.3, 0.1, 0.5), Pose2::new(-0.4, 0.05, -0.2), Pose2::new(0.0, 0.0, 1.0)] {
            let expected = start.compose(&step);
            for pose in moved(&still, &start, &step, 11) {
                assert!(pose.distance(&expected) < 1e-4, "{pose:?} is not {expected:?}");
                assert!(wrap_angle(pose.theta - expected.theta).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn noise_has_the_stated_deviation() {
        let model = OdometryMotionModel { alpha1: 0.0, alpha2: 0.0, alpha3: 0.04, alpha4: 0.0 };
        let poses = moved(&model, &Pose2::identity(), &Pose2::new(1.0, 0.0, 0.0), 4001);
        let mean = poses.iter().map(|pose| pose.x).sum::<f64>() / poses.len() as f64;
        let variance = poses.iter().map(|pose| (pose.x - mean).powi(2)).sum::<f64>() / poses.len() as f64;
        assert!(
            (mean - 1.0).abs() < 0.02 && (variance.sqrt() - 0.2).abs() < 0.02,
            "{mean} ± {}",
            variance.sqrt()
        );
    }
}
