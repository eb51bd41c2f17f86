//! Labels of a whole map, component by component.

use std::collections::BTreeMap;

use super::config::SemanticsConfig;
use super::label::PlaceLabel;
use super::label_map::{DrivenRun, label_runs};
use super::places::PlaceMap;
use crate::mapping::{RunRecord, SiteMap};

/// What is known of the places of a map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapLabels {
    /// For every observation of every run the label that its place has, and the share of what was seen in passing that
    /// agrees with the label of the pass. Empty for a run that is not in the map.
    pub labels: Vec<Vec<(PlaceLabel, f32)>>,
    /// The places of each component, ascending.
    pub places: Vec<(u32, PlaceMap)>,
}

impl MapLabels {
    /// Labels everything that the runs of a map drove through.
    pub fn of(runs: &[RunRecord<'_>], map: &SiteMap, config: &SemanticsConfig) -> Self {
        let mut by_component: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (run_idx, mapped) in map.runs.iter().enumerate() {
            if !mapped.map_from_keyframes.is_empty() {
                by_component.entry(mapped.component).or_default().push(run_idx);
            }
        }
        let mut known = Self { labels: vec![Vec::new(); runs.len()], places: Vec::new() };
        for (component, members) in by_component {
            let driven: Vec<DrivenRun<'_>> = members
                .iter()
                .map(|&run_idx| DrivenRun::in_map(&runs[run_idx], &map.runs[run_idx]))
                .collect();
            let passes = label_runs(config, &driven);
            let places = PlaceMap::build(config, &driven, &passes);
            for (member_idx, (&run_idx, pass)) in members.iter().zip(&passes).enumerate() {
                let labels = places.labels_of_run(member_idx);
                known.labels[run_idx] = labels.into_iter().zip(pass.confidences.iter().copied()).collect();
            }
            known.places.push((component, places));
        }
        known
    }
}
