//! Use cases: load, call the engine on a blocking thread, store. No HTTP and no sled here.
//!
//! ```text
//! sites   made, found, described, deleted
//! backups a site as a stream, and a site made of one
//! runs    a batch ─► the run's one writer ─► translator ─► one commit ─► receipt;  trajectories
//! jobs    in the background: maps are built, texts written anew
//! maps    versions written and served: regions, rooms, matches, labels, places, changes, grids, pictures; annotations
//! ask     by words, by a short recording, by a robot that drives
//!   └─ all on ─► site   the record and how it changes; the parts that a process keeps of a site
//! ```
//!
//! [`Site`] is state and its change. A use case is a function of its folder; it is a method of [`App`] when it needs
//! what the process shares: limits, queues, caches.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use locution_engine::locate::ServedMap;
use locution_engine::occupancy::GridMap;
use lru::LruCache;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::config::ServerConfig;
use crate::storage::Storage;

pub mod ask;
pub mod backups;
mod error;
#[cfg(test)]
mod faults;
mod gauges;
mod jobs;
pub mod maps;
mod names;
pub mod runs;
#[cfg(test)]
mod script_tests;
pub mod site;
mod sites;
mod window;

pub use error::AppError;
pub use names::Name;
pub use sites::ListedSite;
pub use window::{Area, Window};

use ask::{Localizations, PlaceIndexes};
use jobs::Turns;
use maps::GridKey;
use runs::OpenRuns;
use site::{Site, TextBudget};

/// Grids kept in memory; each has at most 64 million cells of one byte.
const NUM_GRIDS_KEPT: NonZeroUsize = NonZeroUsize::new(4).expect("four is not zero");

/// Jobs are waited for so long when the server ends.
const JOBS_END_MAX: Duration = Duration::from_secs(3);

/// Says whether this server serves a site.
type Serves = Box<dyn Fn(&str) -> bool + Send + Sync>;

/// The application: every use case begins here.
pub struct App {
    config: ServerConfig,
    storage: Arc<dyn Storage>,
    sites: Mutex<HashMap<Name, Arc<Site>>>,
    /// Says which sites this server serves; all, when nobody else does.
    serves: OnceLock<Serves>,
    making_sites: tokio::sync::Mutex<()>,
    opening_sites: Mutex<HashMap<Name, Arc<tokio::sync::Mutex<()>>>>,
    turns: Turns,
    /// Everything that works on jobs.
    working: TaskTracker,
    open_runs: OpenRuns,
    grids: Mutex<LruCache<GridKey, Arc<GridMap>>>,
    drawing: tokio::sync::Mutex<()>,
    served_maps: tokio::sync::Mutex<LruCache<GridKey, Arc<ServedMap>>>,
    localizations: Localizations,
    place_indexes: PlaceIndexes,
    text_budget: Arc<TextBudget>,
    /// Streams of events that may be open at once.
    event_slots: Arc<Semaphore>,
    /// Set when the server ends: jobs give way.
    stop: CancellationToken,
}

impl App {
    /// An application over a storage.
    pub fn new(config: ServerConfig, storage: Arc<dyn Storage>) -> Self {
        Self {
            turns: Turns::new(config.builds.num_builds_max, Duration::from_secs_f64(config.builds.turn_s)),
            working: TaskTracker::new(),
            open_runs: OpenRuns::new(config.limits.num_open_runs_max),
            grids: Mutex::new(LruCache::new(NUM_GRIDS_KEPT)),
            drawing: tokio::sync::Mutex::default(),
            served_maps: tokio::sync::Mutex::new(LruCache::new(NUM_GRIDS_KEPT)),
            localizations: Localizations::default(),
            place_indexes: PlaceIndexes::default(),
            text_budget: Arc::new(TextBudget::new(config.limits.text_index_bytes_max)),
            event_slots: Arc::new(Semaphore::new(config.limits.num_event_streams_max)),
            stop: CancellationToken::new(),
            config,
            storage,
            sites: Mutex::default(),
            serves: OnceLock::new(),
            making_sites: tokio::sync::Mutex::default(),
            opening_sites: Mutex::default(),
        }
    }

    /// The configuration it runs with.
    pub fn config(&self) -> &ServerConfig {
        &self.config
    }

    /// Leaves the sites to other servers for which `serves` is not true; it is asked at every use of a site. To be called
    /// once, before anything else.
    pub fn share(&self, serves: impl Fn(&str) -> bool + Send + Sync + 'static) {
        let _ = self.serves.set(Box::new(serves));
    }

    /// A place among those who watch events.
    ///
    /// # Errors
    /// [`AppError::Busy`] when all are taken.
    pub fn event_slot(&self) -> Result<OwnedSemaphorePermit, AppError> {
        let queue = "the table of event streams";
        Arc::clone(&self.event_slots)
            .try_acquire_owned()
            .map_err(|_| AppError::Busy { queue, retry_after: Duration::from_secs(10) })
    }

    /// Opens every site that this server serves, so that what was interrupted goes on; a site that cannot be opened does not stop the others.
    ///
    /// # Errors
    /// Those of the storage as a whole.
    pub async fn resume(self: &Arc<Self>) -> Result<(), AppError> {
        for listed in self.listed_sites(|_| true).await? {
            if let Err(error) = listed.site {
                tracing::error!(site = %listed.name, %error, "the site cannot be opened");
            }
        }
        Ok(())
    }

    /// Whether the storage answers.
    ///
    /// # Errors
    /// Why it does not.
    pub async fn check_ready(&self) -> Result<(), AppError> {
        Ok(self.storage.list().await.map(|_| ())?)
    }

    /// Forgets what was made of a site's maps, since a run has gone or the configuration has changed.
    pub(in crate::app) async fn forget_served(&self, site: &Site) {
        let birth = site.birth();
        forget_where(&mut self.grids.lock().unwrap_or_else(PoisonError::into_inner), |key| key.0 == birth);
        forget_where(&mut *self.served_maps.lock().await, |key| key.0 == birth);
        self.place_indexes.forget(birth);
    }

    /// Lets jobs give way; they are begun anew at the next start.
    pub fn stop_jobs(&self) {
        self.stop.cancel();
    }

    /// Lets jobs give way, waits until they have, and closes the storage.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn close(&self) -> Result<(), AppError> {
        self.stop_jobs();
        self.working.close();
        if tokio::time::timeout(JOBS_END_MAX, self.working.wait()).await.is_err() {
            tracing::warn!("a job did not end in time; it begins anew at the next start");
        }
        self.sites.lock().unwrap_or_else(PoisonError::into_inner).clear();
        Ok(self.storage.close().await?)
    }
}

/// Runs engine work where it does not hold up requests.
///
/// # Errors
/// [`AppError::Internal`] when the work panicked.
pub(crate) async fn on_blocking_thread<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, AppError> {
    tokio::task::spawn_blocking(work).await.map_err(AppError::internal)
}

/// Drops entries of a cache by their keys.
fn forget_where<K: Clone + Eq + std::hash::Hash, V>(
    cache: &mut LruCache<K, V>,
    is_stale: impl Fn(&K) -> bool,
) {
    let stale: Vec<K> = cache.iter().map(|(key, _)| key).filter(|key| is_stale(key)).cloned().collect();
    for key in stale {
        cache.pop(&key);
    }
}
