//! A site as it stood: old values from an overlay, everything else from the database.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use async_trait::async_trait;
use bytes::Bytes;

use super::sled_database::Database;
use super::sled_site::run_blocking;
use super::{Entry, Reader, StorageError};

/// The values that keys had when a snapshot was taken and that were overwritten since; `None`: did not exist.
#[derive(Default)]
pub(super) struct Overlay {
    old_values: Mutex<BTreeMap<Vec<u8>, Option<Bytes>>>,
}

impl Overlay {
    /// Keeps the value that a key had, unless it changed before.
    pub(super) fn keep(&self, key: &[u8], old: Option<&Bytes>) {
        let mut old_values = self.old_values.lock().unwrap_or_else(PoisonError::into_inner);
        if !old_values.contains_key(key) {
            old_values.insert(key.to_vec(), old.cloned());
        }
    }
}

/// A database that failed or was deleted is not kept alive by its snapshots: they end with it.
pub(super) struct SledSnapshot {
    name: String,
    database: Weak<Database>,
    overlay: Arc<Overlay>,
}

impl SledSnapshot {
    pub(super) fn of(database: &Arc<Database>) -> Self {
        let name = database.name.clone();
        Self { name, database: Arc::downgrade(database), overlay: database.freeze() }
    }

    async fn blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Database, &BTreeMap<Vec<u8>, Option<Bytes>>) -> Result<T, StorageError>
        + Send
        + 'static,
    ) -> Result<T, StorageError> {
        let overlay = Arc::clone(&self.overlay);
        let database = Weak::clone(&self.database);
        let locked = move |site: &Arc<Database>| {
            let _no_commit = site.writes.read().unwrap_or_else(PoisonError::into_inner);
            let old_values = overlay.old_values.lock().unwrap_or_else(PoisonError::into_inner);
            work(site, &old_values)
        };
        let alive = move || match database.upgrade() {
            Some(database) => database.failure().map_or(Ok(database), Err),
            None => Err(StorageError::Fenced),
        };
        run_blocking(self.name.clone(), alive, locked).await
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
    site: &Database,
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
    let mut current = site.pairs(start).peekable();
    let mut entries = Vec::new();
    while entries.len() < limit {
        let next_current = match current.peek() {
            Some(Ok((key, _))) if key.starts_with(prefix) => Some(key.to_vec()),
            Some(Err(error)) => return Err(error.clone()),
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
