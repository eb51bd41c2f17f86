//! Everything that a question by example reads of one map, prepared once.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::calibration::PlaceEvidence;
use super::config::RecallConfig;
use super::example::{Example, OUTLINE, SKETCH};
use super::proposals::{Proposal, proposals};
use crate::geometry::{Point2, Pose2, angle_between};
use crate::registration::{Area, AreaBuilder, AreaFit, AreaSearch, SearchWindow, Submap, SubmapConfig};
use crate::retrieval::{ProfileIndex, RunProfile};
use crate::scan::ScanGeometry;
use crate::text::{Direction, Interval, Observation};

/// Where the end of a recording may lie beside what the whole says, metres and radians.
const TAIL_WINDOW: (f64, f64) = (0.3, 0.1);
/// Two answers closer than this are one, metres and radians.
const SAME_ANSWER: (f64, f64) = (0.7, 0.3);

/// A run as it lies in the map.
#[derive(Clone, Debug)]
pub struct PlacedDrive {
    /// The frame of its poses.
    pub component: u32,
    /// Poses of its observations, in order.
    pub map_from_observations: Vec<Pose2>,
}

/// Takes a map run by run and scan by scan.
#[derive(Clone, Debug)]
pub struct PlaceIndexBuilder {
    config: RecallConfig,
    profiles: Vec<RunProfile>,
    drives: Vec<PlacedDrive>,
    areas: Vec<AreaBuilder>,
}

impl PlaceIndexBuilder {
    /// An index of nothing.
    pub fn new(config: &RecallConfig) -> Self {
        Self { config: config.clone(), profiles: Vec::new(), drives: Vec::new(), areas: Vec::new() }
    }

    /// Adds the text side of the next run, in the order of the site.
    pub fn add_run(&mut self, observations: &[Observation], drive: PlacedDrive) {
        let spacing_m = self.config.retrieval.sample_spacing_m;
        self.profiles.push(RunProfile::from_observations(observations, spacing_m));
        self.drives.push(drive);
    }

    /// Adds a scan to a component's area.
    pub fn add_scan(
        &mut self,
        component: u32,
        geometry: &ScanGeometry,
        map_from_robot: &Pose2,
        ranges_m: &[f32],
    ) {
        while self.areas.len() <= component as usize {
            self.areas.push(AreaBuilder::new(&self.config.submap));
        }
        self.areas[component as usize].add_scan(geometry, map_from_robot, ranges_m);
    }

    /// The index.
    pub fn finish(self) -> PlaceIndex {
        PlaceIndex {
            profiles: ProfileIndex::build(self.profiles, self.config.retrieval),
            drives: self.drives,
            areas: self.areas.into_iter().map(AreaBuilder::finish).collect(),
        }
    }
}

/// The profiles of everything driven and the areas to register in.
#[derive(Clone, Debug)]
pub struct PlaceIndex {
    pub(super) profiles: ProfileIndex,
    pub(super) drives: Vec<PlacedDrive>,
    areas: Vec<Area>,
}

/// A place where a recording may have been made.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPlace {
    /// The frame of the pose.
    pub component: u32,
    /// The run and its stretch that led here.
    pub earlier: Interval,
    /// Which way that was driven.
    pub direction: Direction,
    /// Where the recording ends.
    pub map_from_robot: Pose2,
    /// Covariance of (x, y, θ) in the map's axes; long along a plain corridor.
    pub covariance: Matrix3<f64>,
    /// What speaks for it.
    pub evidence: PlaceEvidence,
    /// Logarithm of its odds against being nowhere in the map.
    pub log_odds: f64,
}

impl PlaceIndex {
    /// Bytes in memory, about.
    pub fn num_bytes(&self) -> usize {
        let areas: usize = self.areas.iter().map(Area::num_bytes).sum();
        let poses: usize = self.drives.iter().map(|drive| drive.map_from_observations.len()).sum();
        let samples: usize = self.profiles.runs().iter().map(RunProfile::len).sum();
        areas + poses * size_of::<Pose2>() + samples * 8
    }

    /// Places of a recording, the best first; none is no place worth a word.
    pub fn find(&self, example: &Example, config: &RecallConfig) -> Vec<FoundPlace> {
        // Cheap and often wrong: profiles propose.
        let proposed: Vec<Seen> = proposals(self, example, config)
            .into_iter()
            .map(|proposal| Seen { proposal, map_from_submap: proposal.map_from_submap, share: 0.0 })
            .collect();
        // Dearer: a sketch of the recording, then its outline, is laid around each proposal.
        let sketched = self.searched(proposed, &example.sketch, &SKETCH.1, config);
        let likely = distinct(sketched, config.max_searched);
        let searched = self.searched(likely, &example.outline, &OUTLINE.1, config);
        // Dearest: alignment to the surfaces, and what the two say of each other.
        let mut places: Vec<(Seen, AreaFit, f64)> = distinct(searched, config.max_aligned)
            .into_par_iter()
            .filter_map(|seen| self.judge(example, seen, config))
            .collect();
        places.sort_by(|a, b| b.2.total_cmp(&a.2));
        let mut answers: Vec<(Seen, AreaFit, f64)> = Vec::new();
        for place in places {
            let is_known = |known: &(Seen, AreaFit, f64)| {
                known.0.proposal.component == place.0.proposal.component
                    && is_same_answer(&known.1.map_from_submap, &place.1.map_from_submap)
            };
            if answers.len() < config.max_places && !answers.iter().any(is_known) {
                answers.push(place);
            }
        }
        answers
            .into_par_iter()
            .filter_map(|(seen, fit, log_odds)| self.answer(example, &seen, &fit, log_odds, config))
            .collect()
    }

    /// How a submap lies in a component near a pose; none where nothing is known, or of a component that is not kept.
    pub fn fit(
        &self,
        component: u32,
        submap: &Submap,
        map_from_submap: &Pose2,
        config: &SubmapConfig,
    ) -> Option<AreaFit> {
        let window =
            SearchWindow { center: *map_from_submap, half_m: TAIL_WINDOW.0, half_turn_rad: TAIL_WINDOW.1 };
        self.areas.get(component as usize)?.align(submap, map_from_submap, &window, config)
    }

    /// Searches around each place with some points of the recording.
    fn searched(
        &self,
        places: Vec<Seen>,
        points: &[Point2],
        settings: &AreaSearch,
        config: &RecallConfig,
    ) -> Vec<Seen> {
        let search = |seen: Seen| {
            let window = SearchWindow {
                center: seen.proposal.map_from_submap,
                half_m: config.search_half_m,
                half_turn_rad: config.search_half_turn_rad,
            };
            let area = self.areas.get(seen.proposal.component as usize)?;
            let (map_from_submap, share) = area.search(points, &window, settings)?;
            Some(Seen { map_from_submap, share, ..seen })
        };
        places.into_par_iter().filter_map(search).collect()
    }

    fn judge(&self, example: &Example, seen: Seen, config: &RecallConfig) -> Option<(Seen, AreaFit, f64)> {
        let area = self.areas.get(seen.proposal.component as usize)?;
        let window = SearchWindow {
            center: seen.map_from_submap,
            half_m: config.search_half_m,
            half_turn_rad: config.search_half_turn_rad,
        };
        let fit = area.align(&example.submap, &seen.map_from_submap, &window, &config.submap)?;
        Some((seen, fit, config.calibration.log_odds(&seen.evidence(&fit))))
    }

    /// What is said of a place; the last metres settle where exactly the recording ends, as odometry drifts over the
    /// whole of it.
    fn answer(
        &self,
        example: &Example,
        seen: &Seen,
        fit: &AreaFit,
        log_odds: f64,
        config: &RecallConfig,
    ) -> Option<FoundPlace> {
        let area = self.areas.get(seen.proposal.component as usize)?;
        let map_from_run = fit.map_from_submap.compose(&example.run_from_submap.inverse());
        let tail = map_from_run.compose(&example.run_from_tail);
        let near = SearchWindow { center: tail, half_m: TAIL_WINDOW.0, half_turn_rad: TAIL_WINDOW.1 };
        let tail_fit = area.align(&example.tail, &tail, &near, &config.submap);
        let tail = tail_fit.map_or(tail, |fit| fit.map_from_submap);
        let submap_from_robot = example.run_from_submap.between(&example.run_from_robot);
        Some(FoundPlace {
            component: seen.proposal.component,
            earlier: seen.proposal.earlier,
            direction: seen.proposal.direction,
            map_from_robot: tail.compose(&example.run_from_tail.between(&example.run_from_robot)),
            covariance: fit.map_from_submap.compose_covariance(
                &fit.covariance,
                &submap_from_robot,
                &Matrix3::zeros(),
            ),
            evidence: seen.evidence(fit),
            log_odds,
        })
    }
}

/// A proposal and where a search put it.
#[derive(Clone, Copy, Debug)]
struct Seen {
    proposal: Proposal,
    map_from_submap: Pose2,
    share: f64,
}

impl Seen {
    fn evidence(&self, fit: &AreaFit) -> PlaceEvidence {
        PlaceEvidence {
            profile_score: self.proposal.score,
            profile_support: self.proposal.total_score,
            resemblance: self.proposal.resemblance,
            search_share: self.share,
            fit: *fit,
        }
    }
}

/// The best few places that differ from one another.
fn distinct(mut places: Vec<Seen>, num_max: usize) -> Vec<Seen> {
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    let mut kept: Vec<Seen> = Vec::new();
    for place in places {
        let is_known = |known: &Seen| {
            known.proposal.component == place.proposal.component
                && is_same_answer(&known.map_from_submap, &place.map_from_submap)
        };
        if kept.len() < num_max && !kept.iter().any(is_known) {
            kept.push(place);
        }
    }
    kept
}

fn is_same_answer(a: &Pose2, b: &Pose2) -> bool {
    a.distance(b) < SAME_ANSWER.0 && angle_between(a.theta, b.theta) < SAME_ANSWER.1
}
