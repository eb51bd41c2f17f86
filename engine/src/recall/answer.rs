//! From places with log odds to the answer: probabilities over all sites asked, "not here" among them, and a state.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::calibration::Calibration;
use super::config::RecallConfig;
use super::place_index::FoundPlace;

/// Whether a robot, or the place of a recording, is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocalizationState {
    /// No place of the map explains what is seen, or nothing has been seen yet.
    #[default]
    Lost,
    /// Several places do, or one does not well enough.
    Ambiguous,
    /// One place does, and no other.
    Converged,
}

/// A place where a recording may have been made.
#[derive(Clone, Debug, PartialEq)]
pub struct AnsweredPlace {
    /// What was found.
    pub found: FoundPlace,
    /// Probability that it was made there, over all sites asked.
    pub probability: f64,
}

/// The answer of one site.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExampleAnswer {
    /// Whether the recording was made here.
    pub state: LocalizationState,
    /// Likeliest first.
    pub places: Vec<AnsweredPlace>,
    /// Probability that it was not made in this site.
    pub probability_elsewhere: f64,
}

/// Gives the places of all sites asked their probabilities, which compete with one another and with being nowhere; the
/// answers are in the order of the sites.
pub fn settle(found_by_site: Vec<Vec<FoundPlace>>, config: &RecallConfig) -> Vec<ExampleAnswer> {
    let log_odds: Vec<f64> = found_by_site.iter().flatten().map(|found| found.log_odds).collect();
    let mut probabilities = Calibration::probabilities(&log_odds).into_iter();
    let mut answer = |found: Vec<FoundPlace>| {
        let with_probability = |(found, probability)| AnsweredPlace { found, probability };
        let mut places: Vec<AnsweredPlace> =
            found.into_iter().zip(&mut probabilities).map(with_probability).collect();
        let here: f64 = places.iter().map(|place| place.probability).sum();
        let is_sure = places.first().is_some_and(|best| {
            best.probability >= config.sure_probability
                && worst_sd_m(&best.found.covariance) <= config.sure_sd_max_m
        });
        let state = match (is_sure, here > 0.5) {
            (true, _) => LocalizationState::Converged,
            (false, true) => LocalizationState::Ambiguous,
            (false, false) => LocalizationState::Lost,
        };
        places.retain(|place| place.probability >= config.min_probability);
        places.truncate(config.max_places);
        ExampleAnswer { state, places, probability_elsewhere: (1.0 - here).max(0.0) }
    };
    found_by_site.into_iter().map(&mut answer).collect()
}

/// Standard deviation of a pose in its worst direction, metres.
pub fn worst_sd_m(covariance: &Matrix3<f64>) -> f64 {
    let (xx, xy, yy) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
    (0.5 * (xx + yy) + (0.5 * (xx - yy)).hypot(xy)).sqrt()
}
