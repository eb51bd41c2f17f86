//! The embedded storage: one sled database per site under `DATA/sites/`.
//!
//! One database per site makes a site the unit of deletion (its directory goes), of damage (one site may be corrupt
//! while the others serve) and of measuring (bytes on disk). Every call runs on a blocking thread.
//! Nothing outside `storage` knows sled.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use async_trait::async_trait;

use super::data_directory::DataDirectory;
use super::sled_open::{make_site, open_site};
use super::sled_site::{SledHandle, SledSite};
use super::{SiteStore, Storage, StorageError, closed, unavailable};

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
    directory: Arc<DataDirectory>,
    cache_bytes_per_site: u64,
    // None once closed.
    open: Mutex<Option<Open>>,
}

#[derive(Default)]
struct Open {
    sites: HashMap<String, Arc<SledSite>>,
    /// Sites that turned out to be damaged, and how: reading all of one again for every request would take long.
    damaged: HashMap<String, StorageError>,
}

impl SledStorage {
    /// A storage in a directory of its own, held until the storage is dropped.
    ///
    /// # Errors
    /// [`StorageError::Held`] when another process holds the directory, [`StorageError::Unavailable`] when it cannot
    /// be written.
    pub fn new(config: SledConfig) -> Result<Self, StorageError> {
        let directory = Arc::new(DataDirectory::hold(&config.directory)?);
        let cache_bytes_per_site = config.cache_bytes_per_site;
        let open = Mutex::new(Some(Open::default()));
        Ok(Self { sites: Arc::new(Sites { directory, cache_bytes_per_site, open }) })
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
    /// Opens under the lock of the map, so that no database is opened twice.
    fn open_blocking(&self, site: &str) -> Result<Arc<SledSite>, StorageError> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let open = open.as_mut().ok_or_else(closed)?;
        if let Some(store) = open.sites.get(site) {
            return Ok(Arc::clone(store));
        }
        if let Some(error) = open.damaged.get(site) {
            return Err(error.clone());
        }
        let database = match self.directory.site_path(site).exists() {
            true => open_site(site, &self.directory, self.cache_bytes_per_site),
            false => make_site(site, &self.directory, self.cache_bytes_per_site),
        };
        let database = database.inspect_err(|error| {
            if matches!(error, StorageError::Corrupt { .. }) {
                open.damaged.insert(site.to_owned(), error.clone());
            }
        })?;
        let directory = Arc::clone(&self.directory);
        let store = Arc::new(SledSite::new(site, directory, self.cache_bytes_per_site, database));
        open.sites.insert(site.to_owned(), Arc::clone(&store));
        Ok(store)
    }

    fn release_blocking(&self, site: &str) -> Result<(), StorageError> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let open = open.as_mut().ok_or_else(closed)?;
        match open.sites.remove(site).and_then(|store| store.fence()) {
            Some(database) => database.close(),
            None => Ok(()),
        }
    }

    fn delete_blocking(&self, site: &str) -> Result<(), StorageError> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let open = open.as_mut().ok_or_else(closed)?;
        open.damaged.remove(site);
        if let Some(store) = open.sites.remove(site) {
            store.fence();
        }
        self.directory.delete(site).map_err(|error| unavailable(&error))
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
        self.blocking(|sites| sites.directory.sites().map_err(|error| unavailable(&error))).await
    }

    async fn delete(&self, site: &str) -> Result<(), StorageError> {
        let site = site.to_owned();
        self.blocking(move |sites| sites.delete_blocking(&site)).await
    }

    async fn release(&self, site: &str) -> Result<(), StorageError> {
        let site = site.to_owned();
        self.blocking(move |sites| sites.release_blocking(&site)).await
    }

    async fn close(&self) -> Result<(), StorageError> {
        self.blocking(|sites| {
            let open = sites.open.lock().unwrap_or_else(PoisonError::into_inner).take();
            for (name, store) in open.into_iter().flat_map(|open| open.sites) {
                // One site that cannot be closed must not keep the others from it.
                if let Some(Err(error)) = store.fence().map(|database| database.close()) {
                    tracing::error!(site = name, %error, "the site could not be closed in order");
                }
            }
            sites.directory.release();
            Ok(())
        })
        .await
    }
}
