//! Use cases: load, call the engine on a blocking thread, store. No HTTP and no sled here.
//!
//! ```text
//! sites   made, found, described, deleted
//! backups a site as a stream, and a site made of one
//! runs    a batch ─► the run's one writer ─► translator ─► one commit ─► receipt;  trajectories
//! jobs    in the background: maps are built, texts written anew
//! maps    versions written and served: regions, matches, labels, places, changes, grids, pictures
//! ask     by words, by a short recording, by a robot that drives
//!   └─ all on ─► site   the record and how it changes; the parts that a process keeps of a site
//! ```
//!
//! [`Site`] is state and its change. A use case is a function of its folder; it is a method of [`App`] when it needs
//! what the process shares: limits, queues, caches.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use locution_engine::locate::ServedMap;
use locution_engine::occupancy::GridMap;
use lru::LruCache;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::config::ServerConfig;
use crate::storage::Storage;

pub mod ask;
pub mod backups;
mod error;
#[cfg(test)]
mod faults;
mod jobs;
pub mod maps;
mod names;
pub mod runs;
#[cfg(test)]
mod script_tests;
pub mod site;
mod sites;

pub use error::AppError;
pub use names::Name;
pub use sites::ListedSite;

use ask::{Localizations, PlaceIndexes};
use maps::GridKey;
use runs::OpenRuns;
use site::Site;

/// Grids kept in memory; each has at most 64 million cells of one byte.
const NUM_GRIDS_KEPT: NonZeroUsize = NonZeroUsize::new(4).expect("four is not zero");

/// The application: every use case begins here.
pub struct App {
    config: ServerConfig,
    storage: Arc<dyn Storage>,
    sites: Mutex<HashMap<Name, Arc<Site>>>,
    making_sites: tokio::sync::Mutex<()>,
    opening_sites: tokio::sync::Mutex<()>,
    batch_slots: Arc<Semaphore>,
    job_slots: Semaphore,
    open_runs: OpenRuns,
    grids: Mutex<LruCache<GridKey, Arc<GridMap>>>,
    drawing: tokio::sync::Mutex<()>,
    served_maps: tokio::sync::Mutex<LruCache<GridKey, Arc<ServedMap>>>,
    localizations: Localizations,
    place_indexes: PlaceIndexes,
}

impl App {
    /// An application over a storage.
    pub fn new(config: ServerConfig, storage: Arc<dyn Storage>) -> Self {
        Self {
            batch_slots: Arc::new(Semaphore::new(config.limits.num_batches_max)),
            job_slots: Semaphore::new(config.builds.num_builds_max),
            open_runs: OpenRuns::new(config.limits.num_open_runs_max),
            grids: Mutex::new(LruCache::new(NUM_GRIDS_KEPT)),
            drawing: tokio::sync::Mutex::default(),
            served_maps: tokio::sync::Mutex::new(LruCache::new(NUM_GRIDS_KEPT)),
            localizations: Localizations::default(),
            place_indexes: PlaceIndexes::default(),
            config,
            storage,
            sites: Mutex::default(),
            making_sites: tokio::sync::Mutex::default(),
            opening_sites: tokio::sync::Mutex::default(),
        }
    }

    /// The configuration it runs with.
    pub fn config(&self) -> &ServerConfig {
        &self.config
    }

    /// A place in the bounded queue of batches; taken before a body is read, so that memory stays bounded.
    ///
    /// # Errors
    /// [`AppError::Busy`] when all are taken.
    pub fn batch_slot(&self) -> Result<OwnedSemaphorePermit, AppError> {
        let queue = "the queue of batches";
        Arc::clone(&self.batch_slots)
            .try_acquire_owned()
            .map_err(|_| AppError::Busy { queue, retry_after: Duration::from_secs(1) })
    }

    /// Opens every site, so that what was interrupted goes on; a site that cannot be opened does not stop the others.
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

    /// Finishes what is under way and closes the storage.
    pub async fn close(&self) -> Result<(), AppError> {
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
