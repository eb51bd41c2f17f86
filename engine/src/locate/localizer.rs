//! A localisation session over one map: scans in, "where am I" out (SPEC section 6).
//!
//! Poses are proposed — by a search of the recent surroundings over the whole map, or from outside by profiles of what
//! was driven — and every proposal is judged by the same evidence: how all the scans of the last metres agree with the
//! map when the robot is followed from there. The right place explains every scan; a place that merely looks alike
//! sooner or later does not. A place off the map competes with a fixed agreement of its own, so that "lost" can win.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::global_search::GlobalSearchConfig;
use super::served_map::ServedMap;
use super::spread::covariance_around;
use super::surroundings::surroundings;
use super::sweep::{Sweep, climb};
use super::track::{Moment, Track};
use crate::config_error::ConfigError;
use crate::geometry::{Pose2, angle_between};
use crate::registration::{OdometryRefiner, RefinerConfig};
use crate::scan::{Scan, ScanGeometry};

/// How a session judges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalizerConfig {
    /// Refinement of the odometry.
    pub refiner: RefinerConfig,
    /// Search over the whole map.
    pub search: GlobalSearchConfig,
    /// Scans of this much travel are searched for together, metres.
    pub surroundings_m: f64,
    /// Points of them at most.
    pub max_search_points: usize,
    /// Travel between searches while the place is not known, metres.
    pub search_every_m: f64,
    /// Scans of this much travel are the evidence, metres.
    pub history_m: f64,
    /// Points of a scan used as evidence, at most.
    pub max_points: usize,
    /// Beams are evidence up to this length, metres: only far walls say how far along a corridor the robot is.
    pub range_max_m: f64,
    /// Surroundings up to this distance are searched for, metres.
    pub search_range_m: f64,
    /// What a whole scan of agreement is worth, natural logarithm; scans overlap, so less than a beam's likelihood.
    pub evidence_per_scan: f64,
    /// Agreement that a place off the map would show by chance.
    pub agreement_elsewhere: f64,
    /// Agreement below which nobody can be sure.
    pub agreement_sure: f64,
    /// Travel without which nobody can be sure, metres.
    pub min_travel_m: f64,
    /// Probability from which on the robot may be found …
    pub sure_probability: f64,
    /// … once one place has had at least this probability …
    pub leading_probability: f64,
    /// … for this much travel, metres: look-alikes lead for a moment, not for long.
    pub sure_for_m: f64,
}

impl Default for LocalizerConfig {
    fn default() -> Self {
        Self {
            refiner: RefinerConfig::default(),
            search: GlobalSearchConfig::default(),
            surroundings_m: 8.0,
            max_search_points: 250,
            search_every_m: 1.5,
            history_m: 25.0,
            max_points: 80,
            range_max_m: 20.0,
            search_range_m: 12.0,
            evidence_per_scan: 3.0,
            agreement_elsewhere: 0.6,
            agreement_sure: 0.75,
            min_travel_m: 3.0,
            sure_probability: 0.99,
            leading_probability: 0.9,
            sure_for_m: 2.0,
        }
    }
}

impl LocalizerConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let lengths = [
            ("surroundings_m", self.surroundings_m),
            ("search_every_m", self.search_every_m),
            ("history_m", self.history_m),
            ("range_max_m", self.range_max_m),
            ("search_range_m", self.search_range_m),
            ("evidence_per_scan", self.evidence_per_scan),
            ("sure_for_m", self.sure_for_m),
        ];
        for (name, value) in lengths {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must be above 0 and finite"));
            }
        }
        let shares = [
            ("agreement_elsewhere", self.agreement_elsewhere),
            ("agreement_sure", self.agreement_sure),
            ("sure_probability", self.sure_probability),
            ("leading_probability", self.leading_probability),
        ];
        for (name, value) in shares {
            if !(0.0..=1.0).contains(&value) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must lie in 0..=1"));
            }
        }
        if self.max_points == 0 || self.max_search_points == 0 {
            return Err(ConfigError::new(
                format!("{path}.max_points"),
                "and max_search_points must be above 0",
            ));
        }
        self.search.validate(&format!("{path}.search"))?;
        self.refiner.validate(&format!("{path}.refiner"))
    }
}

/// Whether the robot is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocalizationState {
    /// No place of the map explains what is seen, or nothing has been seen yet.
    #[default]
    Lost,
    /// Several places do, or one does not well enough.
    Ambiguous,
    /// One place does, and no other.
    Converged,
}

/// One answer to "where am I".
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Pose of the robot in the map.
    pub map_from_robot: Pose2,
    /// Covariance of (x, y, θ) in the map's axes, row by row.
    pub covariance: [[f64; 3]; 3],
    /// Probability that the robot is here, in [0, 1].
    pub probability: f64,
}

/// The answer of a session.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LocalizationEstimate {
    /// Whether the robot is found.
    pub state: LocalizationState,
    /// Distance driven since the session began, metres.
    pub travel_m: f64,
    /// Where the robot may be now, most probable first. What is missing to 1 is the probability of being elsewhere.
    pub hypotheses: Vec<Hypothesis>,
}

/// A session; a plain value of bounded size.
#[derive(Clone, Debug)]
pub struct Localizer {
    config: LocalizerConfig,
    geometry: ScanGeometry,
    refiner: OdometryRefiner,
    moments: VecDeque<Moment>,
    tracks: Vec<Track>,
    run_from_robot: Pose2,
    travel_m: f64,
    searched_at_m: Option<f64>,
    /// Travel since which one place has led.
    leading_since_m: Option<f64>,
    state: LocalizationState,
}

/// How far beside a proposal its best pose may lie at first, metres and radians.
const SEARCH_STEP: (f64, f64) = (0.2, 0.03);
/// Tracks kept after a search, at most.
const MAX_TRACKS: usize = 40;
/// Tracks whose evidence lags this far behind the best are given up, natural logarithm.
const HOPELESS: f64 = 15.0;
/// Moments that decide whether a known place still fits.
const RECENT_MOMENTS: usize = 15;

impl Localizer {
    /// A session that has seen nothing.
    pub fn new(geometry: ScanGeometry, config: LocalizerConfig) -> Self {
        Self {
            refiner: OdometryRefiner::new(&config.refiner),
            config,
            geometry,
            moments: VecDeque::new(),
            tracks: Vec::new(),
            run_from_robot: Pose2::identity(),
            travel_m: 0.0,
            searched_at_m: None,
            leading_since_m: None,
            state: LocalizationState::Lost,
        }
    }

    /// Takes the next scan.
    pub fn push(&mut self, map: &ServedMap, scan: &Scan) {
        let refined = self.refiner.refine(&self.geometry, scan);
        self.run_from_robot = refined.run_from_robot;
        if refined.keyframe.is_none() {
            return;
        }
        self.remember(scan);
        self.follow(map);
        self.give_up_what_no_longer_fits();
        if self.is_search_due() {
            self.search(map);
        }
        self.state = self.decide();
    }

    /// Takes a pose that something else proposes for the robot as of the last scan.
    pub fn propose(&mut self, map: &ServedMap, map_from_robot: &Pose2) {
        let Some(moment) = self.moments.back() else { return };
        let at_moment = map_from_robot.compose(&self.run_from_robot.between(&moment.run_from_robot));
        let points = surroundings(
            &self.moments,
            self.config.surroundings_m,
            self.config.search_range_m,
            self.config.max_search_points,
        );
        let pose = climb(map, &points, &at_moment, SEARCH_STEP);
        self.judge(map, &pose);
        self.prune();
        self.state = self.decide();
    }

    /// Metres driven since the session began.
    pub const fn travel_m(&self) -> f64 {
        self.travel_m
    }

    /// The answer as it stands.
    pub fn estimate(&self, map: &ServedMap) -> LocalizationEstimate {
        let since_moment = match self.moments.back() {
            Some(moment) => moment.run_from_robot.between(&self.run_from_robot),
            None => Pose2::identity(),
        };
        let points = surroundings(&self.moments, 3.0, self.config.range_max_m, 120);
        let hypothesis = |(track, probability): (&Track, f64)| Hypothesis {
            map_from_robot: track.map_from_robot.compose(&since_moment),
            covariance: covariance_around(map, &points, &track.map_from_robot),
            probability,
        };
        let likely =
            self.tracks.iter().zip(self.probabilities()).filter(|(_, probability)| *probability >= 0.01);
        LocalizationEstimate {
            state: self.state,
            travel_m: self.travel_m,
            hypotheses: likely.map(hypothesis).collect(),
        }
    }

    /// Whether the robot is found, as of the last keyframe.
    pub const fn state(&self) -> LocalizationState {
        self.state
    }

    /// Keeps a keyframe and forgets those too far back.
    fn remember(&mut self, scan: &Scan) {
        if let Some(last) = self.moments.back() {
            self.travel_m += last.run_from_robot.distance(&self.run_from_robot);
        }
        let sweep =
            Sweep::new(&self.geometry, &scan.ranges_m, self.config.range_max_m, self.config.max_points);
        self.moments.push_back(Moment {
            travel_m: self.travel_m,
            run_from_robot: self.run_from_robot,
            sweep,
        });
        let oldest_m = self.travel_m - self.config.history_m;
        // A robot that turns on the spot makes keyframes without travel.
        let max_moments = (self.config.history_m / self.config.refiner.keyframe_distance_m) as usize * 2 + 1;
        while self.moments.front().is_some_and(|moment| moment.travel_m < oldest_m)
            || self.moments.len() > max_moments
        {
            self.forget_oldest();
        }
    }

    fn forget_oldest(&mut self) {
        self.moments.pop_front();
        for track in &mut self.tracks {
            // The newest moment has no agreement yet while tracks still have to follow.
            while track.agreements.len() > self.moments.len() {
                track.agreements.pop_front();
            }
        }
    }

    fn follow(&mut self, map: &ServedMap) {
        let mut latest = self.moments.iter().rev();
        if let (Some(moment), Some(previous)) = (latest.next(), latest.next()) {
            for track in &mut self.tracks {
                track.follow(map, &previous.run_from_robot, moment);
                while track.agreements.len() > self.moments.len() {
                    track.agreements.pop_front();
                }
            }
        }
        self.prune();
    }

    /// A robot that was carried away contradicts its map all at once; then only the latest scans count.
    fn give_up_what_no_longer_fits(&mut self) {
        let Some(best) = self.tracks.first() else { return };
        let recent = best.recent(RECENT_MOMENTS);
        let is_known = self.state == LocalizationState::Converged && self.moments.len() > 2 * RECENT_MOMENTS;
        if is_known && recent.coverage > 0.3 && recent.share < self.config.agreement_elsewhere {
            while self.moments.len() > RECENT_MOMENTS {
                self.forget_oldest();
            }
            self.tracks.clear();
            (self.searched_at_m, self.leading_since_m) = (None, None);
        }
    }

    fn is_search_due(&self) -> bool {
        let every_m = match self.state {
            LocalizationState::Converged => self.config.history_m / 2.0,
            _ => self.config.search_every_m,
        };
        self.travel_m >= 1.0 && self.searched_at_m.is_none_or(|at_m| self.travel_m - at_m >= every_m)
    }

    /// Looks for the recent surroundings all over the map and judges what comes out.
    fn search(&mut self, map: &ServedMap) {
        self.searched_at_m = Some(self.travel_m);
        let points = surroundings(
            &self.moments,
            self.config.surroundings_m,
            self.config.search_range_m,
            self.config.max_search_points,
        );
        for proposal in map.pyramid.search(&points, &self.config.search) {
            let pose = climb(map, &points, &proposal.map_from_robot, SEARCH_STEP);
            self.judge(map, &pose);
        }
        self.prune();
    }

    /// Judges a pose at the last moment by all moments, unless a track is there already.
    fn judge(&mut self, map: &ServedMap, map_from_robot: &Pose2) {
        if !self.tracks.iter().any(|track| is_same_place(&track.map_from_robot, map_from_robot)) {
            self.tracks.push(Track::backwards(map, &self.moments, map_from_robot));
        }
    }

    /// Sorts by evidence, merges tracks that have met and gives up hopeless ones.
    fn prune(&mut self) {
        let mut judged: Vec<(f64, Track)> =
            self.tracks.drain(..).map(|track| (self.config.evidence(&track), track)).collect();
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

    /// Probability of each track, the place off the map taking part with evidence 0.
    fn probabilities(&self) -> Vec<f64> {
        let evidence: Vec<f64> = self.tracks.iter().map(|track| self.config.evidence(track)).collect();
        let best = evidence.iter().copied().fold(0.0, f64::max);
        let weights: Vec<f64> = evidence.iter().map(|value| (value - best).exp()).collect();
        let total = weights.iter().sum::<f64>() + (-best).exp();
        weights.iter().map(|weight| weight / total).collect()
    }

    /// Says whether the robot is found, and notes since when one place has led.
    fn decide(&mut self) -> LocalizationState {
        let config = &self.config;
        let probabilities = self.probabilities();
        let known: f64 = probabilities.iter().sum();
        let best = self.tracks.first().zip(probabilities.first());
        let (fits, probability) = best.map_or((false, 0.0), |(best, &probability)| {
            (best.recent(usize::MAX).share >= config.agreement_sure, probability)
        });
        let leads = fits && probability >= config.leading_probability;
        self.leading_since_m = if leads { self.leading_since_m.or(Some(self.travel_m)) } else { None };
        let has_lasted =
            self.leading_since_m.is_some_and(|since_m| self.travel_m - since_m >= config.sure_for_m);
        // A robot that is found stays found while its place leads: the next search may propose a place just beside.
        let is_sure = probability >= config.sure_probability || self.state == LocalizationState::Converged;
        match (has_lasted && is_sure && self.travel_m >= config.min_travel_m, known > 0.5) {
            (true, _) => LocalizationState::Converged,
            (false, true) => LocalizationState::Ambiguous,
            (false, false) => LocalizationState::Lost,
        }
    }
}

impl LocalizerConfig {
    fn evidence(&self, track: &Track) -> f64 {
        track.evidence(self.evidence_per_scan, self.agreement_elsewhere)
    }
}

fn is_same_place(a: &Pose2, b: &Pose2) -> bool {
    a.distance(b) < 0.5 && angle_between(a.theta, b.theta) < 0.25
}
