//! "Where am I": sessions that are fed like runs and stored nowhere.
//!
//! A session looks for the robot in every component of the map version that served when it began, up to a few. What it
//! searches, weighs and says is [`SiteSession`]'s; here are only the table of sessions and what they read of the store.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use locution_engine::geometry::Pose2;
use locution_engine::locate::{
    LocalizationEstimate, LocalizationState, PosePrior, ServedMap, SessionMap, SiteSession,
};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::translator::Translator;

use super::examples::invalid_geometry;
use crate::app::runs::NewBatch;
use crate::app::site::{Site, SiteEvent};
use crate::app::{App, AppError, on_blocking_thread};
use crate::records::{Map, ReadingRules};

/// Components that a session looks at, the largest first.
const NUM_COMPONENTS_MAX: usize = 4;
/// A session without scans for so long is forgotten.
const IDLE_MAX: Duration = Duration::from_secs(900);

/// The answer of a session.
#[derive(Clone, Debug)]
pub struct LocalizationInfo {
    /// Its number.
    pub id: u64,
    /// The map version it looks in.
    pub map_version: u64,
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// What it says.
    pub estimate: LocalizationEstimate,
    /// It is forgotten when it gets no scans for so long.
    pub expires_in: Duration,
}

/// What is said of where the robot is when a session begins.
#[derive(Clone, Debug, Default)]
pub struct Declared {
    /// About where.
    pub prior: Option<PosePrior>,
    /// In which area.
    pub area: Option<String>,
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
    /// Birth of the site.
    site: u64,
    owner: Arc<str>,
    geometry: ScanGeometry,
    readings: ReadingRules,
    map_version: u64,
    latest_use: Mutex<Instant>,
    /// The state that those who watch were told.
    told: Mutex<Option<LocalizationState>>,
    search: tokio::sync::Mutex<Search>,
}

/// A session of the engine and how far it was fed.
#[derive(Clone)]
struct Search {
    session: SiteSession,
    next_sequence: u64,
    /// Time and odometry of the scan before.
    latest: Option<(i64, Pose2)>,
}

impl Search {
    fn push(&mut self, scans: &[Scan]) {
        scans.iter().for_each(|scan| self.session.push(scan));
        self.next_sequence += scans.len() as u64;
        self.latest = scans.last().map(|scan| (scan.timestamp_ns, scan.odom_from_robot)).or(self.latest);
    }
}

impl App {
    /// Opens a session in the serving map, for an owner who may have a limit of his own; a rough pose and an area may be
    /// declared.
    ///
    /// # Errors
    /// [`AppError::Invalid`] for a laser that cannot be worked with, [`AppError::NotReady`] before the first build,
    /// [`AppError::Busy`] when there are too many sessions.
    pub async fn open_localization(
        &self,
        site: &Site,
        (geometry, readings): (ScanGeometry, ReadingRules),
        declared: Declared,
        owner: Arc<str>,
        num_own_max: Option<usize>,
    ) -> Result<LocalizationInfo, AppError> {
        Translator::new(&site.state().config.translator, geometry.clone()).map_err(invalid_geometry)?;
        let map = site.map(None).await?;
        let search = self.new_search(site, &map, &geometry, declared).await?;
        let session = Session {
            site: site.birth(),
            owner,
            geometry,
            readings,
            map_version: map.record.version,
            latest_use: Mutex::new(Instant::now()),
            told: Mutex::new(None),
            search: tokio::sync::Mutex::new(search),
        };
        let id =
            self.localizations.insert(session, self.config().limits.num_localizations_max, num_own_max)?;
        self.localization(site, id).await
    }

    /// The answer of a session as it stands.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn localization(&self, site: &Site, id: u64) -> Result<LocalizationInfo, AppError> {
        info(id, &*self.session(site, id)?).await
    }

    /// The answers of all sessions in a site, the oldest first; looking at them keeps none of them open.
    ///
    /// # Errors
    /// [`AppError::Internal`].
    pub async fn localizations(&self, site: &Site) -> Result<Vec<LocalizationInfo>, AppError> {
        let of_site = |session: &Session| session.site == site.birth() && session.idle_for() < IDLE_MAX;
        let sessions: Vec<(u64, Arc<Session>)> = {
            let table = self.localizations.table();
            let sessions = table.sessions.iter().filter(|(_, session)| of_site(session));
            sessions.map(|(id, session)| (*id, Arc::clone(session))).collect()
        };
        let mut infos = Vec::new();
        for (id, session) in sessions {
            infos.push(info(id, &session).await?);
        }
        Ok(infos)
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
        let scans =
            batch.checked((&session.geometry, &session.readings), num_known, search.latest, step_max_m)?;
        let mut feeding = search.clone();
        *search = on_blocking_thread(move || {
            feeding.push(&scans);
            feeding
        })
        .await?;
        drop(search);
        let info = info(id, &session).await?;
        let mut told = session.told.lock().unwrap_or_else(PoisonError::into_inner);
        let state = info.estimate.state;
        if told.replace(state) != Some(state) {
            site.events().tell(SiteEvent::Localization { id, state });
        }
        drop(told);
        Ok(info)
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
        let session = table.sessions.get(&id).filter(|session| session.site == site.birth());
        let session = session.ok_or_else(|| AppError::not_found("localisation", id))?;
        *session.latest_use.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        Ok(Arc::clone(session))
    }

    async fn new_search(
        &self,
        site: &Site,
        map: &Map,
        geometry: &ScanGeometry,
        Declared { prior, area }: Declared,
    ) -> Result<Search, AppError> {
        let mut sizes: BTreeMap<u32, u64> = BTreeMap::new();
        let mut of_area = BTreeSet::new();
        for run in map.record.runs.iter().filter(|run| run.num_poses > 0) {
            *sizes.entry(run.component).or_default() += run.num_poses;
            if area.is_some() && site.reader().run(run.run).await?.record.area == area {
                of_area.insert(run.component);
            }
        }
        if let Some(area) = area {
            if of_area.is_empty() {
                let problem = format!("the map has no run of the area `{area}`");
                return Err(AppError::invalid("area", problem));
            }
            sizes.retain(|component, _| of_area.contains(component));
        }
        let mut largest: Vec<u32> = sizes.keys().copied().collect();
        largest.sort_by_key(|component| std::cmp::Reverse(sizes[component]));
        let declared = prior.as_ref().map(PosePrior::component);
        if let Some(component) = declared.filter(|component| !sizes.contains_key(component)) {
            let problem = format!("the map has no component {component}");
            return Err(AppError::invalid("prior.component", problem));
        }
        // A component that is named is looked at, however small it is.
        largest.sort_by_key(|component| declared != Some(*component));
        let mut components = Vec::new();
        for component in largest.into_iter().take(NUM_COMPONENTS_MAX) {
            components.push((component, self.served_map(site, map, component).await?));
        }
        let config = Arc::new(site.state().config.session());
        let session_map = SessionMap { components, index: self.place_index(site, map).await? };
        let session = SiteSession::new(geometry.clone(), config, session_map, prior);
        Ok(Search { session, next_sequence: 0, latest: None })
    }

    /// A component with the fields that localisation looks things up in.
    async fn served_map(&self, site: &Site, map: &Map, component: u32) -> Result<Arc<ServedMap>, AppError> {
        let key = (site.birth(), map.record.version, component);
        let mut served_maps = self.served_maps.lock().await;
        if let Some(served) = served_maps.get(&key) {
            return Ok(Arc::clone(served));
        }
        let grid = self.grid(site, map, component).await?;
        let config = Arc::clone(&site.state().config);
        let served = on_blocking_thread(move || {
            ServedMap::build(grid.halved(), &config.localization.likelihood_field)
        })
        .await?;
        let served = Arc::new(served);
        served_maps.put(key, Arc::clone(&served));
        Ok(served)
    }
}

/// The answer of a session as it stands.
async fn info(id: u64, session: &Session) -> Result<LocalizationInfo, AppError> {
    let search = session.search.lock().await;
    let estimating = search.clone();
    let next_sequence = search.next_sequence;
    drop(search);
    let estimate = on_blocking_thread(move || estimating.session.estimate()).await?;
    Ok(LocalizationInfo {
        id,
        map_version: session.map_version,
        next_sequence,
        estimate,
        expires_in: IDLE_MAX.saturating_sub(session.idle_for()),
    })
}

impl Localizations {
    /// Keeps a session when there is room after the idle ones went.
    fn insert(&self, session: Session, num_max: usize, num_own_max: Option<usize>) -> Result<u64, AppError> {
        let mut table = self.table();
        table.sessions.retain(|_, session| session.idle_for() < IDLE_MAX);
        let num_own = table.sessions.values().filter(|other| other.owner == session.owner).count();
        if table.sessions.len() >= num_max || num_own_max.is_some_and(|num_own_max| num_own >= num_own_max) {
            let queue = "the table of localisations";
            return Err(AppError::Busy { queue, retry_after: Duration::from_secs(10) });
        }
        table.next_id += 1;
        let id = table.next_id;
        table.sessions.insert(id, Arc::new(session));
        Ok(id)
    }

    /// Sessions that are open.
    pub(in crate::app) fn num_sessions(&self) -> usize {
        self.table().sessions.len()
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
