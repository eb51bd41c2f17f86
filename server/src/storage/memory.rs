//! The storage that forgets: ordered maps in memory, for tests and as the plainest reading of the contract.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use async_trait::async_trait;
use bytes::Bytes;

use super::{Batch, Entry, Precondition, Reader, SiteStore, Storage, StorageError};

type Map = BTreeMap<Vec<u8>, Bytes>;

/// Sites in memory.
#[derive(Default)]
pub struct MemoryStorage {
    sites: Mutex<BTreeMap<String, Arc<MemorySite>>>,
}

#[derive(Default)]
struct MemorySite {
    // Commits replace the map instead of changing it while a snapshot shares it.
    map: Mutex<Arc<Map>>,
    is_over: AtomicBool,
}

impl MemorySite {
    fn map(&self) -> Result<MutexGuard<'_, Arc<Map>>, StorageError> {
        if self.is_over.load(Ordering::Acquire) {
            return Err(StorageError::Fenced);
        }
        Ok(lock(&self.map))
    }
}

#[async_trait]
impl Storage for MemoryStorage {
    async fn open(&self, site: &str) -> Result<Arc<dyn SiteStore>, StorageError> {
        Ok(Arc::clone(lock(&self.sites).entry(site.to_owned()).or_default()) as Arc<dyn SiteStore>)
    }

    async fn list(&self) -> Result<Vec<String>, StorageError> {
        Ok(lock(&self.sites).keys().cloned().collect())
    }

    async fn delete(&self, site: &str) -> Result<(), StorageError> {
        if let Some(store) = lock(&self.sites).remove(site) {
            store.is_over.store(true, Ordering::Release);
        }
        Ok(())
    }

    async fn release(&self, site: &str) -> Result<(), StorageError> {
        if let Some(store) = lock(&self.sites).get_mut(site) {
            let map = Arc::clone(&lock(&store.map));
            let again = MemorySite { map: Mutex::new(map), is_over: AtomicBool::new(false) };
            std::mem::replace(store, Arc::new(again)).is_over.store(true, Ordering::Release);
        }
        Ok(())
    }

    async fn close(&self) -> Result<(), StorageError> {
        Ok(())
    }
}

#[async_trait]
impl Reader for MemorySite {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        Ok(self.map()?.get(key).cloned())
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        let map = self.map()?;
        Ok(keys.iter().map(|key| map.get(key).cloned()).collect())
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        Ok(scan_map(&*self.map()?, prefix, from, limit))
    }
}

#[async_trait]
impl SiteStore for MemorySite {
    async fn commit(&self, batch: Batch, preconditions: Vec<Precondition>) -> Result<(), StorageError> {
        batch.check_sizes()?;
        let mut map = self.map()?;
        if preconditions.iter().any(|p| map.get(&p.key) != p.expected.as_ref()) {
            return Err(StorageError::Conflict);
        }
        let map = Arc::make_mut(&mut map);
        for (key, value) in batch.writes {
            match value {
                Some(value) => map.insert(key, value),
                None => map.remove(&key),
            };
        }
        Ok(())
    }

    async fn snapshot(&self) -> Result<Arc<dyn Reader>, StorageError> {
        Ok(Arc::new(MemorySnapshot { map: Arc::clone(&*self.map()?) }))
    }

    async fn num_bytes_on_disk(&self) -> Result<u64, StorageError> {
        Ok(self.map()?.iter().map(|(key, value)| (key.len() + value.len()) as u64).sum())
    }

    fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Acquire)
    }
}

struct MemorySnapshot {
    map: Arc<Map>,
}

#[async_trait]
impl Reader for MemorySnapshot {
    async fn get(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        Ok(self.map.get(key).cloned())
    }

    async fn multi_get(&self, keys: &[Vec<u8>]) -> Result<Vec<Option<Bytes>>, StorageError> {
        Ok(keys.iter().map(|key| self.map.get(key).cloned()).collect())
    }

    async fn scan(&self, prefix: &[u8], from: &[u8], limit: usize) -> Result<Vec<Entry>, StorageError> {
        Ok(scan_map(&self.map, prefix, from, limit))
    }
}

fn scan_map(map: &Map, prefix: &[u8], from: &[u8], limit: usize) -> Vec<Entry> {
    let start = from.max(prefix);
    map.range::<[u8], _>((Bound::Included(start), Bound::Unbounded))
        .take_while(|(key, _)| key.starts_with(prefix))
        .take(limit)
        .map(|(key, value)| (Bytes::copy_from_slice(key), value.clone()))
        .collect()
}

/// A panic while holding one of these locks leaves the maps whole, so the poison is ignored.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
