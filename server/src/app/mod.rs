//! Use cases: load, call the engine on a blocking thread, store. No HTTP and no sled here.
//!
//! ```text
//! App ─► Site (one storage handle) ─► RunWriter (one at a time) ─► translation ─► one commit ─► receipt
//!                                  └► readers: observations, words, scans, trajectories, maps, matches
//!                                  └► jobs: builds and new text generations, in the background
//! ```

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::config::ServerConfig;
use crate::storage::Storage;

mod error;
mod ingest;
mod names;
mod open_runs;
pub mod reading;
pub mod records;
mod run_writer;
mod runs;
mod scans;
mod series;
mod site;
mod trajectory;
mod translation;

pub use error::AppError;
pub use ingest::NewBatch;
pub use names::Name;
pub use runs::{NewRun, RunInfo};
pub use site::{Site, SiteInfo, SiteState, TextConfig};
pub use trajectory::{Frame, StampedPose, Trajectory};

use open_runs::OpenRuns;

/// The application: every use case begins here.
pub struct App {
    config: ServerConfig,
    storage: Arc<dyn Storage>,
    sites: Mutex<HashMap<Name, Arc<Site>>>,
    making_sites: tokio::sync::Mutex<()>,
    batch_slots: Arc<Semaphore>,
    open_runs: OpenRuns,
}

impl App {
    /// An application over a storage.
    pub fn new(config: ServerConfig, storage: Arc<dyn Storage>) -> Self {
        Self {
            batch_slots: Arc::new(Semaphore::new(config.limits.num_batches_max)),
            open_runs: OpenRuns::new(config.limits.num_open_runs_max),
            config,
            storage,
            sites: Mutex::default(),
            making_sites: tokio::sync::Mutex::default(),
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

    /// Whether the storage answers.
    ///
    /// # Errors
    /// Why it does not.
    pub async fn check_ready(&self) -> Result<(), AppError> {
        Ok(self.storage.list().await.map(|_| ())?)
    }

    /// Finishes what is under way and closes the storage.
    ///
    /// # Errors
    /// Those of the storage.
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
