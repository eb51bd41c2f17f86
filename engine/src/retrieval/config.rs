//! Configuration of this room.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;

/// How places are retrieved by their density profiles.
///
/// Window lengths and the cut-off were chosen by hand with `intel`, `aces`, `mit-killian` and `wean1/3/4` in view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RetrievalConfig {
    /// Distance of travel between samples of a profile, metres (SPEC section 4).
    pub sample_spacing_m: f64,
    /// Lengths of the compared windows, metres: short ones find brief revisits, long ones tell corridors apart.
    pub windows_m: Vec<f64>,
    /// Distance between the centres of consecutive query windows, metres.
    pub query_step_m: f64,
    /// Candidates kept for each centre, window length and direction.
    pub candidates_per_window: usize,
    /// Two candidates of one centre and direction closer than this along the travel are one place, metres.
    pub suppression_m: f64,
    /// Travel that must lie between a window and its candidate in the same run, metres.
    pub min_gap_m: f64,
    /// Densities that differ by more than this differ altogether: a door or a person costs no more, in (0, 1].
    pub largest_difference: f64,
}

impl Default for RetrievalConfig {
    fn default() -> Self {
        Self {
            sample_spacing_m: 0.25,
            windows_m: vec![5.0, 10.0, 20.0],
            query_step_m: 1.0,
            candidates_per_window: 4,
            suppression_m: 2.0,
            min_gap_m: 10.0,
            largest_difference: 0.05,
        }
    }
}

impl RetrievalConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first field that cannot work, by its path.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let mut lengths = vec![
            ("sample_spacing_m", self.sample_spacing_m),
            ("query_step_m", self.query_step_m),
            ("suppression_m", self.suppression_m),
        ];
        lengths.extend(self.windows_m.iter().map(|&window_m| ("windows_m", window_m)));
        for (field, value) in lengths {
            if !(value > 0.0 && value < 1000.0) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must lie in (0, 1000) m"));
            }
        }
        if self.windows_m.is_empty() {
            return Err(ConfigError::new(format!("{path}.windows_m"), "needs at least one length"));
        }
        if !(0.0..1e6).contains(&self.min_gap_m) {
            return Err(ConfigError::new(format!("{path}.min_gap_m"), "must lie in [0, 1000000) m"));
        }
        if self.candidates_per_window == 0 {
            return Err(ConfigError::new(format!("{path}.candidates_per_window"), "must be at least 1"));
        }
        if !(self.largest_difference > 0.0 && self.largest_difference <= 1.0) {
            return Err(ConfigError::new(format!("{path}.largest_difference"), "must lie in (0, 1]"));
        }
        Ok(())
    }

    /// A length of travel as a number of samples, at least one.
    pub(super) fn num_samples(&self, length_m: f64) -> usize {
        ((length_m / self.sample_spacing_m).round() as usize).max(1)
    }

    /// The largest difference in steps of a profile's values, at least one.
    pub(super) fn largest_step(&self) -> u8 {
        (self.largest_difference * 255.0).round().clamp(1.0, 255.0) as u8
    }
}
