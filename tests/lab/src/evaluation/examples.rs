//! Outcome of many questions by example: pieces of recordings made in the map, elsewhere, and in other buildings.

use serde::{Deserialize, Serialize};

use super::summary::{quantile, share};
use locution_engine::geometry::{Pose2, angle_between};

/// Nearer than this is right.
const RIGHT_M: f64 = 0.5;
/// A heading closer than this is right.
const RIGHT_DEG: f64 = 10.0;
/// Bins of the reliability table.
const NUM_BINS: usize = 10;

/// What was asked and answered once.
#[derive(Clone, Debug, PartialEq)]
pub struct ExampleTrial {
    /// Where in the map the piece ends; none when it was not made where the map has been.
    pub expected: Option<Pose2>,
    /// Places answered with their probabilities, likeliest first.
    pub answered: Vec<(Pose2, f64)>,
    /// Whether the answer was sure.
    pub is_sure: bool,
    /// Seconds until the answer was there.
    pub latency_s: f64,
}

impl ExampleTrial {
    fn is_right(&self, pose: &Pose2) -> bool {
        self.expected.is_some_and(|expected| {
            pose.distance(&expected) < RIGHT_M
                && angle_between(pose.theta, expected.theta) < RIGHT_DEG.to_radians()
        })
    }

    fn is_first_right(&self) -> bool {
        self.answered.first().is_some_and(|(pose, _)| self.is_right(pose))
    }
}

/// Places that were given about the same probability.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityBin {
    /// Number of places.
    pub places: usize,
    /// Their mean probability.
    pub said: f64,
    /// The share of them that were right.
    pub right: f64,
}

/// Milliseconds until the answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LatencyMs {
    /// Half of the answers were faster.
    pub median: Option<f64>,
    /// All but one of a hundred were.
    pub p99: Option<f64>,
}

/// Shares 0 to 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExampleReport {
    /// Pieces made where the map has been.
    pub here: usize,
    /// Pieces made elsewhere.
    pub elsewhere: usize,
    /// Of the former: the first place is right, however sure.
    pub first_right: f64,
    /// Of the former: one of the first five places is right.
    pub among_first_five: f64,
    /// Of the former: sure and right.
    pub found: f64,
    /// Of the former: sure and wrong.
    pub wrongly_sure: f64,
    /// Of the latter: sure of a place.
    pub sure_elsewhere: f64,
    /// Of the latter: "not here", all places together no likelier than not.
    pub not_here: f64,
    /// Places by the probability that they were given.
    pub reliability: Vec<ReliabilityBin>,
    /// Mean distance of what was said from what was right over the bins, by their places (expected calibration error).
    pub calibration_error: f64,
    /// Mean squared error of the first place's probability (Brier score).
    pub brier: f64,
    /// Time to the answer.
    pub latency_ms: LatencyMs,
}

/// Judges trials.
pub fn judge_examples(trials: &[ExampleTrial]) -> ExampleReport {
    let (here, elsewhere): (Vec<&ExampleTrial>, Vec<&ExampleTrial>) =
        trials.iter().partition(|trial| trial.expected.is_some());
    let of = |group: &[&ExampleTrial], holds: &dyn Fn(&ExampleTrial) -> bool| {
        share(group.iter().filter(|trial| holds(trial)).count(), group.len())
    };
    let here_at_all = |trial: &ExampleTrial| trial.answered.iter().map(|place| place.1).sum::<f64>();
    let squared_error = |trial: &ExampleTrial| {
        let said = trial.answered.first().map_or(0.0, |place| place.1);
        (said - f64::from(u8::from(trial.is_first_right()))).powi(2)
    };
    let is_among_five =
        |trial: &ExampleTrial| trial.answered.iter().take(5).any(|place| trial.is_right(&place.0));
    let reliability = reliability(trials);
    let latencies_ms: Vec<f64> = trials.iter().map(|trial| 1e3 * trial.latency_s).collect();
    ExampleReport {
        here: here.len(),
        elsewhere: elsewhere.len(),
        first_right: of(&here, &ExampleTrial::is_first_right),
        among_first_five: of(&here, &is_among_five),
        found: of(&here, &|trial| trial.is_sure && trial.is_first_right()),
        wrongly_sure: of(&here, &|trial| trial.is_sure && !trial.is_first_right()),
        sure_elsewhere: of(&elsewhere, &|trial| trial.is_sure),
        not_here: of(&elsewhere, &|trial| here_at_all(trial) <= 0.5),
        calibration_error: calibration_error(&reliability),
        reliability,
        brier: trials.iter().map(squared_error).sum::<f64>() / trials.len().max(1) as f64,
        latency_ms: LatencyMs { median: quantile(&latencies_ms, 0.5), p99: quantile(&latencies_ms, 0.99) },
    }
}

fn reliability(trials: &[ExampleTrial]) -> Vec<ReliabilityBin> {
    let mut bins = [(0usize, 0.0f64, 0usize); NUM_BINS];
    for trial in trials {
        for (pose, probability) in &trial.answered {
            let bin = &mut bins[((probability * NUM_BINS as f64) as usize).min(NUM_BINS - 1)];
            *bin = (bin.0 + 1, bin.1 + probability, bin.2 + usize::from(trial.is_right(pose)));
        }
    }
    let as_shares = |(places, said, right): (usize, f64, usize)| ReliabilityBin {
        places,
        said: said / places as f64,
        right: share(right, places),
    };
    bins.into_iter().filter(|bin| bin.0 > 0).map(as_shares).collect()
}

fn calibration_error(bins: &[ReliabilityBin]) -> f64 {
    let num_places: usize = bins.iter().map(|bin| bin.places).sum();
    let off: f64 = bins.iter().map(|bin| bin.places as f64 * (bin.said - bin.right).abs()).sum();
    off / num_places.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(expected: Option<Pose2>, answered: &[(f64, f64)], is_sure: bool) -> ExampleTrial {
        let answered = answered.iter().map(|&(x, probability)| (Pose2::new(x, 0.0, 0.0), probability));
        ExampleTrial { expected, answered: answered.collect(), is_sure, latency_s: 0.01 }
    }

    #[test]
    fn right_wrong_and_not_here_are_told_apart() {
        let here = Some(Pose2::new(1.0, 0.0, 0.1));
        let report = judge_examples(&[
            trial(here, &[(1.2, 0.98)], true),
            trial(here, &[(5.0, 0.96), (1.1, 0.03)], true),
            trial(here, &[], false),
            trial(None, &[], false),
            trial(None, &[(3.0, 0.97)], true),
        ]);
        let third = 1.0 / 3.0;
        assert_eq!((report.here, report.elsewhere), (3, 2));
        assert_eq!((report.first_right, report.found, report.wrongly_sure), (third, third, third));
        assert_eq!(report.among_first_five, 2.0 * third);
        let off = (0.03f64 - 1.0).abs() + 3.0 * ((0.98 + 0.96 + 0.97) / 3.0 - third);
        assert!((report.calibration_error - off / 4.0).abs() < 1e-9, "{report:?}");
        assert_eq!((report.sure_elsewhere, report.not_here), (0.5, 0.5));
        assert_eq!(report.reliability.len(), 2);
        assert_eq!((report.reliability[1].places, report.reliability[1].right), (3, third));
        assert_eq!(report.latency_ms.median, Some(10.0));
    }
}
