//! What sampling can be told.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;

/// When observations and keyframes are taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SamplingConfig {
    /// Travel from one observation to the next, metres (thesis 6.2.1).
    pub observation_spacing_m: f64,
    /// Observations are made at the place the robot was this much travel ago, when the local map is complete around
    /// it on all sides (SPEC section 4), metres; 0 observes at once.
    pub delay_m: f64,
    /// Odometry that wanders by less than this is standing still, metres.
    pub standstill_m: f64,
    /// A longer step between two scans is a jump of the odometry, not travel to be observed, metres.
    pub jump_m: f64,
    /// Distance from one keyframe to the next, metres.
    pub keyframe_distance_m: f64,
    /// Turn that makes a keyframe even without travel, radians.
    pub keyframe_turn_rad: f64,
    /// How wrong odometry is.
    pub odometry_noise: OdometryNoise,
}

/// Standard deviations of a motion by odometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryNoise {
    /// Of the position, metres per metre driven.
    pub translation_per_m: f64,
    /// Of the heading, radians per metre driven.
    pub rotation_rad_per_m: f64,
    /// Of the heading, radians per radian turned.
    pub rotation_per_rad: f64,
    /// Of the position of any motion, however small, metres.
    pub floor_m: f64,
    /// Of the heading of any motion, radians.
    pub floor_rad: f64,
}

impl Default for SamplingConfig {
    fn default() -> Self {
        Self {
            observation_spacing_m: 0.1,
            delay_m: 3.0,
            standstill_m: 0.02,
            jump_m: 5.0,
            keyframe_distance_m: 0.2,
            keyframe_turn_rad: 10.0 / 180.0 * PI,
            odometry_noise: OdometryNoise::default(),
        }
    }
}

impl Default for OdometryNoise {
    fn default() -> Self {
        Self {
            translation_per_m: 0.1,
            rotation_rad_per_m: 0.05,
            rotation_per_rad: 0.1,
            floor_m: 0.005,
            floor_rad: 0.005,
        }
    }
}

impl SamplingConfig {
    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let noise = &self.odometry_noise;
        for (field, value, lowest, highest) in [
            ("observation_spacing_m", self.observation_spacing_m, 0.01, 10.0),
            ("delay_m", self.delay_m, 0.0, 100.0),
            ("standstill_m", self.standstill_m, 0.0, self.observation_spacing_m),
            ("jump_m", self.jump_m, self.observation_spacing_m, 1000.0),
            ("keyframe_distance_m", self.keyframe_distance_m, 0.01, 10.0),
            ("keyframe_turn_rad", self.keyframe_turn_rad, 0.01, PI),
            ("odometry_noise.translation_per_m", noise.translation_per_m, 0.0, 10.0),
            ("odometry_noise.rotation_rad_per_m", noise.rotation_rad_per_m, 0.0, 10.0),
            ("odometry_noise.rotation_per_rad", noise.rotation_per_rad, 0.0, 10.0),
            ("odometry_noise.floor_m", noise.floor_m, 1e-6, 10.0),
            ("odometry_noise.floor_rad", noise.floor_rad, 1e-6, PI),
        ] {
            if !(lowest..=highest).contains(&value) {
                return Err(ConfigError::new(
                    format!("{path}.{field}"),
                    format!("must lie in {lowest}..={highest}"),
                ));
            }
        }
        Ok(())
    }
}
