//! Configuration of this room.

use serde::{Deserialize, Serialize};

use crate::config::ConfigError;

/// How places are retrieved by their density profiles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RetrievalConfig {
    /// Distance of travel between samples of a profile, metres (SPEC section 4).
    pub sample_spacing_m: f64,
    /// Length of the compared windows, metres (SPEC section 4: 6–12).
    pub window_m: f64,
    /// Distance between the starts of consecutive query windows, metres.
    pub query_step_m: f64,
    /// Candidates kept for each query window and direction.
    pub candidates_per_direction: usize,
    /// Two candidates of one window and direction whose starts lie closer than this along the travel are one place.
    pub suppression_m: f64,
    /// Travel that must lie between a window and its candidate in the same run, metres.
    pub min_gap_m: f64,
}

impl Default for RetrievalConfig {
    fn default() -> Self {
        Self {
            sample_spacing_m: 0.25,
            window_m: 8.0,
            query_step_m: 1.0,
            candidates_per_direction: 10,
            suppression_m: 2.0,
            min_gap_m: 10.0,
        }
    }
}

impl RetrievalConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first field that cannot work, by its path.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let positive = [
            ("sample_spacing_m", self.sample_spacing_m),
            ("window_m", self.window_m),
            ("query_step_m", self.query_step_m),
            ("suppression_m", self.suppression_m),
        ];
        for (field, value) in positive {
            if !(value > 0.0 && value < 1000.0) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must lie in (0, 1000) m"));
            }
        }
        if !(0.0..1e6).contains(&self.min_gap_m) {
            return Err(ConfigError::new(format!("{path}.min_gap_m"), "must lie in [0, 1000000) m"));
        }
        if self.window_m < self.sample_spacing_m {
            return Err(ConfigError::new(format!("{path}.window_m"), "must hold at least one sample"));
        }
        if self.candidates_per_direction == 0 {
            return Err(ConfigError::new(format!("{path}.candidates_per_direction"), "must be at least 1"));
        }
        Ok(())
    }

    /// A length of travel as a number of samples, at least one.
    pub(super) fn num_samples(&self, length_m: f64) -> usize {
        ((length_m / self.sample_spacing_m).round() as usize).max(1)
    }
}
