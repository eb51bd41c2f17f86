//! Settings of the optimiser.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;

/// Where the optimisation begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// At the poses of the graph.
    Given,
    /// At the chordal initialisation: rotations from a linear relaxation, then positions.
    Chordal,
    /// At the poses of the graph, unless their cost is poor and the chordal start costs less.
    #[default]
    Best,
}

/// How steps are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Full steps. The cost may rise before it falls, which large loops need; should it run away, the damped
    /// variant goes on from the best poses seen.
    #[default]
    GaussNewton,
    /// Steps damped by Marquardt's rule: the cost never rises.
    LevenbergMarquardt,
}

/// Settings of [`super::optimize`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseGraphConfig {
    /// Where the optimisation begins.
    pub start: Start,
    /// How steps are taken.
    pub method: Method,
    /// Largest number of linear solves, at least 1.
    pub max_iterations: u32,
    /// Stop when χ² changes by less than this share of itself.
    pub relative_gain_min: f64,
    /// With `Start::Best`, a start whose χ² per redundant measurement is above this counts as poor. Right
    /// covariances at the optimum give 1.
    pub poor_start_chi2: f64,
}

impl Default for PoseGraphConfig {
    fn default() -> Self {
        Self {
            start: Start::default(),
            method: Method::default(),
            max_iterations: 100,
            relative_gain_min: 1e-6,
            poor_start_chi2: 10.0,
        }
    }
}

impl PoseGraphConfig {
    /// Checks every value; `path` is prefixed to the name of the offending field.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if self.max_iterations == 0 {
            return Err(ConfigError::new(format!("{path}.max_iterations"), "must be at least 1"));
        }
        if !(0.0..1.0).contains(&self.relative_gain_min) {
            return Err(ConfigError::new(format!("{path}.relative_gain_min"), "must be in [0, 1)"));
        }
        if self.poor_start_chi2.is_nan() || self.poor_start_chi2 < 0.0 {
            return Err(ConfigError::new(format!("{path}.poor_start_chi2"), "must be at least 0"));
        }
        Ok(())
    }
}

/// How constraints that may be wrong are weighed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// All constraints count fully.
    None,
    /// Graduated non-convexity with truncated least squares (Yang et al. 2020).
    #[default]
    GraduatedNonConvexity,
    /// Dynamic covariance scaling (Agarwal et al. 2013).
    DynamicCovarianceScaling,
}

/// Settings of [`super::optimize_robust`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobustConfig {
    /// How constraints that may be wrong are weighed.
    pub kernel: Kernel,
    /// A doubtful constraint is right if its χ² is at most this; three degrees of freedom exceed 16.27 once in a
    /// thousand.
    pub inlier_chi2_max: f64,
    /// Factor by which graduated non-convexity sharpens its kernel from one step to the next, above 1.
    pub sharpening: f64,
    /// Largest number of reweighted linear solves.
    pub max_reweightings: u32,
    /// Two doubtful constraints back each other when their ends are at most this many consecutive poses apart and
    /// the cycle over both closes; 0 makes all of them equal.
    pub support_steps_max: u32,
}

impl Default for RobustConfig {
    fn default() -> Self {
        Self {
            kernel: Kernel::default(),
            inlier_chi2_max: 16.27,
            sharpening: 1.4,
            max_reweightings: 200,
            support_steps_max: 20,
        }
    }
}

impl RobustConfig {
    /// Checks every value; `path` is prefixed to the name of the offending field.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(self.inlier_chi2_max > 0.0 && self.inlier_chi2_max.is_finite()) {
            return Err(ConfigError::new(format!("{path}.inlier_chi2_max"), "must be positive"));
        }
        if !(self.sharpening > 1.0 && self.sharpening.is_finite()) {
            return Err(ConfigError::new(format!("{path}.sharpening"), "must be above 1"));
        }
        if self.max_reweightings == 0 {
            return Err(ConfigError::new(format!("{path}.max_reweightings"), "must be at least 1"));
        }
        Ok(())
    }
}
