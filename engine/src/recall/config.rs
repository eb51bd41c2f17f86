//! Settings of this room.

use serde::{Deserialize, Serialize};

use super::calibration::Calibration;
use crate::config_error::ConfigError;
use crate::registration::SubmapConfig;
use crate::retrieval::RetrievalConfig;

/// How a short recording is looked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecallConfig {
    /// Proposals by profiles.
    pub retrieval: RetrievalConfig,
    /// The recording's submap and its registration.
    pub submap: SubmapConfig,
    /// Only the last so many metres of a recording are used.
    pub length_max_m: f64,
    /// At most this many scans make its submap.
    pub max_scans: usize,
    /// Half width of the search around a proposal, metres …
    pub search_half_m: f64,
    /// … and radians.
    pub search_half_turn_rad: f64,
    /// Two proposals closer than this, metres …
    pub same_place_m: f64,
    /// … and than this, radians, are one.
    pub same_place_rad: f64,
    /// Proposals around which a sketch of the recording is searched, the best first.
    pub max_sketched: usize,
    /// Of these the ones around which its whole outline is searched.
    pub max_searched: usize,
    /// Of these the ones that are aligned and judged.
    pub max_aligned: usize,
    /// Places answered at most.
    pub max_places: usize,
    /// Places less probable are not answered.
    pub min_probability: f64,
    /// Probability from which on a place is the answer …
    pub sure_probability: f64,
    /// … unless its pose can slide farther than this, one standard deviation, metres.
    pub sure_sd_max_m: f64,
    /// From evidence to probability.
    pub calibration: Calibration,
}

impl Default for RecallConfig {
    fn default() -> Self {
        Self {
            retrieval: RetrievalConfig {
                windows_m: vec![5.0, 10.0, 20.0],
                query_step_m: 1.0,
                candidates_per_window: 12,
                ..RetrievalConfig::default()
            },
            submap: SubmapConfig { radius_m: 16.0, ..SubmapConfig::default() },
            length_max_m: 25.0,
            max_scans: 60,
            search_half_m: 2.0,
            search_half_turn_rad: 0.3,
            same_place_m: 1.5,
            same_place_rad: 0.3,
            max_sketched: 60,
            max_searched: 8,
            max_aligned: 4,
            max_places: 5,
            min_probability: 0.01,
            sure_probability: 0.9,
            sure_sd_max_m: 0.5,
            calibration: Calibration::default(),
        }
    }
}

impl RecallConfig {
    /// Checks every value; `path` is this struct's own path.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.retrieval.validate(&format!("{path}.retrieval"))?;
        self.submap.validate(&format!("{path}.submap"))?;
        let positive = [
            ("length_max_m", self.length_max_m),
            ("search_half_m", self.search_half_m),
            ("search_half_turn_rad", self.search_half_turn_rad),
            ("same_place_m", self.same_place_m),
            ("same_place_rad", self.same_place_rad),
            ("sure_sd_max_m", self.sure_sd_max_m),
        ];
        for (field, value) in positive {
            if !(value > 0.0 && value < 100.0) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must lie in (0, 100)"));
            }
        }
        let counts = [
            ("max_scans", self.max_scans),
            ("max_sketched", self.max_sketched),
            ("max_searched", self.max_searched),
            ("max_aligned", self.max_aligned),
            ("max_places", self.max_places),
        ];
        for (field, value) in counts {
            if !(1..=10_000).contains(&value) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must lie in 1..=10000"));
            }
        }
        for (field, value) in
            [("min_probability", self.min_probability), ("sure_probability", self.sure_probability)]
        {
            if !(0.0..=1.0).contains(&value) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must lie in [0, 1]"));
            }
        }
        self.calibration.validate(&format!("{path}.calibration"))
    }
}
