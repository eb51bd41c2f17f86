//! The handle of one site in an object store.
//!
//! Only what is durable is read: a batch that still waits for the store shows neither to a reader nor in a snapshot, so
//! nothing is ever answered that a crash could take back. Preconditions alone look at what waits as well.
//!
//! A commit whose outcome is not known in time ends the handle. Whoever opens the site next fences this database off
//! and reads what is durable, so memory never differs from the store.

use std::future::Future;
use std::ops::Bound;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use async_trait::async_trait;
use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use object_store::ObjectStore;
use object_store::path::Path;
use slatedb::config::{DurabilityLevel, ReadOptions, ScanOptions};
use slatedb::{CloseReason, Db, DbIterator, DbSnapshot, DbStatus, ErrorKind, WriteBatch};
use tokio::sync::watch;
use tokio::task::JoinHandle;

use super::super::{Batch, Entry, Precondition, Reader, SiteStore, StorageError, unavailable};
use super::names::Names;

/// How long a measured size is good: measuring lists all objects of the site, which costs.
const SIZE_IS_GOOD_FOR: Duration = Duration::from_secs(600);
/// Values read at once by one request for several.
const NUM_READS_AT_ONCE: usize = 32;
/// Bytes that a scan asks the store for at once.
const READ_AHEAD_BYTES: usize = 1 << 20;
/// A value below this is copied, since it would hold on to the block that it was read in.
const COPIED_BYTES_MAX: usize = 4 << 10;

/// Which incarnation of a site this is, and where it lies.
pub(super) struct Incarnation {
    pub(super) site: String,
    pub(super) id: String,
    pub(super) path: Path,
}

pub(super) struct ObjectSite {
    incarnation: Incarnation,
    database: Db,
    status: watch::Receiver<DbStatus>,
    store: Arc<dyn ObjectStore>,
    names: Arc<Names>,
    /// No call may wait longer for the store.
    patience: Duration,
    /// Held while preconditions are read and the batch is queued, not while it becomes durable.
    committing: tokio::sync::Mutex<()>,
    is_given_up: AtomicBool,
    measured: Mutex<Option<(Instant, u64)>>,
}

impl ObjectSite {
    pub(super) fn new(
        incarnation: Incarnation,
        database: Db,
        store: Arc<dyn ObjectStore>,
        names: Arc<Names>,
        patience: Duration,
    ) -> Self {
        Self {
            incarnation,
            status: database.subscribe(),
            database,
            store,
            names,
            patience,
            committing: tokio::sync::Mutex::default(),
            is_given_up: AtomicBool::new(false),
            measured: Mutex::default(),
        }
    }

    /// Whether this handle has ended: given up, closed, or taken over by another server.
    pub(super) fn is_over(&self) -> bool {
        self.is_given_up.load(Ordering::Acquire) || self.status.borrow().close_reason.is_some()
    }

    /// Ends the handle at once; the database closes in the background, which may take as long as the store is away.
    pub(super) fn give_up(&self) -> JoinHandle<Result<(), StorageError>> {
        self.is_given_up.store(true, Ordering::Release);
        let database = self.database.clone();
        tokio::spawn(async move {
            match database.close().await {
                Ok(()) => Ok(()),
                // Closed before, here or by another server's opening.
                Err(error) if matches!(error.kind(), ErrorKind::Closed(_)) => Ok(()),
                Err(error) => Err(told(&error)),
            }
        })
    }

    /// Ends the handle and waits a while for its last words.
    pub(super) async fn close(&self) -> Result<(), StorageError> {
        let closing = self.give_up();
        self.bounded(async { closing.await.unwrap_or_else(|error| Err(unavailable(&error))) }).await
    }

    fn check(&self) -> Result<(), StorageError> {
        if self.is_given_up.load(Ordering::Acquire) { Err(StorageError::Fenced) } else { Ok(()) }
    }

    /// Waits for the store, but not without bound.
    async fn bounded<T>(
        &self,
        work: impl Future<Output = Result<T, StorageError>>,
    ) -> Result<T, StorageError> {
        match tokio::time::timeout(self.patience, work).await {
            Ok(outcome) => outcome,
            Err(_) => Err(unavailable(&format!(
                "the object store has not answered within {} s",
                self.patience.as_secs_f64()
            ))),
        }
    }

    /// What an error of a read means. Objects that are gone may be those of a site that another server deleted.
    async fn told_of_read(&self, error: &slatedb::Error) -> StorageError {
        let told = told(error);
        if !matches!(told, StorageError::Corrupt { .. }) {
            return told;
        }
        match self.names.find(&self.incarnation.site).await {
            Ok(Some(id)) if id == self.incarnation.id => told,
            Ok(_) => {
                self.give_up();
                StorageError::Fenced
            }
            Err(error) => error,
        }
    }

    async fn get(&self, key: &[u8], durability: DurabilityLevel) -> Result<Option<Bytes>, StorageError> {
        self.check()?;
        let options = ReadOptions::new().with_durability_filter(durability);
        let read = async {
            match self.database.get_with_options(key, &options).await {
                Ok(value) => Ok(value.map(without_block)),
                Err(error) => Err(self.told_of_read(&error).await),
            }
        };
        self.bounded(read).await
    }

    async fn commit(&self, writes: WriteBatch, preconditions: &[Precondition]) -> Result<(), StorageError> {
        let queue = self.committing.lock().await;
        self.check()?;
        for precondition in preconditions {
            if self.get(&precondition.key, DurabilityLevel::Memory).await? != precondition.expected {
                return Err(StorageError::Conflict);
            }
        }
        if writes.is_empty() {
            return Ok(());
        }
        let queued = self.database.write(writes).await.map_err(|error| told(&error))?;
        drop(queue);
        queued.await_durable().await.map_err(|error| told(&error))
    }

    /// Waits until everything up to a number is durable.
    async fn settled(&self, sequence: u64) -> Result<(), StorageError> {
        let mut status = self.status.clone();
        let settled = async {
            let status = status
                .wait_for(|status| status.durable_seq >= sequence || status.close_reason.is_some())
                .await
                .map_err(|error| unavailable(&error))?;
            if status.durable_seq >= sequence { Ok(()) } else { Err(StorageError::Fenced) }
        };
        self.bounded(settled).await
    }

    async fn measure(&self) -> Result<u64, StorageError> {
        let measured = *self.measured.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, num_bytes)) = measured.filter(|(since, _)| since.elapsed() < SIZE_IS_GOOD_FOR) {
            return Ok(num_bytes);
        }
        let objects = self.store.list(Some(&self.incarnation.path));
        let sum = objects.try_fold(0, async |sum, object| Ok(sum + object.size));
        let num_bytes = self.bounded(async { sum.await.map_err(|error| unavailable(&error)) }).await?;
        *self.measured.lock().unwrap_or_else(PoisonError::into_inner) = Some((Instant::now(), num_bytes));
        Ok(num_bytes)
    }
}

/// A handle; it is shared with the commits that go on when whoever asked for them has gone.
pub(super) struct ObjectHandle {
    pub(super) site: Arc<ObjectSite>,
}

#[async_trait]
impl Reader for ObjectHandle {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        self.site.get(key, DurabilityLevel::Remote).await
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        let reads = stream::iter(keys.to_vec()).map(|key| async move { self.get(&key).await });
        reads.buffered(NUM_READS_AT_ONCE).try_collect().await
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        self.site.check()?;
        let Some(range) = range(prefix, from) else { return Ok(Vec::new()) };
        let options = scan_options().with_durability_filter(DurabilityLevel::Remote);
        collect(&self.site, self.site.database.scan_with_options(range, &options), limit).await
    }
}

#[async_trait]
impl SiteStore for ObjectHandle {
    async fn commit(&self, batch: Batch, preconditions: Vec<Precondition>) -> Result<(), StorageError> {
        self.site.check()?;
        batch.check_sizes()?;
        let mut writes = WriteBatch::new();
        for (key, value) in batch.writes {
            match value {
                Some(value) => writes.put_bytes(key.into(), value),
                None => writes.delete(key),
            }
        }
        let site = Arc::clone(&self.site);
        // A task of its own: a batch that is half queued would slip past the preconditions of the next one.
        let work = async move {
            let mut work = std::pin::pin!(site.commit(writes, &preconditions));
            let outcome = site.bounded(&mut work).await;
            if matches!(outcome, Err(StorageError::Unavailable { .. } | StorageError::Fenced)) {
                // It may still become durable. The handle ends before its place in the queue is given back.
                site.give_up();
            }
            outcome
        };
        tokio::spawn(work).await.unwrap_or_else(|error| Err(unavailable(&error)))
    }

    async fn snapshot(&self) -> Result<Arc<dyn Reader>, StorageError> {
        self.site.check()?;
        let snapshot = self.site.database.snapshot().map_err(|error| told(&error))?;
        self.site.settled(snapshot.seq()).await?;
        Ok(Arc::new(ObjectSnapshot { snapshot, site: Arc::clone(&self.site) }))
    }

    async fn num_bytes_on_disk(&self) -> Result<u64, StorageError> {
        self.site.check()?;
        self.site.measure().await
    }

    fn is_over(&self) -> bool {
        self.site.is_over()
    }
}

struct ObjectSnapshot {
    snapshot: Arc<DbSnapshot>,
    site: Arc<ObjectSite>,
}

#[async_trait]
impl Reader for ObjectSnapshot {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        let read = async {
            match self.snapshot.get(key).await {
                Ok(value) => Ok(value.map(without_block)),
                Err(error) => Err(self.site.told_of_read(&error).await),
            }
        };
        self.site.bounded(read).await
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        let reads = stream::iter(keys.to_vec()).map(|key| async move { self.get(&key).await });
        reads.buffered(NUM_READS_AT_ONCE).try_collect().await
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        let Some(range) = range(prefix, from) else { return Ok(Vec::new()) };
        collect(&self.site, self.snapshot.scan_with_options(range, &scan_options()), limit).await
    }
}

fn scan_options() -> ScanOptions {
    ScanOptions::new().with_read_ahead_bytes(READ_AHEAD_BYTES).with_cache_blocks(true)
}

/// Keys that begin with a prefix and are not below `from`; none when there can be no such key.
fn range(prefix: &[u8], from: &[u8]) -> Option<(Bound<Vec<u8>>, Bound<Vec<u8>>)> {
    let end = prefix.iter().rposition(|byte| *byte < u8::MAX).map(|last| {
        let mut end = prefix[..=last].to_vec();
        end[last] += 1;
        end
    });
    // The engine takes a range that ends before it begins for a mistake.
    if end.as_ref().is_some_and(|end| from >= end.as_slice()) {
        return None;
    }
    Some((Bound::Included(from.max(prefix).to_vec()), end.map_or(Bound::Unbounded, Bound::Excluded)))
}

async fn collect(
    site: &ObjectSite,
    found: impl Future<Output = Result<DbIterator, slatedb::Error>>,
    limit: usize,
) -> Result<Vec<Entry>, StorageError> {
    let begin = async {
        match found.await {
            Ok(found) => Ok(found),
            Err(error) => Err(site.told_of_read(&error).await),
        }
    };
    let mut found = site.bounded(begin).await?;
    let mut entries = Vec::new();
    while entries.len() < limit {
        let next = async {
            match found.next().await {
                Ok(next) => Ok(next),
                Err(error) => Err(site.told_of_read(&error).await),
            }
        };
        match site.bounded(next).await? {
            Some(entry) => entries.push((without_block(entry.key), without_block(entry.value))),
            None => break,
        }
    }
    Ok(entries)
}

fn without_block(value: Bytes) -> Bytes {
    if value.len() < COPIED_BYTES_MAX { Bytes::copy_from_slice(&value) } else { value }
}

/// The engine's errors by who has to act.
pub(super) fn told(error: &slatedb::Error) -> StorageError {
    match error.kind() {
        // Taken over by another server, or ended by this one.
        ErrorKind::Closed(CloseReason::Fenced | CloseReason::Clean) => StorageError::Fenced,
        ErrorKind::Data => StorageError::Corrupt { what: error.to_string() },
        _ => unavailable(error),
    }
}
