//! "Where am I": a session over all components of one map, scans in, places with probabilities out (SPEC section 6).
//!
//! ```text
//! scan ─► refined odometry ─► moment (every keyframe; the last metres are kept)
//!      ─► tracks of every component: search, follow, give up          proposals, cheap and often wrong
//!      ─► the best few laid into the map, as a query by example is    what map and recording say of each other
//!      ─► probabilities, "not in this map" among them ─► lost, ambiguous or converged
//! ```
//!
//! The scans of the last metres are laid into the map in a few pieces, in each every cell once: a long corridor seen for
//! the hundredth time is no new evidence. Returns where the map knows free space, surfaces of the map that the robot saw
//! through and space beyond the map all count against a place.

use std::collections::VecDeque;
use std::sync::Arc;

use super::component_tracks::ComponentTracks;
use super::localizer_config::LocalizerConfig;
use super::pieces::{ChainFit, FinishedPieces, Piece, lay_chain};
use super::prior::PosePrior;
use super::served_map::ServedMap;
use super::session_answer::{Hypothesis, LocalizationEstimate, LocalizationState, Missing};
use super::spread::covariance_around;
use super::surroundings::surroundings;
use super::sweep::Sweep;
use super::track::Moment;
use crate::geometry::{Point2, Pose2, angle_between};
use crate::recall::{Calibration, Example, PlaceIndex, RecallConfig, RecentScans};
use crate::registration::{AreaFit, OdometryRefiner, SubmapConfig};
use crate::scan::{Scan, ScanGeometry};
use crate::translator::TranslatorConfig;

/// Places laid into the map each time, of all components together.
const NUM_JUDGED_MAX: usize = 6;
/// Two fits closer than this are one place, metres and radians.
const SAME_FIT: (f64, f64) = (0.3, 0.1);
/// A place found again within this of where it was expected is the same, metres and radians.
const SAME_LEADER: (f64, f64) = (0.6, 0.25);
/// Metres between two searches for each metre since the session began or began anew.
const SEARCH_INTERVAL: f64 = 0.25;
/// A piece that has just begun reaches back at least so far, metres.
const NEWEST_PIECE_MIN_M: f64 = 3.0;
/// Travel before anything is looked for, metres.
const FIRST_SEARCH_M: f64 = 0.8;
/// Less probable places are not answered.
const PROBABILITY_MIN: f64 = 0.01;

/// What a session is told of a site's configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SessionConfig {
    /// How it searches and judges.
    pub localizer: LocalizerConfig,
    /// How its last metres are asked about.
    pub recall: RecallConfig,
    /// How these are translated.
    pub translator: TranslatorConfig,
}

/// The map that a session looks in.
#[derive(Clone, Debug)]
pub struct SessionMap {
    /// Components with their numbers, prepared for search.
    pub components: Vec<(u32, Arc<ServedMap>)>,
    /// The same map prepared for questions by example.
    pub index: Arc<PlaceIndex>,
}

/// A supposed place of the robot with everything that was found out about it.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedPlace {
    /// The component whose frame the poses are in.
    pub component: u32,
    /// Pose of the robot at the last moment that was judged.
    pub map_from_robot: Pose2,
    /// How far the evidence of the followed pose lags behind that of the best place, natural logarithm, at most 0.
    pub lag: f64,
    /// How the last metres lie in the map.
    pub chain: ChainFit,
    /// How what was seen last does.
    pub recent_fit: Option<AreaFit>,
    /// Logarithm of the odds against being nowhere in the map.
    pub log_odds: f64,
    /// Probability that the robot is here.
    pub probability: f64,
}

/// A session; a plain value of bounded size.
#[derive(Clone, Debug)]
pub struct SiteSession {
    config: Arc<SessionConfig>,
    geometry: ScanGeometry,
    index: Arc<PlaceIndex>,
    prior: Option<PosePrior>,
    refiner: OdometryRefiner,
    moments: VecDeque<Moment>,
    recent: RecentScans,
    finished: FinishedPieces,
    parts: Vec<ComponentTracks>,
    run_from_start: Option<Pose2>,
    run_from_robot: Pose2,
    travel_m: f64,
    /// Travel when the session began, or began anew.
    began_at_m: f64,
    searched_at_m: Option<f64>,
    recalled_at_m: f64,
    judged_at_m: Option<f64>,
    /// Where the robot was in its own frame when the places were judged.
    run_from_judged: Pose2,
    /// Most probable first.
    judged: Vec<JudgedPlace>,
    /// Travel since which one place has led.
    leading_since_m: Option<f64>,
    /// Judgements in a row that what was seen last contradicts the place of a robot that was found.
    num_contradictions: usize,
    state: LocalizationState,
    missing: Vec<Missing>,
}

impl SiteSession {
    /// A session that has seen nothing; a declared rough pose is weighed, not believed.
    pub fn new(
        geometry: ScanGeometry,
        config: Arc<SessionConfig>,
        map: SessionMap,
        prior: Option<PosePrior>,
    ) -> Self {
        let tracks = |(component, map)| ComponentTracks::new(component, map);
        Self {
            refiner: OdometryRefiner::new(&config.localizer.refiner),
            recent: RecentScans::new(config.recall.length_max_m),
            config,
            geometry,
            index: map.index,
            prior,
            moments: VecDeque::new(),
            finished: FinishedPieces::default(),
            parts: map.components.into_iter().map(tracks).collect(),
            run_from_start: None,
            run_from_robot: Pose2::identity(),
            travel_m: 0.0,
            began_at_m: 0.0,
            searched_at_m: None,
            recalled_at_m: 0.0,
            judged_at_m: None,
            run_from_judged: Pose2::identity(),
            judged: Vec::new(),
            leading_since_m: None,
            num_contradictions: 0,
            state: LocalizationState::Lost,
            missing: vec![Missing::Travel],
        }
    }

    /// Takes the next scan.
    pub fn push(&mut self, scan: &Scan) {
        let refined = self.refiner.refine(&self.geometry, scan);
        if refined.cut.is_some() {
            // Nothing tells where it was carried: what it saw before does not count any more.
            self.start_anew(self.travel_m);
            self.forget(self.moments.len());
            self.run_from_start = None;
        }
        self.run_from_robot = refined.run_from_robot;
        self.run_from_start.get_or_insert(refined.run_from_robot);
        self.recent.push(scan);
        if refined.keyframe.is_none() {
            return;
        }
        self.remember(scan);
        self.finish_piece();
        let config = Arc::clone(&self.config);
        for part in &mut self.parts {
            part.follow(&self.moments, &config.localizer);
        }
        self.look_for_places();
        if is_due(self.judged_at_m, self.settings().judge_every_m, self.travel_m)
            && self.travel_m >= FIRST_SEARCH_M
        {
            self.judged_at_m = Some(self.travel_m);
            self.judge();
            self.decide();
        }
    }

    /// Metres driven since the session began.
    pub const fn travel_m(&self) -> f64 {
        self.travel_m
    }

    /// Whether the robot is found, as of the last judgement.
    pub const fn state(&self) -> LocalizationState {
        self.state
    }

    /// The places judged last, most probable first, as of [`SiteSession::since_judged`] ago.
    pub fn judged(&self) -> &[JudgedPlace] {
        &self.judged
    }

    /// Motion since the places were judged.
    pub fn since_judged(&self) -> Pose2 {
        self.run_from_judged.between(&self.run_from_robot)
    }

    /// The answer as it stands.
    pub fn estimate(&self) -> LocalizationEstimate {
        let points = surroundings(&self.moments, 3.0, self.settings().range_max_m, 120);
        let since = self.since_judged();
        let hypothesis = |place: &JudgedPlace| Hypothesis {
            component: place.component,
            map_from_robot: place.map_from_robot.compose(&since),
            covariance: self.covariance_at(place, &points),
            probability: place.probability,
        };
        let known: f64 = self.judged.iter().map(|place| place.probability).sum();
        let best = self.judged.first().filter(|best| best.probability > 0.5);
        LocalizationEstimate {
            state: self.state,
            travel_m: self.travel_m,
            hypotheses: self
                .judged
                .iter()
                .filter(|place| place.probability >= PROBABILITY_MIN)
                .map(hypothesis)
                .collect(),
            probability_elsewhere: (1.0 - known).max(0.0),
            missing: self.missing.clone(),
            prior_agrees: self.prior.as_ref().zip(best).map(|(prior, best)| {
                prior
                    .agrees(best.component, &self.map_from_start(&best.map_from_robot, &self.run_from_judged))
            }),
        }
    }

    fn settings(&self) -> &LocalizerConfig {
        &self.config.localizer
    }

    /// Covariance of a place, from points in the frame of the last moment.
    fn covariance_at(&self, place: &JudgedPlace, points: &[Point2]) -> [[f64; 3]; 3] {
        let run_from_moment =
            self.moments.back().map_or(self.run_from_judged, |moment| moment.run_from_robot);
        let map_from_moment = place.map_from_robot.compose(&self.run_from_judged.between(&run_from_moment));
        let part = self.parts.iter().find(|part| part.component == place.component);
        part.map_or([[0.0; 3]; 3], |part| covariance_around(&part.map, points, &map_from_moment))
    }

    /// Where the session would have begun for a robot that is now here.
    fn map_from_start(&self, map_from_robot: &Pose2, run_from_robot: &Pose2) -> Pose2 {
        let run_from_start = self.run_from_start.unwrap_or_default();
        map_from_robot.compose(&run_from_robot.between(&run_from_start))
    }

    /// Keeps a keyframe and forgets those too far back.
    fn remember(&mut self, scan: &Scan) {
        if let Some(last) = self.moments.back() {
            self.travel_m += last.run_from_robot.distance(&self.run_from_robot);
        }
        let settings = self.settings();
        let moment = Moment {
            travel_m: self.travel_m,
            run_from_robot: self.run_from_robot,
            sweep: Sweep::new(&self.geometry, &scan.ranges_m, settings.range_max_m, settings.max_points),
            ranges_m: scan.ranges_m.clone().into(),
        };
        // A robot that turns on the spot makes keyframes without travel.
        let num_max = (settings.history_m / settings.refiner.keyframe_distance_m) as usize * 2 + 1;
        let oldest_m = self.travel_m - settings.history_m;
        self.moments.push_back(moment);
        let num_excess = self.moments.len().saturating_sub(num_max);
        self.forget(self.moments.partition_point(|moment| moment.travel_m < oldest_m).max(num_excess));
    }

    /// Forgets the oldest moments.
    fn forget(&mut self, num_moments: usize) {
        self.moments.drain(..num_moments);
        for track in self.parts.iter_mut().flat_map(|part| &mut part.tracks) {
            track.forget_before(self.moments.len());
        }
    }

    /// Ends the piece that is being driven when it is long enough.
    fn finish_piece(&mut self) {
        let (piece_m, history_m) = (self.settings().piece_m, self.settings().history_m);
        if self.travel_m - self.finished.until_m() >= piece_m {
            let piece = self.piece_since(self.finished.until_m());
            let num_max = (history_m / piece_m) as usize;
            self.finished.push(piece, self.travel_m, num_max);
        }
    }

    /// Searches the map, and asks where the last metres were driven, each time some metres were driven.
    fn look_for_places(&mut self) {
        let config = Arc::clone(&self.config);
        let settings = &config.localizer;
        let is_found = self.state == LocalizationState::Converged;
        // What a search did not propose the next ones hardly will: they become rarer with the way.
        let every_m = (SEARCH_INTERVAL * (self.travel_m - self.began_at_m)).max(settings.search_every_m);
        let every_m = if is_found { settings.history_m / 2.0 } else { every_m.min(settings.history_m / 2.0) };
        if self.travel_m >= FIRST_SEARCH_M && is_due(self.searched_at_m, every_m, self.travel_m) {
            self.searched_at_m = Some(self.travel_m);
            for part in &mut self.parts {
                part.search(&self.moments, settings);
            }
            self.propose_declared();
        }
        if !is_found && self.travel_m >= self.recalled_at_m + settings.recall_every_m {
            self.recalled_at_m = self.travel_m;
            self.recall();
        }
    }

    /// Proposes the declared place.
    fn propose_declared(&mut self) {
        let (Some(prior), Some(start)) = (&self.prior, &self.run_from_start) else { return };
        let map_from_robot = prior.map_from_robot().compose(&start.between(&self.run_from_robot));
        if let Some(part) = self.parts.iter_mut().find(|part| part.component == prior.component()) {
            part.propose(&self.moments, &map_from_robot, &self.config.localizer);
        }
    }

    /// Asks where the last metres were driven, and proposes the answers.
    fn recall(&mut self) {
        let config = &self.config;
        let read = Example::read(&config.translator, &self.geometry, self.recent.scans(), &config.recall);
        // A laser that the translator refuses has no text; the search goes on without.
        let Some(example) = read.ok().flatten() else { return };
        for found in self.index.find(&example, &config.recall) {
            if let Some(part) = self.parts.iter_mut().find(|part| part.component == found.component) {
                part.propose(&self.moments, &found.map_from_robot, &config.localizer);
            }
        }
    }

    /// Lays the last metres into the map at the best places and gives these their probabilities.
    fn judge(&mut self) {
        let settings = self.settings();
        let mut best: Vec<(f64, u32, Pose2)> = Vec::new();
        for part in &self.parts {
            let tracks = part.tracks.iter().take(NUM_JUDGED_MAX);
            best.extend(tracks.map(|track| (settings.evidence(track), part.component, track.map_from_robot)));
        }
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        best.truncate(NUM_JUDGED_MAX);
        let newest = self.piece_since(
            self.finished.until_m().min(self.travel_m - NEWEST_PIECE_MIN_M).max(self.began_at_m),
        );
        let recent = self.piece_since(self.travel_m - settings.recent_m);
        let mut judged: Vec<JudgedPlace> = Vec::new();
        let best_evidence = best.first().map_or(0.0, |place| place.0);
        for (evidence, component, map_from_robot) in best {
            let lag = evidence - best_evidence;
            if let Some(place) = self.laid_into_map(component, map_from_robot, lag, (&newest, &recent))
                && !judged.iter().any(|known| is_same_fit(known, &place))
            {
                judged.push(place);
            }
        }
        let log_odds: Vec<f64> = judged.iter().map(|place| place.log_odds).collect();
        for (place, probability) in judged.iter_mut().zip(Calibration::probabilities(&log_odds)) {
            place.probability = probability;
        }
        judged.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        if !self.is_leader_of(&judged) {
            self.leading_since_m = None;
        }
        self.judged = judged;
        self.run_from_judged = self.run_from_robot;
    }

    /// Whether the place that led leads again.
    fn is_leader_of(&self, judged: &[JudgedPlace]) -> bool {
        let (Some(before), Some(now)) = (self.judged.first(), judged.first()) else { return false };
        let expected = before.map_from_robot.compose(&self.since_judged());
        before.component == now.component && is_near(&expected, &now.map_from_robot, SAME_LEADER)
    }

    fn laid_into_map(
        &self,
        component: u32,
        map_from_robot: Pose2,
        lag: f64,
        (newest, recent): (&Piece, &Piece),
    ) -> Option<JudgedPlace> {
        let map_from_run = map_from_robot.compose(&self.run_from_robot.inverse());
        let map = (&*self.index, component, self.submap_config());
        let since = self.since_judged();
        let known = self.judged.iter().find(|place| {
            place.component == component
                && is_near(&place.map_from_robot.compose(&since), &map_from_robot, SAME_LEADER)
        });
        let chain = lay_chain(newest, &self.finished, map, &map_from_run, known.map(|place| &place.chain))?;
        let start = self.map_from_start(&map_from_robot, &self.run_from_robot);
        let declared = self.prior.as_ref().map_or(0.0, |prior| prior.log_odds(component, &start));
        Some(JudgedPlace {
            component,
            map_from_robot,
            lag,
            recent_fit: recent.fit(map, &map_from_run),
            log_odds: self.settings().log_odds(&chain, lag) + declared,
            chain,
            probability: 0.0,
        })
    }

    fn submap_config(&self) -> &SubmapConfig {
        &self.config.recall.submap
    }

    /// The piece driven from some travel on.
    fn piece_since(&self, from_m: f64) -> Piece {
        let first = self.moments.partition_point(|moment| moment.travel_m < from_m);
        let number = self.finished.num_ever();
        Piece::of(number, self.moments.range(first..), &self.geometry, self.submap_config())
    }

    /// Says whether the robot is found and what is missing, and gives up a place that what is seen now contradicts.
    fn decide(&mut self) {
        let config = Arc::clone(&self.config);
        let settings = &config.localizer;
        let Some(best) = self.judged.first() else {
            (self.state, self.leading_since_m) = (LocalizationState::Lost, None);
            self.missing = vec![Missing::Elsewhere];
            return;
        };
        let was_found = self.state == LocalizationState::Converged;
        let known: f64 = self.judged.iter().map(|place| place.probability).sum();
        let needed = if was_found { settings.leading_probability } else { settings.sure_probability };
        let second = self.judged.get(1).map_or(0.0, |place| place.probability);
        let is_contradicted = !best.recent_fit.as_ref().is_some_and(|fit| settings.accepts_recent(fit));
        let leads = best.probability >= settings.leading_probability && !is_contradicted;
        let sd_m = best.chain.sd_m;
        self.leading_since_m = if leads { self.leading_since_m.or(Some(self.travel_m)) } else { None };
        let has_lasted = self.leading_since_m.is_some_and(|at_m| self.travel_m - at_m >= settings.sure_for_m);
        let reasons = [
            (Missing::Travel, self.travel_m < settings.min_travel_m),
            (Missing::Elsewhere, known < needed),
            (Missing::Alternatives, second > 1.0 - needed),
            (Missing::Persistence, !has_lasted && !was_found),
            (Missing::RecentScans, is_contradicted),
            (Missing::Position, sd_m > settings.sure_sd_max_m),
        ];
        let is_found = best.probability >= needed;
        self.missing = reasons.iter().filter(|reason| reason.1).map(|reason| reason.0).collect();
        if !is_found && self.missing.is_empty() {
            self.missing.push(Missing::Elsewhere);
        }
        self.state = match (self.missing.is_empty(), known > 0.5) {
            (true, _) => LocalizationState::Converged,
            (false, true) => LocalizationState::Ambiguous,
            (false, false) => LocalizationState::Lost,
        };
        // Whoever is not sure does not say so: what one place has too much is not in this map.
        if self.state == LocalizationState::Ambiguous
            && let Some(best) = self.judged.first_mut()
        {
            best.probability = best.probability.min(config.localizer.leading_probability);
        }
        self.num_contradictions = if is_contradicted && (was_found || self.num_contradictions > 0) {
            self.num_contradictions + 1
        } else {
            0
        };
        if self.num_contradictions >= settings.num_contradictions_max {
            self.start_anew(self.travel_m - self.settings().recent_m);
        }
    }

    /// A robot that was carried away contradicts its place all at once; then only what it saw since counts.
    fn start_anew(&mut self, recent_m: f64) {
        self.forget(self.moments.partition_point(|moment| moment.travel_m < recent_m));
        self.parts.iter_mut().for_each(|part| part.tracks.clear());
        self.began_at_m = recent_m;
        self.finished.clear(recent_m);
        self.recent = RecentScans::new(self.config.recall.length_max_m);
        self.judged.clear();
        (self.searched_at_m, self.leading_since_m, self.prior) = (None, None, None);
        (self.state, self.missing) = (LocalizationState::Lost, vec![Missing::RecentScans]);
        self.num_contradictions = 0;
    }
}

fn is_due(last_m: Option<f64>, every_m: f64, travel_m: f64) -> bool {
    last_m.is_none_or(|last_m| travel_m - last_m >= every_m)
}

fn is_same_fit(a: &JudgedPlace, b: &JudgedPlace) -> bool {
    a.component == b.component
        && is_near(&a.chain.whole.map_from_submap, &b.chain.whole.map_from_submap, SAME_FIT)
}

fn is_near(a: &Pose2, b: &Pose2, (within_m, within_rad): (f64, f64)) -> bool {
    a.distance(b) < within_m && angle_between(a.theta, b.theta) < within_rad
}
