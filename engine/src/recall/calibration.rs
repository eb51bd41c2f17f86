//! From evidence to probability: a logistic model whose weights were fitted to real recordings.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::registration::AreaFit;

/// Numbers that say how a recording lies in a map.
pub const NUM_FIT_FEATURES: usize = 7;
/// Numbers that a place is judged by: those, and what proposed it.
pub const NUM_FEATURES: usize = NUM_FIT_FEATURES + 2;

/// How a recording lies in a map, in numbers of the order of one: one, what the two contradict of each other, how much
/// of the recording the map knows, how exactly they fit, how far the recording saw beyond the map, how much there is.
pub fn fit_features(fit: &AreaFit) -> [f64; NUM_FIT_FEATURES] {
    [
        1.0,
        logit(fit.contradicted),
        logit(fit.contradicts),
        logit(fit.coverage),
        logit(fit.exact),
        logit(fit.beyond),
        (f64::from(fit.num_opinions) / 1_000.0).max(0.01).ln(),
    ]
}

/// Logarithm of the odds of a share, within bounds.
fn logit(share: f64) -> f64 {
    let share = share.clamp(0.002, 0.998);
    (share / (1.0 - share)).ln()
}

/// What speaks for and against a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceEvidence {
    /// Score of the best window's profile: standard deviations below the mean difference.
    pub profile_score: f64,
    /// Sum of the scores of all windows that propose this place.
    pub profile_support: f64,
    /// How alike the best window's profile is, in [0, 1].
    pub resemblance: f64,
    /// Share of the highest worth that the search found.
    pub search_share: f64,
    /// How the recording lies there.
    pub fit: AreaFit,
}

impl PlaceEvidence {
    /// The numbers that the model weighs, each of the order of one.
    pub fn features(&self) -> [f64; NUM_FEATURES] {
        let mut features = [0.0; NUM_FEATURES];
        features[..NUM_FIT_FEATURES].copy_from_slice(&fit_features(&self.fit));
        features[NUM_FIT_FEATURES..].copy_from_slice(&[logit(self.search_share), self.resemblance]);
        features
    }
}

/// Weights of a multinomial logistic model: every place against being nowhere in the map.
///
/// The defaults were fitted to pieces of the second halves of `mit-killian`, `aces` and `intel` in the maps of their
/// first halves, and to pieces of other buildings there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Calibration {
    /// One weight for each feature.
    pub weights: [f64; NUM_FEATURES],
}

impl Default for Calibration {
    fn default() -> Self {
        Self { weights: [-10.0, -1.8, -1.8, 0.0, 0.0, 0.0, 0.0, 0.5, 1.1] }
    }
}

impl Calibration {
    /// Checks every value; `path` is this struct's own path.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let is_fine = self.weights.iter().all(|weight| weight.is_finite());
        is_fine.then_some(()).ok_or_else(|| ConfigError::new(format!("{path}.weights"), "must be finite"))
    }

    /// Logarithm of the odds of a place against being nowhere in the map.
    pub fn log_odds(&self, evidence: &PlaceEvidence) -> f64 {
        self.weights.iter().zip(evidence.features()).map(|(weight, feature)| weight * feature).sum()
    }

    /// Probabilities of places by their log odds; what is missing to 1 is that of being nowhere.
    pub fn probabilities(log_odds: &[f64]) -> Vec<f64> {
        let best = log_odds.iter().copied().fold(0.0, f64::max);
        let weights: Vec<f64> = log_odds.iter().map(|odds| (odds - best).exp()).collect();
        let total = weights.iter().sum::<f64>() + (-best).exp();
        weights.iter().map(|weight| weight / total).collect()
    }
}
