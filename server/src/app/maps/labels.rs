//! Labelled places of a map, and questions in their words: "a corridor over ten metres, then a left corner".

use std::collections::BTreeMap;

use locution_engine::geometry::Pose2;
use locution_engine::mapping::{RunRecord, SiteMap};
use locution_engine::semantics::{DrivenRun, LabeledRun, PlaceLabel, PlaceMap, SemanticsConfig, label_runs};

use super::regions::pose_at;
use crate::app::AppError;
use crate::records::{Map, MapRun, StoredLabel};

/// Stretches shorter than this between two of one label do not part them when asked for by label, metres.
const FLICKER_M: f64 = 0.5;

/// What the map builder stores of labels.
#[derive(Clone, Debug, Default)]
pub struct LabeledMap {
    /// A label for every observation of every run, as its place has it.
    pub labels: Vec<Vec<StoredLabel>>,
    /// The places of each component.
    pub places: Vec<(u32, PlaceMap)>,
}

/// Labels of all observations of all runs, and the places that they make, component by component.
pub fn label_map(runs: &[RunRecord<'_>], map: &SiteMap, config: &SemanticsConfig) -> LabeledMap {
    let mut by_component: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (run_idx, mapped) in map.runs.iter().enumerate().filter(|(_, run)| !run.map_from_keyframes.is_empty())
    {
        by_component.entry(mapped.component).or_default().push(run_idx);
    }
    let mut labeled_map = LabeledMap { labels: vec![Vec::new(); runs.len()], places: Vec::new() };
    for (component, members) in &by_component {
        let driven: Vec<DrivenRun<'_>> = members
            .iter()
            .map(|&run_idx| DrivenRun::in_map(&runs[run_idx], &map.runs[run_idx].map_from_keyframes))
            .collect();
        let labeled = label_runs(config, &driven);
        let places = PlaceMap::build(config, &driven, &labeled);
        for (member_idx, (&run_idx, labeled)) in members.iter().zip(&labeled).enumerate() {
            labeled_map.labels[run_idx] = stored(&places.labels_of_run(member_idx), labeled);
        }
        labeled_map.places.push((*component, places));
    }
    labeled_map
}

/// The labels of places, with what the single pass saw for or against its own.
fn stored(labels: &[PlaceLabel], labeled: &LabeledRun) -> Vec<StoredLabel> {
    let pairs = labels.iter().zip(&labeled.confidences);
    pairs
        .map(|(label, confidence)| StoredLabel { label_idx: label.index() as u8, confidence: *confidence })
        .collect()
}

/// A stretch of driving through places of one label.
#[derive(Clone, Debug)]
pub struct LabeledStretch {
    /// Name of the run.
    pub run: String,
    /// Component of the map.
    pub component: u32,
    /// What kind of place.
    pub label: PlaceLabel,
    /// First observation, inclusive.
    pub first: u64,
    /// Last observation, inclusive.
    pub last: u64,
    /// Timestamps of the two, nanoseconds.
    pub timestamps_ns: (i64, i64),
    /// Metres along it.
    pub length_m: f64,
    /// Radians turned from its first to its last observation.
    pub turn_rad: f64,
    /// Mean share of what was seen that agrees with the label.
    pub confidence: f64,
    /// Its middle in the component's frame.
    pub map_from_middle: Pose2,
}

/// One part of a question.
#[derive(Clone, Debug)]
pub struct LabelPattern {
    /// What kind of place.
    pub label: PlaceLabel,
    /// Metres along it, at least.
    pub length_min_m: f64,
    /// Metres along it, at most.
    pub length_max_m: f64,
    /// Which way it turns: left (positive), right (negative); `None`: either.
    pub is_left: Option<bool>,
}

impl LabelPattern {
    fn accepts(&self, stretch: &LabeledStretch, is_reversed: bool) -> bool {
        let turn_rad = if is_reversed { -stretch.turn_rad } else { stretch.turn_rad };
        stretch.label == self.label
            && (self.length_min_m..=self.length_max_m).contains(&stretch.length_m)
            && self.is_left.is_none_or(|is_left| is_left == (turn_rad > 0.0))
    }
}

/// Where a question fits.
#[derive(Clone, Debug)]
pub struct LabelAnswer {
    /// The stretches, in the order of the question.
    pub stretches: Vec<LabeledStretch>,
    /// Whether the run drove them the other way round.
    pub is_reversed: bool,
    /// The least sure of its labels.
    pub confidence: f64,
}

/// The labelled stretches of a run in a version.
async fn labels_of_run(map: &Map, run: &MapRun) -> Result<Vec<LabeledStretch>, AppError> {
    let labels = map.labels(run).await?;
    let poses = map.poses(run).await?;
    let observations = map.reader().run(run.run).await?.observations(0, labels.len()).await?;
    let mut stretches = Vec::new();
    let mut first = 0;
    for group in labels.chunk_by(|a, b| a.label_idx == b.label_idx) {
        let last = first + group.len() - 1;
        let label = PlaceLabel::ALL.get(usize::from(group[0].label_idx)).copied();
        if let (Some(label), Some(driven)) = (label, observations.get(first..=last)) {
            let (start, end) = (&driven[0], &driven[driven.len() - 1]);
            let middle = pose_at(&poses, driven[driven.len() / 2].scan_seq);
            stretches.push(LabeledStretch {
                run: run.name.clone(),
                component: run.component,
                label,
                first: first as u64,
                last: last as u64,
                timestamps_ns: (start.timestamp_ns, end.timestamp_ns),
                length_m: end.travel_m - start.travel_m,
                turn_rad: start.run_from_robot.between(&end.run_from_robot).theta,
                confidence: group.iter().map(|label| f64::from(label.confidence)).sum::<f64>()
                    / group.len() as f64,
                map_from_middle: middle.or(poses.last().map(|pose| pose.map_from_robot)).unwrap_or_default(),
            });
        }
        first = last + 1;
    }
    Ok(stretches)
}

/// All labelled stretches of a version, in the order of runs and travel.
///
/// # Errors
/// Those of the storage.
pub async fn labels(map: &Map) -> Result<Vec<LabeledStretch>, AppError> {
    let mut labels = Vec::new();
    for run in map.record.runs.iter().filter(|run| run.num_labels > 0) {
        labels.extend(labels_of_run(map, run).await?);
    }
    Ok(labels)
}

/// Where a sequence of labels was driven, in either direction, the surest first.
///
/// # Errors
/// Those of the storage.
pub async fn find_labels(
    map: &Map,
    patterns: &[LabelPattern],
    limit: usize,
) -> Result<Vec<LabelAnswer>, AppError> {
    let mut answers = Vec::new();
    for run in map.record.runs.iter().filter(|run| run.num_labels > 0) {
        let stretches = without_flicker(labels_of_run(map, run).await?);
        for window in stretches.windows(patterns.len().max(1)) {
            for is_reversed in [false, true] {
                let mut driven = window.to_vec();
                if is_reversed {
                    driven.reverse();
                }
                let mut pairs = patterns.iter().zip(&driven);
                if pairs.all(|(pattern, stretch)| pattern.accepts(stretch, is_reversed)) {
                    let confidence = driven.iter().map(|stretch| stretch.confidence).fold(1.0, f64::min);
                    answers.push(LabelAnswer { stretches: driven, is_reversed, confidence });
                }
            }
        }
    }
    answers.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    answers.truncate(limit);
    Ok(answers)
}

/// Joins stretches of one label that only a short other one parts.
fn without_flicker(stretches: Vec<LabeledStretch>) -> Vec<LabeledStretch> {
    let mut joined: Vec<LabeledStretch> = Vec::new();
    for stretch in stretches {
        if stretch.length_m < FLICKER_M && !joined.is_empty() {
            continue;
        }
        match joined.last_mut() {
            Some(last) if last.label == stretch.label => {
                let (a_m, b_m) = (last.length_m.max(1e-9), stretch.length_m.max(1e-9));
                last.confidence = (last.confidence * a_m + stretch.confidence * b_m) / (a_m + b_m);
                last.last = stretch.last;
                last.timestamps_ns.1 = stretch.timestamps_ns.1;
                last.length_m += stretch.length_m;
                last.turn_rad += stretch.turn_rad;
            }
            _ => joined.push(stretch),
        }
    }
    joined
}
