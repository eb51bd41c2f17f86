//! Settings of a localisation session.

use serde::{Deserialize, Serialize};

use super::global_search::GlobalSearchConfig;
use crate::config_error::ConfigError;
use crate::recall::{NUM_FIT_FEATURES, fit_features};
use crate::registration::{AreaFit, RefinerConfig};

/// How a session judges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalizerConfig {
    /// Refinement of the odometry.
    pub refiner: RefinerConfig,
    /// Search over the whole map.
    pub search: GlobalSearchConfig,
    /// Scans of this much travel are searched for together, metres.
    pub surroundings_m: f64,
    /// Points of them at most.
    pub max_search_points: usize,
    /// Travel between searches while the place is not known, metres.
    pub search_every_m: f64,
    /// Scans of this much travel are the evidence, metres.
    pub history_m: f64,
    /// Points of a scan used as evidence, at most.
    pub max_points: usize,
    /// Beams are evidence up to this length, metres: only far walls say how far along a corridor the robot is.
    pub range_max_m: f64,
    /// Surroundings up to this distance are searched for, metres.
    pub search_range_m: f64,
    /// What a whole scan of agreement is worth, natural logarithm; scans overlap, so less than a beam's likelihood.
    pub evidence_per_scan: f64,
    /// Agreement that a place off the map would show by chance.
    pub agreement_elsewhere: f64,
    /// Travel between questions by example while the place is not known, metres.
    pub recall_every_m: f64,
    /// Travel between judgements of the best places, metres.
    pub judge_every_m: f64,
    /// The last metres that decide whether a place still fits.
    pub recent_m: f64,
    /// Agreement of these with the map, both ways, below which it does not.
    pub recent_agreement_min: f64,
    /// Share of these about which the map must have an opinion.
    pub recent_coverage_min: f64,
    /// Judgements in a row that say so before the place is given up.
    pub num_contradictions_max: usize,
    /// Weights of what speaks for and against a place: how the last metres lie in the map
    /// ([`fit_features`](crate::recall::fit_features)), and ten units of how far its followed pose lags behind the best.
    pub weights: [f64; NUM_FIT_FEATURES + 1],
    /// Nobody is sure of a pose that can slide farther than this, one standard deviation, metres.
    pub sure_sd_max_m: f64,
    /// Travel without which nobody can be sure, metres.
    pub min_travel_m: f64,
    /// Probability from which on the robot may be found …
    pub sure_probability: f64,
    /// … once one place has had at least this probability …
    pub leading_probability: f64,
    /// … for this much travel, metres: look-alikes lead for a moment, not for long.
    pub sure_for_m: f64,
}

impl Default for LocalizerConfig {
    fn default() -> Self {
        Self {
            refiner: RefinerConfig::default(),
            search: GlobalSearchConfig::default(),
            surroundings_m: 8.0,
            max_search_points: 250,
            search_every_m: 1.5,
            history_m: 25.0,
            max_points: 80,
            range_max_m: 20.0,
            search_range_m: 12.0,
            evidence_per_scan: 3.0,
            agreement_elsewhere: 0.6,
            recall_every_m: 3.0,
            judge_every_m: 0.5,
            recent_m: 1.0,
            recent_agreement_min: 0.75,
            recent_coverage_min: 0.4,
            num_contradictions_max: 2,
            weights: [-7.47, -1.84, -1.98, 0.0, 2.03, 0.0, 0.90, 1.09],
            sure_sd_max_m: 0.5,
            min_travel_m: 3.0,
            sure_probability: 0.99,
            leading_probability: 0.9,
            sure_for_m: 2.0,
        }
    }
}

impl LocalizerConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let lengths = [
            ("surroundings_m", self.surroundings_m),
            ("search_every_m", self.search_every_m),
            ("history_m", self.history_m),
            ("range_max_m", self.range_max_m),
            ("search_range_m", self.search_range_m),
            ("evidence_per_scan", self.evidence_per_scan),
            ("sure_for_m", self.sure_for_m),
            ("recall_every_m", self.recall_every_m),
            ("judge_every_m", self.judge_every_m),
            ("recent_m", self.recent_m),
            ("sure_sd_max_m", self.sure_sd_max_m),
        ];
        for (name, value) in lengths {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must be above 0 and finite"));
            }
        }
        let shares = [
            ("agreement_elsewhere", self.agreement_elsewhere),
            ("recent_agreement_min", self.recent_agreement_min),
            ("recent_coverage_min", self.recent_coverage_min),
            ("sure_probability", self.sure_probability),
            ("leading_probability", self.leading_probability),
        ];
        for (name, value) in shares {
            if !(0.0..=1.0).contains(&value) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must lie in 0..=1"));
            }
        }
        if self.max_points == 0 || self.max_search_points == 0 {
            return Err(ConfigError::new(
                format!("{path}.max_points"),
                "and max_search_points must be above 0",
            ));
        }
        if self.num_contradictions_max == 0 {
            return Err(ConfigError::new(format!("{path}.num_contradictions_max"), "must be above 0"));
        }
        if !self.weights.iter().all(|weight| weight.is_finite()) {
            return Err(ConfigError::new(format!("{path}.weights"), "must be finite"));
        }
        self.search.validate(&format!("{path}.search"))?;
        self.refiner.validate(&format!("{path}.refiner"))
    }

    /// Logarithm of the odds of a place against being nowhere in the map.
    pub(super) fn log_odds(&self, fit: &AreaFit, lag: f64) -> f64 {
        let by_fit: f64 =
            self.weights.iter().zip(fit_features(fit)).map(|(weight, feature)| weight * feature).sum();
        by_fit + self.weights[NUM_FIT_FEATURES] * lag / 10.0
    }

    /// Whether what was seen last can have been seen there.
    pub(super) fn accepts_recent(&self, fit: &AreaFit) -> bool {
        fit.agreement() >= self.recent_agreement_min && fit.coverage >= self.recent_coverage_min
    }
}
