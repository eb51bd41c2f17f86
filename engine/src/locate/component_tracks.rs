//! Where in one component of a map may the robot be? Supposed poses that are proposed, followed and given up.
//!
//! Poses are proposed — by a search of the recent surroundings over the whole component, or from outside — and every
//! proposal is followed back through all scans of the last metres. The right place explains every scan; a place that
//! merely looks alike sooner or later does not.

use std::collections::VecDeque;
use std::sync::Arc;

use super::localizer_config::LocalizerConfig;
use super::served_map::ServedMap;
use super::surroundings::surroundings;
use super::sweep::climb;
use super::track::{Moment, Track};
use crate::geometry::{Point2, Pose2, angle_between};

/// How far beside a proposal its best pose may lie at first, metres and radians.
const SEARCH_STEP: (f64, f64) = (0.2, 0.03);
/// Tracks kept after a search, at most.
const MAX_TRACKS: usize = 40;
/// Tracks whose evidence lags this far behind the best are given up, natural logarithm.
const HOPELESS: f64 = 15.0;

/// The tracks in one component.
#[derive(Clone, Debug)]
pub(super) struct ComponentTracks {
    pub component: u32,
    pub map: Arc<ServedMap>,
    /// Best evidence first.
    pub tracks: Vec<Track>,
}

impl ComponentTracks {
    pub const fn new(component: u32, map: Arc<ServedMap>) -> Self {
        Self { component, map, tracks: Vec::new() }
    }

    /// Follows all tracks to the last moment.
    pub fn follow(&mut self, moments: &VecDeque<Moment>, config: &LocalizerConfig) {
        let mut latest = moments.iter().rev();
        if let (Some(moment), Some(previous)) = (latest.next(), latest.next()) {
            for track in &mut self.tracks {
                track.follow(&self.map, &previous.run_from_robot, moment);
                track.forget_before(moments.len());
            }
        }
        self.prune(config);
    }

    /// Looks for the recent surroundings all over the component and follows back what comes out.
    pub fn search(&mut self, moments: &VecDeque<Moment>, config: &LocalizerConfig) {
        let points = config.search_points(moments);
        for proposal in self.map.pyramid.search(&points, &config.search) {
            let pose = climb(&self.map, &points, &proposal.map_from_robot, SEARCH_STEP);
            self.add(moments, &pose);
        }
        self.prune(config);
    }

    /// Takes a pose at the last moment that something else proposes.
    pub fn propose(&mut self, moments: &VecDeque<Moment>, map_from_robot: &Pose2, config: &LocalizerConfig) {
        let pose = climb(&self.map, &config.search_points(moments), map_from_robot, SEARCH_STEP);
        self.add(moments, &pose);
        self.prune(config);
    }

    /// Follows a pose at the last moment back through all moments, unless a track is there already.
    fn add(&mut self, moments: &VecDeque<Moment>, map_from_robot: &Pose2) {
        if !self.tracks.iter().any(|track| is_same_place(&track.map_from_robot, map_from_robot)) {
            self.tracks.push(Track::backwards(&self.map, moments, map_from_robot));
        }
    }

    /// Sorts by evidence, merges tracks that have met and gives up hopeless ones.
    fn prune(&mut self, config: &LocalizerConfig) {
        let mut judged: Vec<(f64, Track)> =
            self.tracks.drain(..).map(|track| (config.evidence(&track), track)).collect();
        judged.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best = judged.first().map_or(0.0, |(evidence, _)| *evidence);
        for (evidence, track) in judged {
            let has_met =
                self.tracks.iter().any(|kept| is_same_place(&kept.map_from_robot, &track.map_from_robot));
            if !has_met && evidence > best - HOPELESS && self.tracks.len() < MAX_TRACKS {
                self.tracks.push(track);
            }
        }
    }
}

impl LocalizerConfig {
    /// Evidence of a track, natural logarithm.
    pub(super) fn evidence(&self, track: &Track) -> f64 {
        track.evidence(self.evidence_per_scan, self.agreement_elsewhere)
    }

    fn search_points(&self, moments: &VecDeque<Moment>) -> Vec<Point2> {
        surroundings(moments, self.surroundings_m, self.search_range_m, self.max_search_points)
    }
}

fn is_same_place(a: &Pose2, b: &Pose2) -> bool {
    a.distance(b) < 0.5 && angle_between(a.theta, b.theta) < 0.25
}
