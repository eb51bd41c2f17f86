//! What labels are worth in buildings that had no say in them: each building judged by what all others taught.

use std::collections::BTreeMap;

use locution_engine::semantics::{
    LabelModel, LabeledRun, LearnedLabels, PlaceLabel, PlaceMap, SemanticsConfig, label_numbers, label_runs,
    place_numbers,
};
use rayon::prelude::*;
use serde::Serialize;

use super::boosting::{BoostingConfig, Examples, boost};
use super::drives::Drive;
use crate::evaluation::{LabelReport, LabeledObservation, judge_labels};

/// How a model is trained.
#[derive(Clone, Copy, Debug)]
pub struct TrainingConfig {
    /// How its trees grow.
    pub boosting: BoostingConfig,
    /// The share of what its trees say that a position counts for.
    pub evidence_share: f64,
    /// Examples of a real robot count for so many of simulated ones.
    pub real_weight: f64,
}

impl Default for TrainingConfig {
    fn default() -> Self {
        Self { boosting: BoostingConfig::default(), evidence_share: 0.3, real_weight: 15.0 }
    }
}

/// A drive with the numbers of its places.
pub struct Learned {
    /// The drive.
    pub drive: Drive,
    /// Observation and numbers of each position.
    pub numbers: Vec<(usize, Vec<f32>)>,
}

/// Reads the numbers of the places of all drives.
pub fn read_numbers(drives: Vec<Drive>, config: &SemanticsConfig) -> Vec<Learned> {
    drives
        .into_par_iter()
        .map(|drive| {
            let numbers = place_numbers(config, &[drive.as_run()]).remove(0);
            Learned { drive, numbers }
        })
        .collect()
}

/// Trains on all drives.
pub fn train(drives: &[&Learned], config: &SemanticsConfig, training: &TrainingConfig) -> LearnedLabels {
    let mut numbers = Vec::new();
    let mut labels = Vec::new();
    let mut sources = Vec::new();
    for learned in drives {
        for (observation_idx, of) in &learned.numbers {
            if let Some(label) = learned.drive.labels[*observation_idx] {
                numbers.push(of.as_slice());
                labels.push(label.index());
                sources.push((learned.drive.building.as_str(), learned.drive.is_real));
            }
        }
    }
    let weights = weights(&labels, &sources, training.real_weight);
    let (mean_length_m, follows) = chain(drives, config);
    LearnedLabels {
        trees: boost(&Examples { numbers, labels, weights }, &training.boosting),
        evidence_share: training.evidence_share,
        mean_length_m,
        follows,
    }
}

/// Labels count alike, and within a label buildings by the root of how often they have it: a long corridor says little
/// more than a short one.
fn weights(labels: &[usize], sources: &[(&str, bool)], real_weight: f64) -> Vec<f64> {
    let mut counts: BTreeMap<(usize, &str), f64> = BTreeMap::new();
    for (label, (building, _)) in labels.iter().zip(sources) {
        *counts.entry((*label, building)).or_default() += 1.0;
    }
    let mut weights: Vec<f64> = labels
        .iter()
        .zip(sources)
        .map(|(label, (building, is_real))| {
            (if *is_real { real_weight } else { 1.0 }) / counts[&(*label, *building)].sqrt()
        })
        .collect();
    let mut sums = [0.0; 5];
    for (label, weight) in labels.iter().zip(&weights) {
        sums[*label] += weight;
    }
    let num_labels = sums.iter().filter(|sum| **sum > 0.0).count() as f64;
    for (label, weight) in labels.iter().zip(&mut weights) {
        *weight *= labels.len() as f64 / num_labels / sums[*label];
    }
    weights
}

/// Mean lengths of stretches and what follows what, a little of everything added.
fn chain(drives: &[&Learned], config: &SemanticsConfig) -> ([f64; 5], [[f64; 5]; 5]) {
    let mut follows = [[0.3; 5]; 5];
    let mut lengths_m = [6.0; 5];
    let mut stretches = [2.0; 5];
    for learned in drives {
        let labels = learned.numbers.iter().map(|(idx, _)| learned.drive.labels[*idx]);
        let labels: Vec<Option<PlaceLabel>> = labels.collect();
        for pair in labels.windows(2) {
            let [Some(here), Some(next)] = pair else { continue };
            lengths_m[here.index()] += config.spacing_m;
            if here != next {
                stretches[here.index()] += 1.0;
                follows[here.index()][next.index()] += 1.0;
            }
        }
    }
    let round = |value: f64| (value * 1e4).round() / 1e4;
    let mean_length_m = std::array::from_fn(|label| round(lengths_m[label] / stretches[label]));
    for (label, row) in follows.iter_mut().enumerate() {
        row[label] = 0.0;
        let sum: f64 = row.iter().sum();
        row.iter_mut().for_each(|share| *share = round(*share / sum));
    }
    (mean_length_m, follows)
}

/// Both ways to label, judged in one building.
#[derive(Clone, Debug, Serialize)]
pub struct BuildingTrial {
    /// The building.
    pub building: String,
    /// Whether real robots drove there.
    pub is_real: bool,
    /// By the rules.
    pub tree: LabelReport,
    /// By what all other buildings taught.
    pub unseen: LabelReport,
    /// By what all buildings taught, this one too.
    pub seen: LabelReport,
}

/// Judges every building by the others. Simulated plans are left out in `num_folds` groups.
pub fn leave_buildings_out(
    drives: &[Learned],
    config: &SemanticsConfig,
    training: &TrainingConfig,
    num_folds: usize,
) -> Vec<BuildingTrial> {
    let mut buildings: Vec<(&str, bool)> = Vec::new();
    for learned in drives {
        let building = (learned.drive.building.as_str(), learned.drive.is_real);
        if !buildings.contains(&building) {
            buildings.push(building);
        }
    }
    let mut folds: Vec<Vec<&str>> = vec![Vec::new(); num_folds];
    let (real, plans): (Vec<(&str, bool)>, Vec<(&str, bool)>) =
        buildings.into_iter().partition(|(_, is_real)| *is_real);
    for (idx, (plan, _)) in plans.into_iter().enumerate() {
        folds[idx % num_folds].push(plan);
    }
    folds.extend(real.into_iter().map(|(building, _)| vec![building]));
    let all: Vec<&Learned> = drives.iter().collect();
    let taught = train(&all, config, training);
    let trials: Vec<Vec<BuildingTrial>> = folds
        .par_iter()
        .map(|fold| {
            let (left_out, others): (Vec<&Learned>, Vec<&Learned>) =
                drives.iter().partition(|learned| fold.contains(&learned.drive.building.as_str()));
            let model = train(&others, config, training);
            fold.iter()
                .map(|building| {
                    let of: Vec<&Learned> = left_out
                        .iter()
                        .copied()
                        .filter(|learned| learned.drive.building == *building)
                        .collect();
                    BuildingTrial {
                        building: (*building).into(),
                        is_real: of[0].drive.is_real,
                        tree: judged(&of, config, None),
                        unseen: judged(&of, config, Some(&model)),
                        seen: judged(&of, config, Some(&taught)),
                    }
                })
                .collect()
        })
        .collect();
    trials.into_iter().flatten().collect()
}

/// Labels as served: every pass labelled, then the places' votes. Each drive is a map of its own.
fn judged(drives: &[&Learned], config: &SemanticsConfig, model: Option<&LearnedLabels>) -> LabelReport {
    let labeled: Vec<Vec<PlaceLabel>> = drives
        .iter()
        .map(|learned| {
            let runs = [learned.drive.as_run()];
            let passes: Vec<LabeledRun> = match model {
                Some(model) => vec![label_numbers(config, model, &runs[0], &learned.numbers)],
                None => label_runs(&SemanticsConfig { model: LabelModel::Tree, ..config.clone() }, &runs),
            };
            PlaceMap::build(config, &runs, &passes).labels_of_run(0)
        })
        .collect();
    let observations: Vec<Vec<LabeledObservation<'_>>> = drives
        .iter()
        .zip(&labeled)
        .map(|(learned, labels)| {
            let drive = &learned.drive;
            let mut travel_m = 0.0;
            (0..labels.len())
                .map(|idx| {
                    travel_m += if idx > 0 { drive.truth[idx - 1].distance(&drive.truth[idx]) } else { 0.0 };
                    LabeledObservation {
                        travel_m,
                        actual: drive.labels[idx].map(PlaceLabel::name),
                        predicted: Some(labels[idx].name()),
                    }
                })
                .collect()
        })
        .collect();
    judge_labels(&observations)
}

/// Confusions of several buildings added up.
pub fn pooled<'a>(reports: impl Iterator<Item = &'a LabelReport>) -> LabelReport {
    let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for (actual, row) in reports.flat_map(|report| &report.confusion) {
        let sums = confusion.entry(actual.clone()).or_default();
        row.iter().for_each(|(predicted, num)| *sums.entry(predicted.clone()).or_default() += num);
    }
    LabelReport::of(confusion)
}
