//! A site's database while handles to it live: opened again after a failure, fenced off once deleted.
//!
//! When a sync fails (the disk is full or broken) memory and disk differ, so the database is thrown away and read
//! again from the disk, as after a restart; commits that were waiting are told that they failed. Until that works
//! every request is told why it does not.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use async_trait::async_trait;
use bytes::Bytes;

use super::data_directory::DataDirectory;
use super::sled_database::{Database, damaged};
use super::sled_open::open_site;
use super::sled_snapshot::SledSnapshot;
use super::{Batch, Entry, Precondition, Reader, SiteStore, StorageError, unavailable};

/// How long to leave a database alone that could not be opened again.
const REOPEN_AFTER: Duration = Duration::from_secs(1);

/// One site.
pub(super) struct SledSite {
    name: String,
    directory: Arc<DataDirectory>,
    cache_bytes: u64,
    state: Mutex<State>,
}

enum State {
    Open(Arc<Database>),
    /// It failed, and why it could not be opened again when that was last tried.
    Failed(StorageError, Instant),
    Fenced,
}

impl SledSite {
    pub(super) fn new(
        name: &str,
        directory: Arc<DataDirectory>,
        cache_bytes: u64,
        database: Database,
    ) -> Self {
        let state = Mutex::new(State::Open(Arc::new(database)));
        Self { name: name.to_owned(), directory, cache_bytes, state }
    }

    /// The database, opened again when it had failed.
    pub(super) fn database(&self) -> Result<Arc<Database>, StorageError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let failure = match &*state {
            State::Fenced => return Err(StorageError::Fenced),
            State::Failed(error, tried) if tried.elapsed() < REOPEN_AFTER => return Err(error.clone()),
            State::Failed(error, _) => error.clone(),
            State::Open(database) => match database.failure() {
                None => return Ok(Arc::clone(database)),
                Some(failure) => failure,
            },
        };
        tracing::error!(site = self.name, error = %failure, "the database failed and is opened again");
        // The old one must be gone before a new one may take its place; requests that still use it end with errors.
        let old = std::mem::replace(&mut *state, State::Failed(failure, Instant::now()));
        // sled writes what it still holds when it is dropped, and on a broken disk that may never end.
        std::thread::spawn(move || drop(old));
        match open_site(&self.name, &self.directory, self.cache_bytes) {
            Ok(database) => {
                let database = Arc::new(database);
                *state = State::Open(Arc::clone(&database));
                Ok(database)
            }
            Err(error) => {
                *state = State::Failed(error.clone(), Instant::now());
                Err(error)
            }
        }
    }

    pub(super) fn is_over(&self) -> bool {
        matches!(&*self.state.lock().unwrap_or_else(PoisonError::into_inner), State::Fenced)
    }

    /// Ends the life of every handle; the database as it was.
    pub(super) fn fence(&self) -> Option<Arc<Database>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        match std::mem::replace(&mut *state, State::Fenced) {
            State::Open(database) => Some(database),
            State::Failed(..) | State::Fenced => None,
        }
    }
}

/// A handle; reads and commits hop to a blocking thread.
pub(super) struct SledHandle {
    pub(super) site: Arc<SledSite>,
}

impl SledHandle {
    async fn blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Arc<Database>) -> Result<T, StorageError> + Send + 'static,
    ) -> Result<T, StorageError> {
        let site = Arc::clone(&self.site);
        run_blocking(self.site.name.clone(), move || site.database(), work).await
    }
}

/// Damaged pages can make sled panic deep inside; that must cost one request, not the process.
pub(super) async fn run_blocking<T: Send + 'static>(
    name: String,
    database: impl FnOnce() -> Result<Arc<Database>, StorageError> + Send + 'static,
    work: impl FnOnce(&Arc<Database>) -> Result<T, StorageError> + Send + 'static,
) -> Result<T, StorageError> {
    let guarded = move || {
        let database = database()?;
        catch_unwind(AssertUnwindSafe(|| work(&database)))
            .unwrap_or_else(|_| Err(damaged(&name, "the database failed while reading")))
    };
    tokio::task::spawn_blocking(guarded).await.unwrap_or_else(|error| Err(unavailable(&error)))
}

#[async_trait]
impl Reader for SledHandle {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        let key = key.to_vec();
        self.blocking(move |db| db.get_blocking(&key)).await
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        let keys = keys.to_vec();
        self.blocking(move |db| keys.iter().map(|key| db.get_blocking(key)).collect()).await
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        let (prefix, from) = (prefix.to_vec(), from.to_vec());
        self.blocking(move |db| db.scan_blocking(&prefix, &from, limit)).await
    }
}

#[async_trait]
impl SiteStore for SledHandle {
    async fn commit(&self, batch: Batch, preconditions: Vec<Precondition>) -> Result<(), StorageError> {
        self.blocking(move |db| db.commit_blocking(batch, &preconditions)).await
    }

    async fn snapshot(&self) -> Result<Arc<dyn Reader>, StorageError> {
        let snapshot = self.blocking(|db| Ok(SledSnapshot::of(db))).await?;
        Ok(Arc::new(snapshot))
    }

    async fn num_bytes_on_disk(&self) -> Result<u64, StorageError> {
        self.blocking(|db| db.db.size_on_disk().map_err(|error| db.sled_error(error))).await
    }

    fn is_over(&self) -> bool {
        self.site.is_over()
    }
}
