//! A storage that goes wrong at a chosen commit, in front of any other: for the tests of everything above.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;

use super::{Batch, Entry, Precondition, Reader, SiteStore, Storage, StorageError};

/// How a commit goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Nothing is written, and it says so.
    Refused,
    /// There is no room.
    Full,
    /// Everything is written, but the answer is lost.
    CutOff,
    /// It takes long.
    Slow,
    /// Everything is written, but the answer takes long.
    Late,
}

/// What goes wrong and when.
#[derive(Debug)]
struct Plan {
    num_commits: AtomicU64,
    at: u64,
    fault: Fault,
}

/// The storage.
pub(crate) struct FaultyStorage {
    inner: Arc<dyn Storage>,
    plan: Arc<Plan>,
}

impl FaultyStorage {
    /// Goes wrong at the commit of a number, counted from 0 over all sites.
    pub(crate) fn new(inner: Arc<dyn Storage>, at: u64, fault: Fault) -> Self {
        Self { inner, plan: Arc::new(Plan { num_commits: AtomicU64::new(0), at, fault }) }
    }

    /// Commits that were asked for so far.
    pub(crate) fn num_commits(&self) -> u64 {
        self.plan.num_commits.load(Ordering::Acquire)
    }
}

#[async_trait]
impl Storage for FaultyStorage {
    async fn open(&self, site: &str) -> Result<Arc<dyn SiteStore>, StorageError> {
        let inner = self.inner.open(site).await?;
        Ok(Arc::new(FaultySite { inner, plan: Arc::clone(&self.plan) }))
    }

    async fn list(&self) -> Result<Vec<String>, StorageError> {
        self.inner.list().await
    }

    async fn delete(&self, site: &str) -> Result<(), StorageError> {
        self.inner.delete(site).await
    }

    async fn release(&self, site: &str) -> Result<(), StorageError> {
        self.inner.release(site).await
    }

    async fn close(&self) -> Result<(), StorageError> {
        self.inner.close().await
    }
}

struct FaultySite {
    inner: Arc<dyn SiteStore>,
    plan: Arc<Plan>,
}

#[async_trait]
impl Reader for FaultySite {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        self.inner.get(key).await
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        self.inner.multi_get(keys).await
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        self.inner.scan(prefix, from, limit).await
    }
}

#[async_trait]
impl SiteStore for FaultySite {
    async fn commit(&self, batch: Batch, preconditions: Vec<Precondition>) -> Result<(), StorageError> {
        if self.plan.num_commits.fetch_add(1, Ordering::AcqRel) != self.plan.at {
            return self.inner.commit(batch, preconditions).await;
        }
        let cut_off = || super::unavailable(&"the answer was lost");
        match self.plan.fault {
            Fault::Refused => Err(super::unavailable(&"not now")),
            Fault::Full => Err(StorageError::Full { reason: "no room".into() }),
            Fault::CutOff => self.inner.commit(batch, preconditions).await.and_then(|()| Err(cut_off())),
            Fault::Late => {
                self.inner.commit(batch, preconditions).await?;
                tokio::time::sleep(Duration::from_millis(200)).await;
                Ok(())
            }
            Fault::Slow => {
                tokio::time::sleep(Duration::from_millis(200)).await;
                self.inner.commit(batch, preconditions).await
            }
        }
    }

    async fn snapshot(&self) -> Result<Arc<dyn Reader>, StorageError> {
        self.inner.snapshot().await
    }

    async fn num_bytes_on_disk(&self) -> Result<u64, StorageError> {
        self.inner.num_bytes_on_disk().await
    }

    fn is_over(&self) -> bool {
        self.inner.is_over()
    }
}
