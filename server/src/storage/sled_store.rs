//! The embedded storage: one sled database per site under `DATA/sites/`.
//!
//! One database per site makes a site the unit of deletion (its directory goes), of damage (one site may be corrupt
//! while the others serve) and of measuring (bytes on disk). What sled does not give is added here: preconditions
//! and snapshots (one lock around apply, old values kept aside for the snapshots that are alive), a flush before
//! every answer that concurrent commits share, and errors told apart. Every call runs on a blocking thread.
//! Nothing outside this file and its flusher knows sled.

use std::collections::{BTreeMap, HashMap};
use std::ops::Bound;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock, Weak};
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;

use super::sled_flusher::Flusher;
use super::{Batch, Entry, Precondition, Reader, SiteStore, Storage, StorageError};

/// Where and how large.
#[derive(Clone, Debug)]
pub struct SledConfig {
    /// Directory that holds all sites; made when missing.
    pub directory: PathBuf,
    /// Bytes of pages that each open site may keep in memory.
    pub cache_bytes_per_site: u64,
}

/// Sites on disk.
pub struct SledStorage {
    sites: Arc<Sites>,
}

struct Sites {
    config: SledConfig,
    // None once closed.
    open: Mutex<Option<HashMap<String, Arc<SledSite>>>>,
}

impl SledStorage {
    /// A storage in a directory of its own.
    ///
    /// # Errors
    /// [`StorageError::Unavailable`] when the directory cannot be made.
    pub fn new(config: SledConfig) -> Result<Self, StorageError> {
        std::fs::create_dir_all(config.directory.join("sites")).map_err(|error| unavailable(&error))?;
        Ok(Self { sites: Arc::new(Sites { config, open: Mutex::new(Some(HashMap::new())) }) })
    }

    async fn blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Sites) -> Result<T, StorageError> + Send + 'static,
    ) -> Result<T, StorageError> {
        let sites = Arc::clone(&self.sites);
        tokio::task::spawn_blocking(move || work(&sites))
            .await
            .unwrap_or_else(|error| Err(unavailable(&error)))
    }
}

impl Sites {
    fn site_path(&self, site: &str) -> PathBuf {
        self.config.directory.join("sites").join(site)
    }

    /// Opens under the lock of the map, so that no database is opened twice.
    fn open_blocking(&self, site: &str) -> Result<Arc<SledSite>, StorageError> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let open = open.as_mut().ok_or_else(closed)?;
        if let Some(store) = open.get(site) {
            return Ok(Arc::clone(store));
        }
        let db = open_database(&self.site_path(site), self.config.cache_bytes_per_site)?;
        let store = Arc::new(SledSite {
            db,
            flusher: Flusher::default(),
            snapshots: RwLock::new(Vec::new()),
            is_fenced: AtomicBool::new(false),
        });
        open.insert(site.to_owned(), Arc::clone(&store));
        Ok(store)
    }

    fn list_blocking(&self) -> Result<Vec<String>, StorageError> {
        let mut names = Vec::new();
        let sites = std::fs::read_dir(self.config.directory.join("sites")).map_err(|e| unavailable(&e))?;
        for entry in sites {
            let entry = entry.map_err(|error| unavailable(&error))?;
            // A name with a leading dot is a deletion that was interrupted.
            match entry.file_name().into_string() {
                Ok(name) if !name.starts_with('.') => names.push(name),
                _ => {}
            }
        }
        names.sort();
        Ok(names)
    }

    fn delete_blocking(&self, site: &str) -> Result<(), StorageError> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let open = open.as_mut().ok_or_else(closed)?;
        if let Some(store) = open.remove(site) {
            store.is_fenced.store(true, Ordering::Release);
        }
        // The rename makes the site vanish at once; its name is free even while old handles still hold the files.
        let path = self.site_path(site);
        if path.exists() {
            let grave = self.site_path(&format!(".deleted-{}-{site}", open.len()));
            let _ = std::fs::remove_dir_all(&grave);
            std::fs::rename(&path, &grave).map_err(|error| unavailable(&error))?;
            std::fs::remove_dir_all(&grave).map_err(|error| unavailable(&error))?;
        }
        Ok(())
    }
}

/// sled reports damage as an error, but on some files it panics while it reads them; both become `Corrupt`.
fn open_database(path: &Path, cache_bytes: u64) -> Result<sled::Db, StorageError> {
    let config = sled::Config::new()
        .path(path)
        .cache_capacity(cache_bytes)
        .flush_every_ms(None)
        .mode(sled::Mode::HighThroughput);
    match catch_unwind(AssertUnwindSafe(|| config.open())) {
        Ok(outcome) => outcome.map_err(from_sled),
        Err(_) => {
            Err(StorageError::Corrupt { what: format!("the database {} cannot be read", path.display()) })
        }
    }
}

#[async_trait]
impl Storage for SledStorage {
    async fn open(&self, site: &str) -> Result<Arc<dyn SiteStore>, StorageError> {
        let site = site.to_owned();
        let site = self.blocking(move |sites| sites.open_blocking(&site)).await?;
        Ok(Arc::new(SledHandle { site }))
    }

    async fn list(&self) -> Result<Vec<String>, StorageError> {
        self.blocking(Sites::list_blocking).await
    }

    async fn delete(&self, site: &str) -> Result<(), StorageError> {
        let site = site.to_owned();
        self.blocking(move |sites| sites.delete_blocking(&site)).await
    }

    async fn close(&self) -> Result<(), StorageError> {
        self.blocking(|sites| {
            let open = sites.open.lock().unwrap_or_else(PoisonError::into_inner).take();
            for store in open.into_iter().flatten().map(|(_, store)| store) {
                store.is_fenced.store(true, Ordering::Release);
                store.db.flush().map_err(from_sled)?;
            }
            Ok(())
        })
        .await
    }
}

/// One open database.
struct SledSite {
    db: sled::Db,
    flusher: Flusher,
    // Commits hold this for writing, reads of a snapshot for reading. Dead snapshots are dropped at the next commit.
    snapshots: RwLock<Vec<Weak<Overlay>>>,
    is_fenced: AtomicBool,
}

/// The values that keys had when a snapshot was taken and that were overwritten since; `None`: did not exist.
#[derive(Default)]
struct Overlay {
    old_values: Mutex<BTreeMap<Vec<u8>, Option<Bytes>>>,
}

impl SledSite {
    fn check_usable(&self) -> Result<(), StorageError> {
        if self.is_fenced.load(Ordering::Acquire) {
            return Err(StorageError::Fenced);
        }
        self.flusher.failure().map_or(Ok(()), Err)
    }

    fn get_blocking(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        Ok(self.db.get(key).map_err(from_sled)?.map(|value| Bytes::copy_from_slice(&value)))
    }

    fn scan_blocking(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        let mut entries = Vec::new();
        for entry in self.db.range(from.max(prefix)..) {
            let (key, value) = entry.map_err(from_sled)?;
            if entries.len() == limit || !key.starts_with(prefix) {
                break;
            }
            entries.push((Bytes::copy_from_slice(&key), Bytes::copy_from_slice(&value)));
        }
        Ok(entries)
    }

    fn commit_blocking(&self, batch: Batch, preconditions: &[Precondition]) -> Result<(), StorageError> {
        batch.check_sizes()?;
        let ticket = self.apply_blocking(batch, preconditions)?;
        self.flusher.wait_durable(ticket, || self.flush_blocking())
    }

    /// A panic inside sled becomes an error here, because those who wait for this flush must be told.
    fn flush_blocking(&self) -> Result<(), StorageError> {
        match catch_unwind(AssertUnwindSafe(|| self.db.flush())) {
            Ok(outcome) => outcome.map(|_| ()).map_err(from_sled),
            Err(_) => Err(StorageError::Corrupt { what: "the database failed while flushing".into() }),
        }
    }

    fn apply_blocking(&self, batch: Batch, preconditions: &[Precondition]) -> Result<u64, StorageError> {
        let mut snapshots = self.snapshots.write().unwrap_or_else(PoisonError::into_inner);
        self.check_usable()?;
        for precondition in preconditions {
            if self.get_blocking(&precondition.key)? != precondition.expected {
                return Err(StorageError::Conflict);
            }
        }
        snapshots.retain(|overlay| overlay.strong_count() > 0);
        for overlay in snapshots.iter().filter_map(Weak::upgrade) {
            let mut old_values = overlay.old_values.lock().unwrap_or_else(PoisonError::into_inner);
            for (key, _) in &batch.writes {
                if !old_values.contains_key(key) {
                    old_values.insert(key.clone(), self.get_blocking(key)?);
                }
            }
        }
        let mut sled_batch = sled::Batch::default();
        for (key, value) in batch.writes {
            match value {
                Some(value) => sled_batch.insert(key, value.as_ref()),
                None => sled_batch.remove(key),
            }
        }
        self.db.apply_batch(sled_batch).map_err(from_sled)?;
        Ok(self.flusher.applied())
    }
}

/// A handle; reads and commits hop to a blocking thread.
struct SledHandle {
    site: Arc<SledSite>,
}

impl SledHandle {
    async fn blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&SledSite) -> Result<T, StorageError> + Send + 'static,
    ) -> Result<T, StorageError> {
        run_blocking(Arc::clone(&self.site), work).await
    }
}

async fn run_blocking<T: Send + 'static>(
    site: Arc<SledSite>,
    work: impl FnOnce(&SledSite) -> Result<T, StorageError> + Send + 'static,
) -> Result<T, StorageError> {
    let guarded = move || {
        site.check_usable()?;
        // Damaged pages can make sled panic deep inside; that must cost one request, not the process.
        catch_unwind(AssertUnwindSafe(|| work(&site))).unwrap_or_else(|_| {
            Err(StorageError::Corrupt { what: "the database failed while reading".into() })
        })
    };
    tokio::task::spawn_blocking(guarded).await.unwrap_or_else(|error| Err(unavailable(&error)))
}

#[async_trait]
impl Reader for SledHandle {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        let key = key.to_vec();
        self.blocking(move |site| site.get_blocking(&key)).await
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        let keys = keys.to_vec();
        self.blocking(move |site| keys.iter().map(|key| site.get_blocking(key)).collect()).await
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        let (prefix, from) = (prefix.to_vec(), from.to_vec());
        self.blocking(move |site| site.scan_blocking(&prefix, &from, limit)).await
    }
}

#[async_trait]
impl SiteStore for SledHandle {
    async fn commit(&self, batch: Batch, preconditions: Vec<Precondition>) -> Result<(), StorageError> {
        self.blocking(move |site| site.commit_blocking(batch, &preconditions)).await
    }

    async fn snapshot(&self) -> Result<Arc<dyn Reader>, StorageError> {
        let overlay = Arc::new(Overlay::default());
        self.site.snapshots.write().unwrap_or_else(PoisonError::into_inner).push(Arc::downgrade(&overlay));
        Ok(Arc::new(SledSnapshot { site: Arc::clone(&self.site), overlay }))
    }

    async fn num_bytes_on_disk(&self) -> Result<u64, StorageError> {
        self.blocking(|site| site.db.size_on_disk().map_err(from_sled)).await
    }
}

/// The database as it was: old values from the overlay, everything else from the database.
struct SledSnapshot {
    site: Arc<SledSite>,
    overlay: Arc<Overlay>,
}

impl SledSnapshot {
    async fn blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&SledSite, &BTreeMap<Vec<u8>, Option<Bytes>>) -> Result<T, StorageError>
        + Send
        + 'static,
    ) -> Result<T, StorageError> {
        let overlay = Arc::clone(&self.overlay);
        let locked = move |site: &SledSite| {
            let _no_commit = site.snapshots.read().unwrap_or_else(PoisonError::into_inner);
            let old_values = overlay.old_values.lock().unwrap_or_else(PoisonError::into_inner);
            work(site, &old_values)
        };
        run_blocking(Arc::clone(&self.site), locked).await
    }
}

#[async_trait]
impl Reader for SledSnapshot {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        let key = key.to_vec();
        self.blocking(move |site, old| {
            old.get(&key).map_or_else(|| site.get_blocking(&key), |v| Ok(v.clone()))
        })
        .await
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        let keys = keys.to_vec();
        self.blocking(move |site, old| {
            keys.iter()
                .map(|key| old.get(key).map_or_else(|| site.get_blocking(key), |v| Ok(v.clone())))
                .collect()
        })
        .await
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        let (prefix, from) = (prefix.to_vec(), from.to_vec());
        self.blocking(move |site, old| scan_overlaid(site, old, &prefix, &from, limit)).await
    }
}

/// Merges the database with the old values: keys that changed since the snapshot hide what the database says of them.
fn scan_overlaid(
    site: &SledSite,
    old_values: &BTreeMap<Vec<u8>, Option<Bytes>>,
    prefix: &[u8],
    from: &[u8],
    limit: usize,
) -> Result<Vec<Entry>, StorageError> {
    let start = from.max(prefix);
    let mut old = old_values
        .range::<[u8], _>((Bound::Included(start), Bound::Unbounded))
        .take_while(|(key, _)| key.starts_with(prefix))
        .peekable();
    let mut current = site.db.range(start..).peekable();
    let mut entries = Vec::new();
    while entries.len() < limit {
        let next_current = match current.peek() {
            Some(Ok((key, _))) if key.starts_with(prefix) => Some(key.to_vec()),
            Some(Err(error)) => return Err(from_sled(error.clone())),
            _ => None,
        };
        let is_old_next = match (old.peek(), &next_current) {
            (Some((old_key, _)), Some(key)) => old_key.as_slice() <= key.as_slice(),
            (Some(_), None) => true,
            (None, Some(_)) => false,
            (None, None) => break,
        };
        if !is_old_next {
            if let Some(Ok((key, value))) = current.next() {
                entries.push((Bytes::copy_from_slice(&key), Bytes::copy_from_slice(&value)));
            }
            continue;
        }
        if let Some((old_key, old_value)) = old.next() {
            if next_current.as_deref() == Some(old_key.as_slice()) {
                current.next();
            }
            if let Some(value) = old_value {
                entries.push((Bytes::copy_from_slice(old_key), value.clone()));
            }
        }
    }
    Ok(entries)
}

fn from_sled(error: sled::Error) -> StorageError {
    match error {
        sled::Error::Corruption { at, .. } => {
            StorageError::Corrupt { what: format!("the database, at {at:?}") }
        }
        sled::Error::CollectionNotFound(_) => StorageError::Fenced,
        other => unavailable(&other),
    }
}

fn unavailable(error: &dyn std::fmt::Display) -> StorageError {
    StorageError::Unavailable { retry_after: Duration::from_secs(5), reason: error.to_string() }
}

fn closed() -> StorageError {
    unavailable(&"the server is shutting down")
}
