//! Settings of the optimiser.

use serde::{Deserialize, Serialize};

use crate::config::ConfigError;

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
        if !(self.relative_gain_min >= 0.0 && self.relative_gain_min < 1.0) {
            return Err(ConfigError::new(format!("{path}.relative_gain_min"), "must be in [0, 1)"));
        }
        if self.poor_start_chi2.is_nan() || self.poor_start_chi2 < 0.0 {
            return Err(ConfigError::new(format!("{path}.poor_start_chi2"), "must be at least 0"));
        }
        Ok(())
    }
}
