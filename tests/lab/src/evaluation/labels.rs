//! Confusion of place labels, per observation, with a tolerance where the true label changes (thesis section 6.3).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::summary::share;

/// Borders between places are not known better than this.
const BORDER_TOLERANCE_M: f64 = 1.0;

/// One observation with its true and its predicted label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabeledObservation<'a> {
    /// Distance driven since the run began, metres.
    pub travel_m: f64,
    /// What a person says; `None` where nobody has labelled.
    pub actual: Option<&'a str>,
    /// What was predicted; `None` where nothing was.
    pub predicted: Option<&'a str>,
}

/// How well one label was predicted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LabelScore {
    /// Right ones among the observations predicted so.
    pub precision: f64,
    /// Right ones among the observations that are so.
    pub recall: f64,
    /// Observations that are so.
    pub support: usize,
}

/// Confusion matrix and what follows from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LabelReport {
    /// Actual label → predicted label → observations.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Precision and recall of every label that occurs.
    pub labels: BTreeMap<String, LabelScore>,
}

impl LabelReport {
    /// What follows from a confusion matrix.
    pub fn of(confusion: BTreeMap<String, BTreeMap<String, usize>>) -> Self {
        let labels = confusion
            .keys()
            .map(|label| {
                let cell =
                    |actual: &str| confusion.get(actual).and_then(|row| row.get(label)).copied().unwrap_or(0);
                let num_right = cell(label);
                let num_predicted: usize = confusion.keys().map(|actual| cell(actual)).sum();
                let support: usize = confusion[label].values().sum();
                let score = LabelScore {
                    precision: share(num_right, num_predicted),
                    recall: share(num_right, support),
                    support,
                };
                (label.clone(), score)
            })
            .collect();
        Self { confusion, labels }
    }
}

/// Judges the observations of all runs; each run in order of travel.
///
/// A prediction within a metre of a change of the true label is right if it names either side: the border may lie
/// there. It counts as right for the label that the observation truly has, so that every label keeps its number of
/// observations, as in the thesis. Without a prediction the predicted label is `none`; observations without a true
/// label are left out.
pub fn judge_labels(runs: &[Vec<LabeledObservation<'_>>]) -> LabelReport {
    let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for run in runs {
        for (idx, observation) in run.iter().enumerate() {
            let Some(actual) = observation.actual else { continue };
            let predicted = observation.predicted.unwrap_or("none");
            let judged_as = if is_near(run, idx, predicted) { actual } else { predicted };
            let row = confusion.entry(actual.to_owned()).or_default();
            *row.entry(judged_as.to_owned()).or_default() += 1;
        }
    }
    LabelReport::of(confusion)
}

/// Whether the label truly occurs within the tolerance of an observation, in driving before or after it.
fn is_near(run: &[LabeledObservation<'_>], idx: usize, label: &str) -> bool {
    let here_m = run[idx].travel_m;
    let within =
        |other: &&LabeledObservation<'_>| (other.travel_m - here_m).abs() <= BORDER_TOLERANCE_M + 1e-9;
    let after = run[idx..].iter().take_while(within);
    let before = run[..idx].iter().rev().take_while(within);
    after.chain(before).any(|other| other.actual == Some(label))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_may_be_a_meter_off() {
        let label = |idx: usize, border: usize| if idx < border { "corridor" } else { "corner" };
        let run: Vec<LabeledObservation> = (0..100)
            .map(|idx| LabeledObservation {
                travel_m: 0.1 * idx as f64,
                actual: Some(label(idx, 50)),
                predicted: Some(label(idx, 65)),
            })
            .collect();
        let report = judge_labels(&[run]);
        // Corners 50 to 59 are within a metre of the corridor and may be called so; 60 to 64 are errors.
        assert_eq!(report.confusion["corner"]["corridor"], 5);
        assert_eq!(report.confusion["corridor"]["corridor"], 50);
        assert_eq!(report.labels["corner"], LabelScore { precision: 1.0, recall: 45.0 / 50.0, support: 50 });
        assert_eq!(report.labels["corridor"].precision, 50.0 / 55.0);
    }

    #[test]
    fn what_is_missing_is_told_or_left_out() {
        let unknown = LabeledObservation { travel_m: 0.0, actual: None, predicted: Some("hall") };
        let unpredicted = LabeledObservation { travel_m: 5.0, actual: Some("hall"), predicted: None };
        let report = judge_labels(&[vec![unknown], vec![unpredicted]]);
        assert_eq!(report.confusion.len(), 1);
        assert_eq!(report.confusion["hall"]["none"], 1);
        assert_eq!(report.labels["hall"], LabelScore { precision: 0.0, recall: 0.0, support: 1 });
    }
}
