//! Ordered bytes that survive a power cut: the one narrow trait between the application and any database.
//!
//! ```text
//! app ──► Storage::open(site) ──► SiteStore: get · multi_get · scan · commit(batch, preconditions) · snapshot
//!                                   ├── SledStorage    embedded, one database per site, the default
//!                                   ├── ObjectStorage  an object store that several servers share
//!                                   └── MemoryStorage  the tests' twin, forgets everything
//! ```
//!
//! A site is the unit of sharding: there is no transaction across sites, and a store behind this trait may be remote,
//! slow to commit and shared with other processes. So callers batch their writes, read through the store instead of
//! assuming that they are its only user, and expect to be fenced off. Values stay under one mebibyte.
//! `contract.rs` is the suite that every implementation passes.

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use thiserror::Error;

pub mod backup;
mod content;
#[cfg(test)]
mod contract;
#[cfg(test)]
mod damage;
mod data_directory;
#[cfg(test)]
pub(crate) mod faulty;
mod files;
mod ledger;
#[cfg(test)]
mod memory;
#[cfg(feature = "object-store")]
pub mod object;
mod sled_database;
mod sled_flusher;
mod sled_log;
mod sled_open;
mod sled_rewrite;
mod sled_site;
mod sled_snapshot;
mod sled_store;
pub mod upkeep;

#[cfg(test)]
pub use memory::MemoryStorage;
pub use sled_store::{SledConfig, SledStorage};

/// No value may be larger, so that any engine behind the trait can hold it.
pub const VALUE_BYTES_MAX: usize = 1 << 20;

/// A key with its value.
pub type Entry = (Bytes, Bytes);

/// Why the storage did not do what it was asked.
#[derive(Clone, Debug, Error)]
pub enum StorageError {
    /// A precondition did not hold: somebody else wrote first. Nothing was written.
    #[error("another write came first")]
    Conflict,
    /// This handle no longer owns the site: it was deleted or another process took it over.
    #[error("this process no longer owns the site")]
    Fenced,
    /// The engine cannot serve now; the same request may work later.
    #[error("the storage is unavailable: {reason}")]
    Unavailable {
        /// When to ask again.
        retry_after: Duration,
        /// What the engine said.
        reason: String,
    },
    /// Another process holds the directory of the embedded storage.
    #[error("the data directory {directory} is held by {holder}")]
    Held {
        /// The directory.
        directory: String,
        /// Which process on which machine, and since when.
        holder: String,
    },
    /// There is no room for more; reading goes on, and so does writing once there is room again.
    #[error("the storage is full: {reason}")]
    Full {
        /// How much room there is and how much is needed.
        reason: String,
    },
    /// A stored value or the database itself is damaged.
    #[error("stored data is damaged: {what}")]
    Corrupt {
        /// Which value, and how it shows.
        what: String,
    },
    /// A value is larger than [`VALUE_BYTES_MAX`]: a bug of the caller, nothing was written.
    #[error("a value of {size_bytes} bytes is over the limit of one mebibyte")]
    ValueTooLarge {
        /// Its size.
        size_bytes: usize,
    },
}

/// What must be true of a key for a batch to be applied.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Precondition {
    /// The key looked at.
    pub key: Vec<u8>,
    /// Its value; `None` when the key must not exist.
    pub expected: Option<Bytes>,
}

/// Writes that happen together or not at all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Batch {
    /// In the order given; `None` deletes. The last word on a key wins.
    pub writes: Vec<(Vec<u8>, Option<Bytes>)>,
}

impl Batch {
    /// Sets a key.
    pub fn put(&mut self, key: Vec<u8>, value: impl Into<Bytes>) {
        self.writes.push((key, Some(value.into())));
    }

    /// Removes a key, whether or not it exists.
    pub fn delete(&mut self, key: Vec<u8>) {
        self.writes.push((key, None));
    }

    /// Bytes of all values.
    pub fn num_value_bytes(&self) -> usize {
        self.writes.iter().filter_map(|(_, value)| value.as_ref()).map(Bytes::len).sum()
    }

    /// Refuses values that are too large for the trait.
    ///
    /// # Errors
    /// [`StorageError::ValueTooLarge`] for the first such value.
    pub fn check_sizes(&self) -> Result<(), StorageError> {
        let largest = self.writes.iter().filter_map(|(_, value)| value.as_ref()).map(Bytes::len).max();
        match largest {
            Some(size_bytes) if size_bytes > VALUE_BYTES_MAX => {
                Err(StorageError::ValueTooLarge { size_bytes })
            }
            _ => Ok(()),
        }
    }
}

/// Reading ordered bytes, either as they stand or as they stood at a snapshot.
#[async_trait]
pub trait Reader: Send + Sync {
    /// The value of a key.
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError>;

    /// The values of several keys, in the order asked.
    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError>;

    /// Up to `limit` entries whose keys begin with `prefix` and are not below `from`, in byte order.
    /// An empty `from` starts at the first key of the prefix.
    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError>;
}

/// The handle of one site.
#[async_trait]
pub trait SiteStore: Reader {
    /// Applies a batch when every precondition holds, and returns once it would survive a power cut.
    ///
    /// # Errors
    /// [`StorageError::Conflict`] when a precondition fails, and then nothing was written.
    async fn commit(&self, batch: Batch, preconditions: Vec<Precondition>) -> Result<(), StorageError>;

    /// The state as of now; later commits do not show in it.
    async fn snapshot(&self) -> Result<Arc<dyn Reader>, StorageError>;

    /// Bytes this site occupies on disk, as well as the engine can tell.
    async fn num_bytes_on_disk(&self) -> Result<u64, StorageError>;

    /// Whether this handle has ended and answers nothing but [`StorageError::Fenced`]: the site was deleted, released,
    /// or taken over by another process. Opening the site again gives another handle.
    fn is_over(&self) -> bool;
}

/// A database of sites.
#[async_trait]
pub trait Storage: Send + Sync {
    /// The handle of a site, made when it does not exist.
    async fn open(&self, site: &str) -> Result<Arc<dyn SiteStore>, StorageError>;

    /// Names of all sites in byte order.
    async fn list(&self) -> Result<Vec<String>, StorageError>;

    /// Whether there is a site of a name; cheaper than [`Storage::list`] where that costs.
    async fn contains(&self, site: &str) -> Result<bool, StorageError> {
        Ok(self.list().await?.iter().any(|known| known == site))
    }

    /// Ends the handles of a site, as when another process is to serve it; they answer [`StorageError::Fenced`].
    /// Everything stays stored, and opening the site again is allowed.
    async fn release(&self, site: &str) -> Result<(), StorageError>;

    /// Forgets a site and everything in it; handles that are still held answer [`StorageError::Fenced`].
    async fn delete(&self, site: &str) -> Result<(), StorageError>;

    /// Closes everything in order; later calls answer [`StorageError::Unavailable`].
    async fn close(&self) -> Result<(), StorageError>;
}

fn unavailable(error: &dyn std::fmt::Display) -> StorageError {
    StorageError::Unavailable { retry_after: Duration::from_secs(5), reason: error.to_string() }
}

fn closed() -> StorageError {
    unavailable(&"the server is shutting down")
}
