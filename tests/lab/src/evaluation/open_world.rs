//! Outcome of robots in an open world: on the map, on a part of the building that it does not hold, or elsewhere.

use serde::{Deserialize, Serialize};

use super::localization::MetersToConverge;
use super::summary::{quantile, share};

/// A robot that is on the map is to be found within this distance, metres.
const FOUND_WITHIN_M: f64 = 15.0;

/// What a session said at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenWorldStep {
    /// Metres driven.
    pub travel_m: f64,
    /// Whether the robot is where the map has been; none where nobody can say.
    pub is_on_map: Option<bool>,
    /// Whether it was told that it is found.
    pub is_sure: bool,
    /// Whether the place named first is right.
    pub is_right: bool,
}

impl OpenWorldStep {
    /// Sure of a place that is not its own.
    fn is_wrongly_sure(&self) -> bool {
        self.is_sure && !self.is_right && self.is_on_map.is_some()
    }
}

/// One robot from power-on to the end of its drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenWorldTrial {
    /// In order of driving.
    pub steps: Vec<OpenWorldStep>,
    /// Metres driven when it was carried elsewhere.
    pub carried_at_m: Option<f64>,
}

impl OpenWorldTrial {
    /// Metres driven when it was first found where it is.
    fn found_at_m(&self) -> Option<f64> {
        self.steps.iter().find(|step| step.is_sure && step.is_right).map(|step| step.travel_m)
    }

    /// Whether it stayed on the map until it was found, or for as long as it may take.
    fn can_be_found(&self) -> bool {
        let until_m = self.found_at_m().unwrap_or(FOUND_WITHIN_M);
        !self.steps.is_empty()
            && self
                .steps
                .iter()
                .take_while(|step| step.travel_m <= until_m)
                .all(|step| step.is_on_map == Some(true))
    }

    /// Metres during which it was wrongly sure, from some travel on.
    fn wrong_m(&self, from_m: f64) -> f64 {
        let pairs =
            self.steps.windows(2).filter(|pair| pair[1].travel_m > from_m && pair[0].is_wrongly_sure());
        pairs.map(|pair| pair[1].travel_m - pair[0].travel_m.max(from_m)).sum()
    }
}

/// Shares 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OpenWorldReport {
    /// Robots switched on.
    pub trials: usize,
    /// Robots that were sure of a wrong place at any moment.
    pub ever_wrongly_sure: f64,
    /// Metres of that, all robots together.
    pub wrongly_sure_m: f64,
    /// Robots that were on the map until they were found, or for 15 m.
    pub on_map: usize,
    /// Of these: found.
    pub found: f64,
    /// Of these: found within 15 m.
    pub found_within_15_m: f64,
    /// Metres driven until then.
    #[serde(rename = "metres_to_converge")]
    pub meters_to_converge: MetersToConverge,
    /// Robots that were carried elsewhere while they were found.
    pub carried: usize,
    /// Metres that these stayed sure of the old place, at most.
    pub carried_wrongly_sure_m: Option<f64>,
}

/// Judges trials.
pub fn judge_open_world(trials: &[OpenWorldTrial]) -> OpenWorldReport {
    let count = |holds: &dyn Fn(&OpenWorldTrial) -> bool| trials.iter().filter(|trial| holds(trial)).count();
    let is_on_map = |trial: &OpenWorldTrial| trial.carried_at_m.is_none() && trial.can_be_found();
    let on_map: Vec<&OpenWorldTrial> = trials.iter().filter(|trial| is_on_map(trial)).collect();
    let found_m: Vec<f64> = on_map.iter().filter_map(|trial| trial.found_at_m()).collect();
    let carried_m: Vec<f64> = trials
        .iter()
        .filter_map(|trial| {
            trial.carried_at_m.zip(trial.found_at_m()).map(|(at_m, found_m)| (trial, at_m, found_m))
        })
        .filter(|(_, at_m, found_m)| found_m < at_m)
        .map(|(trial, at_m, _)| trial.wrong_m(at_m))
        .collect();
    OpenWorldReport {
        trials: trials.len(),
        ever_wrongly_sure: share(
            count(&|trial| trial.steps.iter().any(OpenWorldStep::is_wrongly_sure)),
            trials.len(),
        ),
        wrongly_sure_m: trials.iter().map(|trial| trial.wrong_m(0.0)).sum(),
        on_map: on_map.len(),
        found: share(found_m.len(), on_map.len()),
        found_within_15_m: share(
            found_m.iter().filter(|at_m| **at_m <= FOUND_WITHIN_M).count(),
            on_map.len(),
        ),
        meters_to_converge: MetersToConverge {
            median: quantile(&found_m, 0.5),
            p90: quantile(&found_m, 0.9),
        },
        carried: carried_m.len(),
        carried_wrongly_sure_m: quantile(&carried_m, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(steps: &[(f64, bool, bool, bool)], carried_at_m: Option<f64>) -> OpenWorldTrial {
        let step = |&(travel_m, is_on_map, is_sure, is_right): &(f64, bool, bool, bool)| OpenWorldStep {
            travel_m,
            is_on_map: Some(is_on_map),
            is_sure,
            is_right,
        };
        OpenWorldTrial { steps: steps.iter().map(step).collect(), carried_at_m }
    }

    #[test]
    fn found_elsewhere_and_carried_are_told_apart() {
        let found =
            trial(&[(1.0, true, false, true), (3.0, true, true, true), (9.0, false, false, false)], None);
        let elsewhere = trial(&[(1.0, false, true, false), (3.0, false, false, false)], None);
        let carried = trial(
            &[
                (2.0, true, true, true),
                (5.0, true, true, false),
                (6.0, true, true, false),
                (7.5, true, false, false),
            ],
            Some(4.0),
        );
        let report = judge_open_world(&[found, elsewhere, carried]);
        assert_eq!((report.trials, report.on_map, report.found), (3, 1, 1.0));
        assert!((report.ever_wrongly_sure - 2.0 / 3.0).abs() < 1e-9);
        assert!((report.wrongly_sure_m - 4.5).abs() < 1e-9, "{report:?}");
        assert_eq!((report.carried, report.carried_wrongly_sure_m), (1, Some(2.5)));
        assert_eq!(report.meters_to_converge.median, Some(3.0));
    }
}
