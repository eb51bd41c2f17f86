//! Texts of a scenario, and precision and recall of their n-gram matches over all thresholds.

use std::time::Instant;

use anyhow::{Context, Result};
use locution_engine::config::{OdometrySource, TranslatorConfig};
use locution_engine::density::KernelConfig;
use locution_engine::evaluation::{
    CurvePoint, JudgedMatch, JudgedRun, OdometryPose, Visit, join_truth, judge_recognition,
};
use locution_engine::index::Lattice;
use locution_engine::mapping::Interval;
use locution_engine::matching::{Chain, MatchingConfig, Relation, find_chains};
use locution_engine::text::{Direction, Observation};
use locution_engine::translator::Translator;

use super::scenarios::Scenario;

/// The runs of a scenario, translated.
pub(super) struct Texts {
    /// Observations with their true poses.
    pub runs: Vec<JudgedRun>,
    /// Observations as translated.
    pub observations: Vec<Vec<Observation>>,
    /// Words of all levels.
    pub lattices: Vec<Lattice>,
    /// Metres driven, all runs.
    pub travel_m: f64,
}

/// The thesis' own translation: one uniform kernel, observed at once, nothing refined.
pub(super) fn thesis_translator(bandwidth_m: f64) -> TranslatorConfig {
    let mut config = TranslatorConfig { odometry: OdometrySource::Raw, ..TranslatorConfig::default() };
    config.density.kernels = vec![KernelConfig::uniform(bandwidth_m)];
    config.sampling.delay_m = 0.0;
    config
}

/// Translates every run.
///
/// # Errors
/// A configuration that cannot work.
pub(super) fn translate(scenario: &Scenario, config: &TranslatorConfig) -> Result<Texts> {
    let mut texts = Texts { runs: Vec::new(), observations: Vec::new(), lattices: Vec::new(), travel_m: 0.0 };
    for run in &scenario.runs {
        let mut translator = Translator::new(config, run.geometry.clone())?;
        let (mut observations, mut words) = (Vec::new(), Vec::new());
        for scan in &run.scans {
            let translation = translator.push(scan);
            observations.extend(translation.observations);
            words.extend(translation.words);
        }
        let rest = translator.finish();
        observations.extend(rest.observations);
        words.extend(rest.words);
        let odometry: Vec<OdometryPose> = run
            .scans
            .iter()
            .map(|scan| OdometryPose {
                timestamp_ns: scan.timestamp_ns,
                odom_from_robot: scan.odom_from_robot,
            })
            .collect();
        let joined = join_truth(&odometry, &run.truth);
        let visit = |observation: &Observation| Visit {
            travel_m: observation.travel_m,
            truth_from_robot: joined.get(observation.scan_seq as usize).copied().flatten(),
        };
        texts.travel_m += observations.last().map_or(0.0, |last: &Observation| last.travel_m);
        texts.runs.push(JudgedRun { truth_frame: 0, visits: observations.iter().map(visit).collect() });
        texts.lattices.push(Lattice::from_words(&words).context("the words are not a text")?);
        texts.observations.push(observations);
    }
    Ok(texts)
}

/// A chain between two runs.
pub(super) struct FoundChain {
    earlier_run: u32,
    later_run: u32,
    /// The chain itself.
    pub chain: Chain,
}

/// All maximal chains among the runs, driven the same way as the thesis looks for them, and how long it took, in
/// seconds.
pub(super) fn chains_of(texts: &Texts, config: &MatchingConfig) -> (Vec<FoundChain>, f64) {
    let began = Instant::now();
    let mut found = Vec::new();
    for (later_run, later) in texts.lattices.iter().enumerate() {
        for (earlier_run, earlier) in texts.lattices[..=later_run].iter().enumerate() {
            let relation = if earlier_run == later_run { Relation::SameRun } else { Relation::DifferentRuns };
            let chains = find_chains(earlier, later, relation, config);
            let same_way = chains.into_iter().filter(|chain| chain.direction == Direction::Same);
            found.extend(same_way.map(|chain| FoundChain {
                earlier_run: earlier_run as u32,
                later_run: later_run as u32,
                chain,
            }));
        }
    }
    (found, began.elapsed().as_secs_f64())
}

/// Precision and recall (same direction) at every threshold of `score`; chains scored `None` are left out.
pub(super) fn sweep(
    texts: &Texts,
    chains: &[FoundChain],
    score: impl Fn(&Chain) -> Option<f64>,
) -> Vec<CurvePoint> {
    let mut matches = Vec::new();
    for found in chains {
        let Some(score) = score(&found.chain) else { continue };
        let (earlier, later) =
            (&texts.lattices[found.earlier_run as usize], &texts.lattices[found.later_run as usize]);
        // Each pair of words claims its own observations.
        for &(earlier_word, later_word) in &found.chain.pairs {
            let spans = earlier.observations_of(earlier_word).zip(later.observations_of(later_word));
            let Some((earlier_span, later_span)) = spans else { continue };
            matches.push(JudgedMatch {
                earlier: Interval { run_idx: found.earlier_run, first: earlier_span.0, last: earlier_span.1 },
                later: Interval { run_idx: found.later_run, first: later_span.0, last: later_span.1 },
                direction: Direction::Same,
                score,
                is_verified: false,
            });
        }
    }
    judge_recognition(&texts.runs, &matches).curve
}

/// The point of a curve at a threshold: that of the lowest score not below it.
pub(super) fn at_threshold(curve: &[CurvePoint], threshold: f64) -> Option<CurvePoint> {
    curve.iter().rev().find(|point| point.threshold >= threshold).copied()
}
