//! Texts of a scenario, and precision and recall of their n-gram matches over all thresholds.

use std::time::Instant;

use crate::evaluation::{
    CurvePoint, JudgedMatch, JudgedRun, OdometryPose, Visit, join_truth, judge_recognition,
};
use anyhow::{Context, Result};
use locution_engine::density::KernelConfig;
use locution_engine::index::{Lattice, LevelColumns};
use locution_engine::mapping::Interval;
use locution_engine::matching::{Chain, MatchingConfig, Relation, TextStatistics, find_chains};
use locution_engine::text::{DensityHistogram, Direction, Observation, Quantizer, TextBuilder, TextConfig};
use locution_engine::translator::Translator;
use locution_engine::translator::{OdometrySource, TranslatorConfig};

use super::scenarios::Scenario;

/// As the engine's defaults for mean shift.
const MEAN_SHIFT_BANDWIDTH: f64 = 0.03;
const MEAN_SHIFT_MIN_SHARE: f64 = 0.01;

/// The runs of a scenario, translated.
#[derive(Clone)]
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

impl Texts {
    /// The same observations in other words: the classes are the modes of the scenario's densities (thesis 4.2.1).
    /// Says how many there are, too.
    ///
    /// # Errors
    /// None that words of one builder can meet.
    pub(super) fn by_mean_shift(&self, config: &TextConfig) -> Result<(Self, usize)> {
        let mut histogram = DensityHistogram::default();
        let densities = self.observations.iter().flatten().filter_map(|seen| seen.densities.first());
        densities.for_each(|&density| histogram.add(density));
        let quantizer = Quantizer::mean_shift(&histogram, MEAN_SHIFT_BANDWIDTH, MEAN_SHIFT_MIN_SHARE);
        let text_of = |observations: &Vec<Observation>| {
            let mut builder = TextBuilder::new(quantizer.clone(), config);
            let mut words: Vec<_> = observations.iter().flat_map(|seen| builder.push(seen)).collect();
            words.extend(builder.finish());
            Lattice::from_words(&words).context("the words are not a text")
        };
        let lattices = self.observations.iter().map(text_of).collect::<Result<_>>()?;
        Ok((Self { lattices, ..self.clone() }, quantizer.num_classes()))
    }

    /// Number of words of a level.
    pub(super) fn num_words(&self, level: usize) -> usize {
        let words = self.lattices.iter().filter_map(|text| text.level(level));
        words.map(LevelColumns::num_words).sum()
    }
}

/// A chain between two runs.
pub(super) struct FoundChain {
    /// Index of the run driven first.
    pub earlier_run: u32,
    /// Index of the run that may revisit it.
    pub later_run: u32,
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
    score: impl Fn(&FoundChain) -> Option<f64>,
) -> Vec<CurvePoint> {
    judge_recognition(&texts.runs, &claims_of(texts, chains, score)).curve
}

/// Precision and recall over the number of words; `extra_words` of a level is what its chains need more than those of
/// level 0.
pub(super) fn sweep_by_words(texts: &Texts, chains: &[FoundChain], extra_words: &[usize]) -> Vec<CurvePoint> {
    sweep(texts, chains, |found| {
        let extra = extra_words.get(usize::from(found.chain.max_level)).copied().unwrap_or(0);
        Some(found.chain.pairs.len() as f64 - extra as f64)
    })
}

/// Precision and recall over how surprising a chain is: −log₁₀ of its E-value, in steps of a tenth.
pub(super) fn sweep_by_evidence(
    texts: &Texts,
    chains: &[FoundChain],
    config: &MatchingConfig,
) -> Vec<CurvePoint> {
    let max_level = config.min_chain_words.len().saturating_sub(1);
    let statistics = TextStatistics::new(&texts.lattices, max_level, config.tolerance);
    sweep(texts, chains, |found| {
        let evidence = statistics.evidence(&found.chain, &texts.lattices[found.later_run as usize])?;
        Some((-evidence.expected_chance_matches.log10() * 10.0).round() / 10.0)
    })
}

/// Precision and recall of the chains that `is_accepted` after each of `num_steps` equal parts of the recording, runs
/// one after the other; the share of the observations made so far comes first.
pub(super) fn over_time(
    texts: &Texts,
    chains: &[FoundChain],
    is_accepted: impl Fn(&FoundChain) -> bool,
    num_steps: usize,
) -> Vec<(f64, CurvePoint)> {
    let claims = claims_of(texts, chains, |chain| is_accepted(chain).then_some(1.0));
    let num_observations: usize = texts.runs.iter().map(|run| run.visits.len()).sum();
    let until = |step: usize| {
        let mut left = num_observations * step / num_steps;
        let so_far = |run: &JudgedRun| {
            let visits = run.visits[..run.visits.len().min(left)].to_vec();
            left -= visits.len();
            JudgedRun { visits, ..*run }
        };
        let runs: Vec<JudgedRun> = texts.runs.iter().map(so_far).collect();
        let is_made = |claim: &&JudgedMatch| {
            (claim.later.last as usize) < runs[claim.later.run_idx as usize].visits.len()
        };
        let made: Vec<JudgedMatch> = claims.iter().filter(is_made).copied().collect();
        let point = judge_recognition(&runs, &made).curve.last().copied();
        Some((step as f64 / num_steps as f64, point?))
    };
    (1..=num_steps).filter_map(until).collect()
}

/// What the chains claim: each pair of words its own observations.
fn claims_of(
    texts: &Texts,
    chains: &[FoundChain],
    score: impl Fn(&FoundChain) -> Option<f64>,
) -> Vec<JudgedMatch> {
    let mut claims = Vec::new();
    for found in chains {
        let Some(score) = score(found) else { continue };
        let (earlier, later) =
            (&texts.lattices[found.earlier_run as usize], &texts.lattices[found.later_run as usize]);
        for &(earlier_word, later_word) in &found.chain.pairs {
            let spans = earlier.observations_of(earlier_word).zip(later.observations_of(later_word));
            let Some((earlier_span, later_span)) = spans else { continue };
            claims.push(JudgedMatch {
                earlier: Interval { run_idx: found.earlier_run, first: earlier_span.0, last: earlier_span.1 },
                later: Interval { run_idx: found.later_run, first: later_span.0, last: later_span.1 },
                direction: Direction::Same,
                score,
                is_verified: false,
            });
        }
    }
    claims
}

/// The point of a curve at a threshold: that of the lowest score not below it.
pub(super) fn at_threshold(curve: &[CurvePoint], threshold: f64) -> Option<CurvePoint> {
    curve.iter().rev().find(|point| point.threshold >= threshold).copied()
}

/// The point of largest recall among those at least as precise.
pub(super) fn at_precision(curve: &[CurvePoint], precision: f64) -> Option<CurvePoint> {
    let precise = curve.iter().filter(|point| point.precision >= precision);
    precise.max_by(|a, b| a.recall_same.total_cmp(&b.recall_same)).copied()
}

/// The point of largest precision among those that find at least as much.
pub(super) fn at_recall(curve: &[CurvePoint], recall: f64) -> Option<CurvePoint> {
    let finding = curve.iter().filter(|point| point.recall_same >= recall);
    finding.max_by(|a, b| a.precision.total_cmp(&b.precision)).copied()
}
