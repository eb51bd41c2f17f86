//! The storage beyond one machine: a SlateDB database for each site over an object store.
//!
//! ```text
//! PREFIX/format                   the layout of everything below; its writing shows that the store keeps preconditions
//! PREFIX/names/SITE               which incarnation of the site stands
//! PREFIX/sites/SITE/INCARNATION/  the database of that incarnation: log, tables, manifest
//! ```
//!
//! Opening a database fences whoever held it before, so a site has one writer however many servers run, and moving
//! it copies nothing. A name is taken by a conditional write, so two servers never make one site twice; a site made
//! again after its deletion is another incarnation, which no old handle reaches.
//! Nothing outside this room knows SlateDB.

mod address;
mod format;
mod names;
mod site;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
pub(super) mod tests;

use std::collections::HashMap;
use std::future::{Future, ready};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use async_trait::async_trait;
use futures::{StreamExt, TryStreamExt, stream};
use object_store::path::Path;
use object_store::{ObjectMeta, ObjectStore, ObjectStoreExt, PutPayload};
use slatedb::Db;
use slatedb::config::{
    CompactionWorkerOptions, CompactorOptions, GarbageCollectorDirectoryOptions, GarbageCollectorOptions,
    GarbageCollectorScheduleOptions, Settings,
};
use slatedb::db_cache::DbCache;
use slatedb::db_cache::moka::{MokaCache, MokaCacheOptions};

pub use address::store_at;
use names::Names;
use site::{Incarnation, ObjectHandle, ObjectSite, told};

use super::{SiteStore, Storage, StorageError, closed, unavailable};

/// A site that is open asks the store this often for news of its own database; each asking costs a few requests.
const POLL_INTERVAL: Duration = Duration::from_secs(30);
/// How often an open site looks for objects that nothing refers to any more.
const SWEEP_INTERVAL: Duration = Duration::from_secs(900);
/// A snapshot can be read for so long, whatever is compacted meanwhile; a backup is one.
const SNAPSHOT_LIFETIME: Duration = Duration::from_secs(3_600);
/// Size at which a table in memory becomes an object.
const TABLE_BYTES: usize = 8 << 20;
/// Bytes of one site that may wait for the store before commits wait too.
const UNFLUSHED_BYTES_MAX: usize = 64 << 20;
/// The store is asked again so often before an operation of the engine fails, up to a second apart.
const NUM_RETRIES_MAX: u32 = 60;
/// Sites that are closed at once.
const NUM_CLOSED_AT_ONCE: usize = 16;

/// How the object store is used.
#[derive(Clone, Debug)]
pub struct ObjectConfig {
    /// Commits wait up to this long for others to share their one write: longer is slower and cheaper.
    pub flush_interval: Duration,
    /// No call waits longer for the store. A commit that is not durable by then may still become so.
    pub patience: Duration,
    /// Bytes of blocks kept in memory, over all sites.
    pub cache_bytes: u64,
}

/// A place for the handle of one site; locked while its database is opened or closed, so that no process fences itself.
type Slot = Arc<tokio::sync::Mutex<Option<Arc<ObjectSite>>>>;

/// Sites in an object store.
pub struct ObjectStorage {
    store: Arc<dyn ObjectStore>,
    prefix: Path,
    names: Arc<Names>,
    config: ObjectConfig,
    cache: Arc<dyn DbCache>,
    // None once closed.
    slots: Mutex<Option<HashMap<String, Slot>>>,
}

impl ObjectStorage {
    /// A storage under a prefix of a store.
    ///
    /// # Errors
    /// [`StorageError::Unavailable`] when the store does not answer, or does not keep preconditions of writes;
    /// [`StorageError::Corrupt`] when the prefix holds something else or the layout of a later version.
    pub async fn connect(
        store: Arc<dyn ObjectStore>,
        prefix: Path,
        config: ObjectConfig,
    ) -> Result<Self, StorageError> {
        let greeting = format::check(&*store, &prefix);
        match tokio::time::timeout(config.patience, greeting).await {
            Ok(outcome) => outcome?,
            Err(_) => return Err(unavailable(&"the object store does not answer")),
        }
        let cache = MokaCacheOptions { max_capacity: config.cache_bytes, ..MokaCacheOptions::default() };
        Ok(Self {
            names: Arc::new(Names::new(Arc::clone(&store), &prefix)),
            cache: Arc::new(MokaCache::new_with_opts(cache)),
            slots: Mutex::new(Some(HashMap::new())),
            store,
            prefix,
            config,
        })
    }

    fn slot(&self, site: &str) -> Result<Slot, StorageError> {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let slots = slots.as_mut().ok_or_else(closed)?;
        Ok(Arc::clone(slots.entry(site.to_owned()).or_default()))
    }

    fn is_closed(&self) -> bool {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner).is_none()
    }

    /// Where the databases of all incarnations of a site lie.
    fn site_path(&self, site: &str) -> Path {
        self.prefix.clone().join("sites").join(site)
    }

    fn settings(&self) -> Settings {
        let worker = CompactionWorkerOptions {
            compactions_poll_interval: POLL_INTERVAL,
            object_store_max_retries: Some(NUM_RETRIES_MAX),
            ..CompactionWorkerOptions::default()
        };
        let compactor = CompactorOptions {
            poll_interval: POLL_INTERVAL,
            worker: Some(worker),
            checkpoint_lifetime: SNAPSHOT_LIFETIME,
            object_store_max_retries: Some(NUM_RETRIES_MAX),
            ..CompactorOptions::default()
        };
        Settings {
            flush_interval: Some(self.config.flush_interval),
            manifest_poll_interval: POLL_INTERVAL,
            l0_sst_size_bytes: TABLE_BYTES,
            max_unflushed_bytes: UNFLUSHED_BYTES_MAX,
            compactor_options: Some(compactor),
            garbage_collector_options: Some(sweeping()),
            object_store_max_retries: Some(NUM_RETRIES_MAX),
            ..Settings::default()
        }
    }

    async fn bounded<T>(
        &self,
        work: impl Future<Output = Result<T, StorageError>>,
    ) -> Result<T, StorageError> {
        let late = || unavailable(&"the object store does not answer in time");
        tokio::time::timeout(self.config.patience, work).await.unwrap_or_else(|_| Err(late()))
    }

    /// Opens the database of an incarnation and thereby fences whoever held it.
    async fn open_database(&self, site: &str, id: String) -> Result<ObjectSite, StorageError> {
        let path = self.site_path(site).join(id.as_str());
        let builder = Db::builder(path.clone(), Arc::clone(&self.store))
            .with_settings(self.settings())
            .with_db_cache(Arc::clone(&self.cache), cache_id(&id));
        let database = self.bounded(async { builder.build().await.map_err(|error| told(&error)) }).await?;
        let incarnation = Incarnation { site: site.to_owned(), id, path };
        let (store, names) = (Arc::clone(&self.store), Arc::clone(&self.names));
        Ok(ObjectSite::new(incarnation, database, store, names, self.config.patience))
    }

    /// Removes all bytes of a database that no name refers to. The objects of its log are emptied and stay: a server
    /// that has not noticed yet that it lost the site must not find their places free, or it would acknowledge.
    async fn remove_objects(&self, path: &Path) -> Result<(), object_store::Error> {
        let log = path.clone().join("wal");
        let logged = self.store.list(Some(&log));
        let empty = |object: ObjectMeta| async move {
            self.store.put(&object.location, PutPayload::default()).await.map(|_| ())
        };
        logged.try_for_each_concurrent(NUM_CLOSED_AT_ONCE, empty).await?;
        let others = self.store.list(Some(path)).map_ok(|object| object.location);
        let others = others.try_filter(move |location| ready(!location.prefix_matches(&log)));
        self.store.delete_stream(others.boxed()).try_for_each(async |_| Ok(())).await
    }
}

#[async_trait]
impl Storage for ObjectStorage {
    async fn open(&self, site: &str) -> Result<Arc<dyn SiteStore>, StorageError> {
        let slot = self.slot(site)?;
        let mut slot = slot.lock().await;
        if let Some(open) = slot.as_ref().filter(|open| !open.is_over()) {
            return Ok(Arc::new(ObjectHandle { site: Arc::clone(open) }));
        }
        let id = self.bounded(self.names.find_or_make(site)).await?;
        let open = Arc::new(self.open_database(site, id).await?);
        *slot = Some(Arc::clone(&open));
        if self.is_closed() {
            open.close().await?;
            return Err(closed());
        }
        Ok(Arc::new(ObjectHandle { site: open }))
    }

    async fn list(&self) -> Result<Vec<String>, StorageError> {
        if self.is_closed() {
            return Err(closed());
        }
        Ok(self.bounded(self.names.list()).await?.into_iter().collect())
    }

    async fn contains(&self, site: &str) -> Result<bool, StorageError> {
        if self.is_closed() {
            return Err(closed());
        }
        Ok(self.bounded(self.names.find(site)).await?.is_some())
    }

    async fn delete(&self, site: &str) -> Result<(), StorageError> {
        let slot = self.slot(site)?;
        let mut slot = slot.lock().await;
        if let Some(open) = slot.take() {
            open.give_up();
        }
        let Some(id) = self.bounded(self.names.find(site)).await? else {
            return Ok(());
        };
        // Another server may hold it: opening takes it from that server before its objects go.
        let path = self.site_path(site).join(id.as_str());
        let taken = match self.open_database(site, id).await {
            // What cannot be read can still be deleted.
            Err(StorageError::Corrupt { .. }) => None,
            taken => Some(taken?),
        };
        self.bounded(self.names.remove(site)).await?;
        if let Some(taken) = taken
            && let Err(error) = taken.close().await
        {
            tracing::warn!(site, %error, "a deleted site was not closed in order");
        }
        if let Err(error) = self.remove_objects(&path).await {
            tracing::warn!(site, %error, "objects of a deleted site are left over");
        }
        Ok(())
    }

    async fn release(&self, site: &str) -> Result<(), StorageError> {
        let slot = self.slot(site)?;
        let released = slot.lock().await.take();
        match released {
            Some(open) => open.close().await,
            None => Ok(()),
        }
    }

    async fn close(&self) -> Result<(), StorageError> {
        let slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner).take();
        let close = async |(name, slot): (String, Slot)| {
            let open = slot.lock().await.take();
            // One site that cannot be closed must not keep the others from it; what was acknowledged is durable anyway.
            if let Some(open) = open
                && let Err(error) = open.close().await
            {
                tracing::error!(site = name, %error, "the site could not be closed in order");
            }
        };
        stream::iter(slots.into_iter().flatten()).for_each_concurrent(NUM_CLOSED_AT_ONCE, close).await;
        Ok(())
    }
}

/// Objects that nothing refers to go after a while. Those that fence old writers off stay: they hold no bytes, and
/// without them a writer that wakes up late could be believed.
fn sweeping() -> GarbageCollectorOptions {
    let directory = || {
        let interval = Some(SWEEP_INTERVAL);
        Some(GarbageCollectorDirectoryOptions { interval, ..GarbageCollectorDirectoryOptions::default() })
    };
    GarbageCollectorOptions {
        manifest_options: directory(),
        wal_options: directory(),
        wal_fence_options: None,
        compacted_options: directory(),
        compactions_options: directory(),
        detach_options: Some(GarbageCollectorScheduleOptions { interval: Some(SWEEP_INTERVAL) }),
        object_store_max_retries: Some(NUM_RETRIES_MAX),
        ..GarbageCollectorOptions::default()
    }
}

/// Parts the shared cache among databases; incarnations are random, so the first 64 bits of theirs are.
fn cache_id(incarnation: &str) -> u64 {
    u64::from_str_radix(incarnation.get(..16).unwrap_or_default(), 16).unwrap_or_default()
}
