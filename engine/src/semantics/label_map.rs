//! The conductor: all driving in one map → the surroundings of its places → a label for every observation.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::block::{Block, BlockEvidence};
use super::config::{LabelModel, SemanticsConfig};
use super::features::{FeatureReader, NUM_OWN, TURN_REACHES_M, WAY_M, with_context};
use super::label::PlaceLabel;
use super::learned::LearnedLabels;
use super::rules::label_of;
use super::signature::{PlaceSignature, SignatureReader};
use crate::geometry::{Point2, Pose2, angle_between};
use crate::mapping::{MappedRun, RunRecord, place_observations};
use crate::scan::ScanGeometry;

/// One run, at its poses in the map.
#[derive(Clone, Debug)]
pub struct DrivenRun<'a> {
    /// The laser.
    pub geometry: &'a ScanGeometry,
    /// Scans and where they were taken.
    pub scans: Vec<(Pose2, &'a [f32])>,
    /// Where the observations were made, in order of travel.
    pub map_from_observations: Vec<Pose2>,
}

impl<'a> DrivenRun<'a> {
    /// A run as the map builder placed it.
    pub fn in_map(record: &RunRecord<'a>, mapped: &MappedRun) -> Self {
        let placed = record.keyframes.iter().zip(&mapped.map_from_keyframes);
        Self {
            geometry: record.geometry,
            scans: placed.map(|(keyframe, pose)| (*pose, keyframe.ranges_m.as_slice())).collect(),
            map_from_observations: place_observations(record, mapped),
        }
    }
}

/// Labels of the observations of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct LabeledRun {
    /// A label for each observation.
    pub labels: Vec<PlaceLabel>,
    /// The share of what was seen nearby that agrees with the label, in [0, 1].
    pub confidences: Vec<f32>,
}

/// Observations from one position of the way around a sample to the next.
const WAY_STEP: usize = 4;

/// A position whose surroundings are looked at.
#[derive(Clone, Copy)]
struct Sample {
    run_idx: usize,
    observation_idx: usize,
    position: Point2,
    /// The largest turn nearby.
    turn_rad: f64,
    /// Turns here, over several reaches.
    turns_rad: [f64; 3],
}

/// Labels every observation of runs that share one map frame.
///
/// The label belongs to the place: it is decided by what all runs saw around it and by where any of them drove.
pub fn label_runs(config: &SemanticsConfig, runs: &[DrivenRun<'_>]) -> Vec<LabeledRun> {
    match config.model {
        LabelModel::Tree => {
            let read = read_runs(config, runs, |block, samples| read_signatures(config, block, samples));
            runs.iter().zip(read).map(|(run, signatures)| label_by_rules(config, run, &signatures)).collect()
        }
        LabelModel::Learned => {
            let model = LearnedLabels::built_in();
            let read = place_numbers(config, runs);
            runs.iter().zip(&read).map(|(run, numbers)| label_numbers(config, model, run, numbers)).collect()
        }
    }
}

/// The numbers that the learned labels are decided by, with the observation of each position, for each run.
pub fn place_numbers(config: &SemanticsConfig, runs: &[DrivenRun<'_>]) -> Vec<Vec<(usize, Vec<f32>)>> {
    let read = read_runs(config, runs, |block, samples| {
        let mut reader = FeatureReader::new(block);
        samples
            .iter()
            .map(|sample| match block.index(&sample.position) {
                Some(cell) => reader.read(cell, sample.turns_rad, &way_around(&runs[sample.run_idx], sample)),
                None => vec![0.0; NUM_OWN],
            })
            .collect()
    });
    read.into_iter()
        .map(|own| {
            let (observations, own): (Vec<usize>, Vec<Vec<f32>>) = own.into_iter().unzip();
            observations.into_iter().zip(with_context(&own, config.spacing_m)).collect()
        })
        .collect()
}

/// Positions of a run around a sample, until either is too far off.
fn way_around(run: &DrivenRun<'_>, sample: &Sample) -> Vec<Point2> {
    let poses = &run.map_from_observations;
    let near = |pose: &&Pose2| pose.position().distance(&sample.position) <= WAY_M;
    let before = poses[..sample.observation_idx].iter().rev().take_while(near);
    let after = poses[sample.observation_idx..].iter().take_while(near);
    before.chain(after).step_by(WAY_STEP).map(Pose2::position).collect()
}

/// Reads the surroundings of positions along all runs, block by block; for each run in order of travel.
fn read_runs<T: Send>(
    config: &SemanticsConfig,
    runs: &[DrivenRun<'_>],
    read: impl Fn(&Block, &[Sample]) -> Vec<T> + Sync,
) -> Vec<Vec<(usize, T)>> {
    let samples: Vec<Sample> =
        runs.iter().enumerate().flat_map(|(run_idx, run)| samples_of(config, run_idx, run)).collect();
    let mut blocks: BTreeMap<(i64, i64), Vec<Sample>> = BTreeMap::new();
    for sample in samples {
        let key = |meters: f64| (meters / config.block_m).floor() as i64;
        blocks.entry((key(sample.position.x), key(sample.position.y))).or_default().push(sample);
    }
    let blocks: Vec<Vec<Sample>> = blocks.into_values().collect();
    let found: Vec<Vec<T>> =
        blocks.par_iter().map(|samples| read(&build_block(config, runs, samples), samples)).collect();
    let mut by_run: Vec<Vec<(usize, T)>> = runs.iter().map(|_| Vec::new()).collect();
    for (sample, surroundings) in blocks.iter().flatten().zip(found.into_iter().flatten()) {
        by_run[sample.run_idx].push((sample.observation_idx, surroundings));
    }
    for run in &mut by_run {
        run.sort_by_key(|(observation_idx, _)| *observation_idx);
    }
    by_run
}

/// Positions of a run a little travel apart; the first is always one of them.
fn samples_of(config: &SemanticsConfig, run_idx: usize, run: &DrivenRun<'_>) -> Vec<Sample> {
    let poses = &run.map_from_observations;
    let mut travel_m = vec![0.0];
    for pair in poses.windows(2) {
        travel_m.push(travel_m[travel_m.len() - 1] + pair[0].distance(&pair[1]));
    }
    let mut samples: Vec<Sample> = Vec::new();
    let mut next_m = 0.0;
    for (observation_idx, pose) in poses.iter().enumerate() {
        if travel_m[observation_idx] >= next_m - 1e-9 {
            next_m = travel_m[observation_idx] + config.spacing_m;
            let turn = |reach_m: f64| turn_at(poses, &travel_m, observation_idx, reach_m);
            samples.push(Sample {
                run_idx,
                observation_idx,
                position: pose.position(),
                turn_rad: turn(config.turn_reach_m),
                turns_rad: TURN_REACHES_M.map(turn),
            });
        }
    }
    widen_turns(config, samples)
}

/// Angle between the chords to a position from some travel before and from it to some travel after.
fn turn_at(poses: &[Pose2], travel_m: &[f64], at: usize, reach_m: f64) -> f64 {
    let before = travel_m.partition_point(|&travel| travel < travel_m[at] - reach_m);
    let after = travel_m.partition_point(|&travel| travel <= travel_m[at] + reach_m) - 1;
    let direction = |from: usize, to: usize| {
        let (dx, dy) = (poses[to].x - poses[from].x, poses[to].y - poses[from].y);
        (dx.hypot(dy) > 1e-6).then(|| dy.atan2(dx))
    };
    match (direction(before, at), direction(at, after)) {
        (Some(entering), Some(leaving)) => angle_between(entering, leaving),
        _ => 0.0,
    }
}

/// A corner reaches a little beyond the place where the way turns most.
fn widen_turns(config: &SemanticsConfig, mut samples: Vec<Sample>) -> Vec<Sample> {
    let reach = (config.smoothing_m / config.spacing_m).round() as usize;
    let turns: Vec<f64> = samples.iter().map(|sample| sample.turn_rad).collect();
    for (at, sample) in samples.iter_mut().enumerate() {
        let around = &turns[at.saturating_sub(reach)..(at + reach + 1).min(turns.len())];
        sample.turn_rad = around.iter().copied().fold(0.0, f64::max);
    }
    samples
}

/// The surroundings of positions that lie in one block, as the rules want them.
fn read_signatures(config: &SemanticsConfig, block: &Block, samples: &[Sample]) -> Vec<PlaceSignature> {
    let mut reader = SignatureReader::new(config, block);
    samples
        .iter()
        .map(|sample| match block.index(&sample.position) {
            Some(cell) => reader.read(cell, sample.turn_rad),
            None => PlaceSignature::default(),
        })
        .collect()
}

/// The map around positions, with the margin that their labels need.
fn build_block(config: &SemanticsConfig, runs: &[DrivenRun<'_>], samples: &[Sample]) -> Block {
    let lowest = |of: fn(&Point2) -> f64| samples.iter().map(|s| of(&s.position)).fold(f64::MAX, f64::min);
    let highest = |of: fn(&Point2) -> f64| samples.iter().map(|s| of(&s.position)).fold(f64::MIN, f64::max);
    let (left, bottom) = (lowest(|p| p.x), lowest(|p| p.y));
    let (right, top) = (highest(|p| p.x), highest(|p| p.y));
    let margin_m = config.margin_m();
    // Whole cells, so that the same place falls into the same cells whatever else is in its block.
    let snap = |meters: f64| (meters / config.resolution_m).floor() * config.resolution_m;
    let lower_left = Point2::new(snap(left - margin_m), snap(bottom - margin_m));
    let edge_m = (right - left).max(top - bottom) + 2.0 * margin_m + config.resolution_m;
    let mut evidence = BlockEvidence::new(config, lower_left, edge_m);
    let is_near = |position: &Point2, reach_m: f64| {
        position.x > lower_left.x - reach_m
            && position.y > lower_left.y - reach_m
            && position.x < lower_left.x + edge_m + reach_m
            && position.y < lower_left.y + edge_m + reach_m
    };
    for run in runs {
        for (map_from_robot, ranges_m) in &run.scans {
            if is_near(&map_from_robot.position(), config.sight_m) {
                evidence.add_scan(run.geometry, map_from_robot, ranges_m);
            }
        }
        for pose in &run.map_from_observations {
            if is_near(&pose.position(), config.driven_radius_m) {
                evidence.add_driven(&pose.position());
            }
        }
    }
    evidence.finish()
}

/// By the rules: the majority of the labels around each position.
fn label_by_rules(
    config: &SemanticsConfig,
    run: &DrivenRun<'_>,
    signatures: &[(usize, PlaceSignature)],
) -> LabeledRun {
    let raw: Vec<PlaceLabel> = signatures.iter().map(|(_, signature)| label_of(config, signature)).collect();
    let reach = (config.smoothing_m / config.spacing_m).round() as usize;
    let positions = signatures.iter().enumerate().map(|(at, (observation_idx, _))| {
        let (label, confidence) = majority(&raw, at, reach);
        (*observation_idx, label, confidence)
    });
    spread(run, &positions.collect::<Vec<_>>())
}

/// Labels of a run by a learned model, from the numbers of its places.
pub fn label_numbers(
    config: &SemanticsConfig,
    model: &LearnedLabels,
    run: &DrivenRun<'_>,
    numbers: &[(usize, Vec<f32>)],
) -> LabeledRun {
    let likelihoods: Vec<[f64; 5]> = numbers.iter().map(|(_, numbers)| model.likelihoods(numbers)).collect();
    let positions = model.in_sequence(&likelihoods, config.spacing_m);
    let labeled: Vec<(usize, PlaceLabel, f32)> = numbers
        .iter()
        .zip(positions)
        .map(|((observation_idx, _), (label, confidence))| (*observation_idx, label, confidence))
        .collect();
    spread(run, &labeled)
}

/// Labels of all observations from those of the positions looked at, the nearest for each.
fn spread(run: &DrivenRun<'_>, positions: &[(usize, PlaceLabel, f32)]) -> LabeledRun {
    let num_observations = run.map_from_observations.len();
    let mut labels = Vec::with_capacity(num_observations);
    let mut confidences = Vec::with_capacity(num_observations);
    let mut nearest = 0;
    for observation_idx in 0..num_observations {
        let distance = |position: usize| positions[position].0.abs_diff(observation_idx);
        while nearest + 1 < positions.len() && distance(nearest + 1) <= distance(nearest) {
            nearest += 1;
        }
        let (_, label, confidence) = positions[nearest];
        labels.push(label);
        confidences.push(confidence);
    }
    LabeledRun { labels, confidences }
}

/// The most frequent label within `reach` positions and its share; of equals the one in the middle, else the first.
fn majority(labels: &[PlaceLabel], at: usize, reach: usize) -> (PlaceLabel, f32) {
    let window = &labels[at.saturating_sub(reach)..(at + reach + 1).min(labels.len())];
    let count = |label: PlaceLabel| window.iter().filter(|other| **other == label).count();
    let mut best = labels[at];
    for label in PlaceLabel::ALL {
        if count(label) > count(best) {
            best = label;
        }
    }
    (best, count(best) as f32 / window.len() as f32)
}
