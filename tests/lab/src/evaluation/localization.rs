//! Outcome of many localisations from power-on (issue of "where am I").

use serde::{Deserialize, Serialize};

use super::summary::{quantile, share};
use locution_engine::geometry::{Pose2, angle_between};

/// Nearer than this is found.
const FOUND_M: f64 = 0.5;
/// A heading closer than this is found.
const FOUND_DEG: f64 = 10.0;

/// One localisation, from a random moment of a recording until it was sure or the driving ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalizationTrial {
    /// The pose that was answered when the answer was sure.
    pub answered: Option<Pose2>,
    /// The true pose at that moment.
    pub truth: Pose2,
    /// Metres driven until then.
    pub driven_m: f64,
}

/// What one localisation came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrialOutcome {
    /// Sure, and right.
    Found,
    /// Sure, and wrong.
    WronglySure,
    /// Never sure.
    HonestlyUnsure,
}

/// Metres driven until sure, over the trials that were found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MetersToConverge {
    /// Half of them needed no more; `None` when nothing was found.
    pub median: Option<f64>,
    /// Nine of ten needed no more.
    pub p90: Option<f64>,
}

/// Shares of all trials, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LocalizationReport {
    /// Number of trials.
    pub trials: usize,
    /// Sure, and within 0.5 m and 10°.
    pub found: f64,
    /// Sure, and not.
    pub wrongly_sure: f64,
    /// Never sure.
    pub honestly_unsure: f64,
    /// How long it took.
    #[serde(rename = "metres_to_converge")]
    pub meters_to_converge: MetersToConverge,
}

impl LocalizationTrial {
    /// What it came to.
    pub fn outcome(&self) -> TrialOutcome {
        let Some(answered) = self.answered else { return TrialOutcome::HonestlyUnsure };
        let turned_deg = angle_between(answered.theta, self.truth.theta).to_degrees();
        if answered.distance(&self.truth) <= FOUND_M && turned_deg <= FOUND_DEG {
            TrialOutcome::Found
        } else {
            TrialOutcome::WronglySure
        }
    }
}

/// Judges all trials.
pub fn judge_localization(trials: &[LocalizationTrial]) -> LocalizationReport {
    let of = |outcome| trials.iter().filter(move |trial| trial.outcome() == outcome);
    let driven_m: Vec<f64> = of(TrialOutcome::Found).map(|trial| trial.driven_m).collect();
    LocalizationReport {
        trials: trials.len(),
        found: share(driven_m.len(), trials.len()),
        wrongly_sure: share(of(TrialOutcome::WronglySure).count(), trials.len()),
        honestly_unsure: share(of(TrialOutcome::HonestlyUnsure).count(), trials.len()),
        meters_to_converge: MetersToConverge {
            median: quantile(&driven_m, 0.5),
            p90: quantile(&driven_m, 0.9),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_trials_three_outcomes() {
        let truth = Pose2::new(1.0, 1.0, 3.1);
        let trial = |answered, driven_m| LocalizationTrial { answered, truth, driven_m };
        let report = judge_localization(&[
            trial(Some(Pose2::new(1.3, 1.0, -3.1)), 6.0),
            trial(Some(Pose2::new(1.3, 1.0, 2.8)), 7.0),
            trial(None, 20.0),
            trial(Some(truth), 8.0),
        ]);
        assert_eq!((report.trials, report.found), (4, 0.5));
        assert_eq!((report.wrongly_sure, report.honestly_unsure), (0.25, 0.25));
        assert_eq!(report.meters_to_converge, MetersToConverge { median: Some(6.0), p90: Some(8.0) });
    }
}
