//! "Where am I": sessions that are fed like runs and stored nowhere.
//!
//! A session looks for the robot in every component of the map version that served when it began, up to a few. While
//! the robot is not found, its last metres are also asked about like an example, and the places answered are judged with
//! those of the search. Each component says how its best places compare with being off the map; that common yardstick
//! makes their probabilities comparable.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use locution_engine::config::EngineConfig;
use locution_engine::geometry::Pose2;
use locution_engine::locate::{LocalizationState, Localizer, ServedMap};
use locution_engine::occupancy::{CellState, GridMap};
use locution_engine::recall::{Example, FoundPlace, PlaceIndex, RecentScans};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::translator::Translator;

use super::examples::invalid_geometry;
use crate::app::runs::NewBatch;
use crate::app::site::Site;
use crate::app::{App, AppError, on_blocking_thread};
use crate::records::Map;

/// Components that a session looks at, the largest first.
const NUM_COMPONENTS_MAX: usize = 4;
/// A session without scans for so long is forgotten.
const IDLE_MAX: Duration = Duration::from_secs(900);
/// A robot that is not found asks where its last metres were driven each time it has driven so far, metres.
const RECALL_EVERY_M: f64 = 3.0;
/// Odds of a place against "off the map" are cut here, so that they stay numbers.
const ODDS_MAX: f64 = 1e6;

/// A place where the robot may be.
#[derive(Clone, Debug)]
pub struct LocatedHypothesis {
    /// The component whose frame the pose is in.
    pub component: u32,
    /// Where the robot may be now.
    pub map_from_robot: Pose2,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
    /// Probability that it is there; what is missing to 1 is that of being elsewhere.
    pub probability: f64,
}

/// The answer of a session.
#[derive(Clone, Debug)]
pub struct LocalizationInfo {
    /// Its number.
    pub id: u64,
    /// The map version it looks in.
    pub map_version: u64,
    /// Whether the robot is found.
    pub state: LocalizationState,
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Metres driven since it began.
    pub travel_m: f64,
    /// Likeliest first.
    pub hypotheses: Vec<LocatedHypothesis>,
}

/// The sessions of this process.
#[derive(Default)]
pub struct Localizations {
    table: Mutex<SessionTable>,
}

#[derive(Default)]
struct SessionTable {
    next_id: u64,
    sessions: BTreeMap<u64, Arc<Session>>,
}

struct Session {
    site: String,
    geometry: ScanGeometry,
    map_version: u64,
    latest_use: Mutex<Instant>,
    search: tokio::sync::Mutex<Search>,
}

/// One localizer per component, fed with the same scans.
#[derive(Clone)]
pub(super) struct Search {
    parts: Vec<(u32, Arc<ServedMap>, Localizer)>,
    memory: Memory,
    next_sequence: u64,
    latest_odom: Option<Pose2>,
}

impl Search {
    fn push(&mut self, scans: &[Scan]) {
        for scan in scans {
            self.parts.iter_mut().for_each(|(_, map, localizer)| localizer.push(map, scan));
            self.memory.recent.push(scan);
        }
        if self.is_recall_due() {
            self.recall();
        }
        self.next_sequence += scans.len() as u64;
        self.latest_odom = scans.last().map(|scan| scan.odom_from_robot).or(self.latest_odom);
    }

    fn travel_m(&self) -> f64 {
        self.parts.first().map_or(0.0, |(_, _, localizer)| localizer.travel_m())
    }

    fn is_recall_due(&self) -> bool {
        let is_found =
            self.parts.iter().any(|(_, _, localizer)| localizer.state() == LocalizationState::Converged);
        !is_found && self.travel_m() >= self.memory.recalled_at_m + RECALL_EVERY_M
    }

    /// Asks where the last metres were driven, and proposes the answers.
    fn recall(&mut self) {
        self.memory.recalled_at_m = self.travel_m();
        for found in self.memory.places() {
            let part = self.parts.iter_mut().find(|(component, ..)| *component == found.component);
            if let Some((_, map, localizer)) = part {
                localizer.propose(map, &found.map_from_robot);
            }
        }
    }

    fn estimate(&self) -> (LocalizationState, f64, Vec<LocatedHypothesis>) {
        let estimates: Vec<_> = self
            .parts
            .iter()
            .map(|(component, map, localizer)| (*component, localizer.estimate(map)))
            .collect();
        let mut odds_sum = 0.0;
        let mut hypotheses = Vec::new();
        for (component, estimate) in &estimates {
            let elsewhere = 1.0 - estimate.hypotheses.iter().map(|found| found.probability).sum::<f64>();
            for found in &estimate.hypotheses {
                let odds = (found.probability / elsewhere.max(1e-9)).min(ODDS_MAX);
                odds_sum += odds;
                hypotheses.push(LocatedHypothesis {
                    component: *component,
                    map_from_robot: found.map_from_robot,
                    covariance: found.covariance,
                    probability: odds,
                });
            }
        }
        hypotheses.iter_mut().for_each(|found| found.probability /= 1.0 + odds_sum);
        hypotheses.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let num_sure =
            estimates.iter().filter(|(_, found)| found.state == LocalizationState::Converged).count();
        let is_open = estimates.iter().any(|(_, found)| found.state == LocalizationState::Ambiguous);
        let state = match (num_sure, is_open) {
            (1, false) => LocalizationState::Converged,
            (0, false) => LocalizationState::Lost,
            // Sure in one part of the map counts only while no other part explains the scans nearly as well.
            (1, true) if hypotheses.first().is_some_and(|best| best.probability > 0.99) => {
                LocalizationState::Converged
            }
            _ => LocalizationState::Ambiguous,
        };
        let travel_m = estimates.first().map_or(0.0, |(_, estimate)| estimate.travel_m);
        (state, travel_m, hypotheses)
    }
}

/// What a session asks about, and whom.
#[derive(Clone)]
struct Memory {
    config: Arc<EngineConfig>,
    geometry: ScanGeometry,
    index: Arc<PlaceIndex>,
    recent: RecentScans,
    /// Metres driven when it last asked.
    recalled_at_m: f64,
}

impl Memory {
    /// Where the last metres may have been driven.
    fn places(&mut self) -> Vec<FoundPlace> {
        let (config, geometry) = (&self.config, &self.geometry);
        let read = Example::read(&config.translator, geometry, self.recent.scans(), &config.recall);
        // The session's geometry passed the translator's check when it was opened; nothing to look for is no answer.
        let example = read.ok().flatten();
        example.map(|example| self.index.find(&example, &config.recall)).unwrap_or_default()
    }
}

impl App {
    /// Opens a session in the serving map.
    ///
    /// # Errors
    /// [`AppError::Invalid`] for a laser that cannot be worked with, [`AppError::NotReady`] before the first build,
    /// [`AppError::Busy`] when there are too many sessions.
    pub async fn open_localization(
        &self,
        site: &Site,
        geometry: ScanGeometry,
    ) -> Result<LocalizationInfo, AppError> {
        Translator::new(&site.state().config.translator, geometry.clone()).map_err(invalid_geometry)?;
        let map = site.map(None).await?;
        let search = self.new_search(site, &map, &geometry).await?;
        let session = Session {
            site: site.name().to_string(),
            geometry,
            map_version: map.record.version,
            latest_use: Mutex::new(Instant::now()),
            search: tokio::sync::Mutex::new(search),
        };
        let id = self.localizations.insert(session, self.config().limits.num_localizations_max)?;
        self.localization(site, id).await
    }

    /// The answer of a session as it stands.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn localization(&self, site: &Site, id: u64) -> Result<LocalizationInfo, AppError> {
        let session = self.session(site, id)?;
        let search = session.search.lock().await;
        let estimating = search.clone();
        let next_sequence = search.next_sequence;
        drop(search);
        let (state, travel_m, hypotheses) = on_blocking_thread(move || estimating.estimate()).await?;
        Ok(LocalizationInfo {
            id,
            map_version: session.map_version,
            state,
            next_sequence,
            travel_m,
            hypotheses,
        })
    }

    /// Feeds a session. Scans it has seen are passed over; a gap is refused.
    ///
    /// # Errors
    /// [`AppError::Sequence`], [`AppError::Invalid`], [`AppError::NotFound`].
    pub async fn localize(
        &self,
        site: &Site,
        id: u64,
        batch: NewBatch,
    ) -> Result<LocalizationInfo, AppError> {
        let session = self.session(site, id)?;
        let mut search = session.search.lock().await;
        let expected_sequence = search.next_sequence;
        if batch.first_sequence > expected_sequence {
            let detail = format!("scans {expected_sequence} to {} are missing", batch.first_sequence - 1);
            return Err(AppError::Sequence { expected_sequence, detail });
        }
        let num_known = (expected_sequence - batch.first_sequence) as usize;
        let step_max_m = self.config().limits.odometry_step_max_m;
        let scans = batch.checked(&session.geometry, num_known, search.latest_odom, step_max_m)?;
        let mut feeding = search.clone();
        *search = on_blocking_thread(move || {
            feeding.push(&scans);
            feeding
        })
        .await?;
        drop(search);
        self.localization(site, id).await
    }

    /// Closes a session.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub fn close_localization(&self, site: &Site, id: u64) -> Result<(), AppError> {
        self.session(site, id)?;
        self.localizations.table().sessions.remove(&id);
        Ok(())
    }

    fn session(&self, site: &Site, id: u64) -> Result<Arc<Session>, AppError> {
        let table = self.localizations.table();
        let session = table.sessions.get(&id).filter(|session| session.site == site.name().as_str());
        let session = session.ok_or_else(|| AppError::not_found("localisation", id))?;
        *session.latest_use.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        Ok(Arc::clone(session))
    }

    async fn new_search(&self, site: &Site, map: &Map, geometry: &ScanGeometry) -> Result<Search, AppError> {
        let mut sizes: BTreeMap<u32, u64> = BTreeMap::new();
        for run in map.record.runs.iter().filter(|run| run.num_poses > 0) {
            *sizes.entry(run.component).or_default() += run.num_poses;
        }
        let mut components: Vec<u32> = sizes.keys().copied().collect();
        components.sort_by_key(|component| std::cmp::Reverse(sizes[component]));
        let config = Arc::clone(&site.state().config);
        let mut parts = Vec::new();
        for component in components.into_iter().take(NUM_COMPONENTS_MAX) {
            let served = self.served_map(site, map, component).await?;
            parts.push((
                component,
                served,
                Localizer::new(geometry.clone(), config.localization.localizer.clone()),
            ));
        }
        let memory = Memory {
            recent: RecentScans::new(config.recall.length_max_m),
            geometry: geometry.clone(),
            index: self.place_index(site, map).await?,
            config,
            recalled_at_m: 0.0,
        };
        Ok(Search { parts, memory, next_sequence: 0, latest_odom: None })
    }

    /// A component with the fields that localisation looks things up in.
    async fn served_map(&self, site: &Site, map: &Map, component: u32) -> Result<Arc<ServedMap>, AppError> {
        let key = (site.name().to_string(), map.record.version, component);
        let mut served_maps = self.served_maps.lock().await;
        if let Some(served) = served_maps.get(&key) {
            return Ok(Arc::clone(served));
        }
        let grid = self.grid(site, map, component).await?;
        let config = Arc::clone(&site.state().config);
        let served = on_blocking_thread(move || {
            ServedMap::build(halved(&grid), &config.localization.likelihood_field)
        })
        .await?;
        let served = Arc::new(served);
        served_maps.put(key, Arc::clone(&served));
        Ok(served)
    }
}

impl Localizations {
    /// Keeps a session when there is room after the idle ones went.
    fn insert(&self, session: Session, num_max: usize) -> Result<u64, AppError> {
        let mut table = self.table();
        table.sessions.retain(|_, session| session.idle_for() < IDLE_MAX);
        if table.sessions.len() >= num_max {
            let queue = "the table of localisations";
            return Err(AppError::Busy { queue, retry_after: Duration::from_secs(10) });
        }
        table.next_id += 1;
        let id = table.next_id;
        table.sessions.insert(id, Arc::new(session));
        Ok(id)
    }

    fn table(&self) -> std::sync::MutexGuard<'_, SessionTable> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Session {
    fn idle_for(&self) -> Duration {
        self.latest_use.lock().unwrap_or_else(PoisonError::into_inner).elapsed()
    }
}

/// The grid with cells of twice the edge, which is fine enough to localise in: a wall stays a wall.
fn halved(grid: &GridMap) -> GridMap {
    let (width, height) = (grid.width().div_ceil(2), grid.height().div_ceil(2));
    let mut halved = GridMap::unknown(width, height, 2.0 * grid.resolution_m(), grid.origin());
    for row in 0..grid.height() as i64 {
        for column in 0..grid.width() as i64 {
            let state = grid.state(column, row);
            let known = halved.state(column / 2, row / 2);
            let is_news = state == CellState::Occupied || known == CellState::Unknown;
            if is_news && state != CellState::Unknown {
                halved.set(column / 2, row / 2, state);
            }
        }
    }
    halved
}
