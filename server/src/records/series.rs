//! Numbered items stored in chunks: appended in order, read from any number on.
//!
//! A chunk's key ends in the number of its first item. No chunk holds more than [`NUM_ITEMS_PER_CHUNK_MAX`], so the
//! chunk that holds item `n` begins at most that many numbers before `n`: reading starts there.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::codec;
use super::keys::Key;
use crate::storage::{Batch, Reader, StorageError};

/// Most items in one chunk; small enough that no chunk of any series nears the storage's value limit.
pub const NUM_ITEMS_PER_CHUNK_MAX: usize = 256;
const NUM_CHUNKS_PER_READ: usize = 64;

/// Writes items numbered from `first` on into a batch.
pub fn append<T: Serialize>(batch: &mut Batch, items: &[T], first: u64, key: impl Fn(u64) -> Key) {
    for (chunk_idx, chunk) in items.chunks(NUM_ITEMS_PER_CHUNK_MAX).enumerate() {
        let number = first + (chunk_idx * NUM_ITEMS_PER_CHUNK_MAX) as u64;
        batch.put(key(number).encode(), codec::encode(&chunk));
    }
}

/// Reads up to `limit` items, from the number that `range` begins with on and below the one it ends with.
///
/// # Errors
/// Those of the storage; [`StorageError::Corrupt`] when a number is missing.
pub async fn read<T: DeserializeOwned>(
    reader: &dyn Reader,
    prefix: &[u8],
    key: impl Fn(u64) -> Key,
    range: std::ops::Range<u64>,
    limit: usize,
) -> Result<Vec<T>, StorageError> {
    let mut items = Vec::new();
    let end = range.end.min(range.start.saturating_add(limit as u64));
    for_each_chunk(reader, prefix, key, range.start..end, |first, bytes| {
        let chunk: Vec<T> = codec::decode(bytes, "a chunk of a series")?;
        let num_items = chunk.len() as u64;
        let wanted = (first..).zip(chunk).filter(|(number, _)| (range.start..end).contains(number));
        items.extend(wanted.map(|(_, item)| item));
        Ok(num_items)
    })
    .await?;
    Ok(items)
}

/// Calls `visit(first, bytes)` for every chunk that holds a number of `range`; it answers how many items it saw.
///
/// # Errors
/// Those of the storage and of `visit`; [`StorageError::Corrupt`] when a number of the range is missing.
pub async fn for_each_chunk(
    reader: &dyn Reader,
    prefix: &[u8],
    key: impl Fn(u64) -> Key,
    range: std::ops::Range<u64>,
    mut visit: impl FnMut(u64, &[u8]) -> Result<u64, StorageError>,
) -> Result<(), StorageError> {
    let mut next = range.start;
    let mut from = range.start.saturating_sub(NUM_ITEMS_PER_CHUNK_MAX as u64 - 1);
    while next < range.end {
        let entries = reader.scan(prefix, &key(from).encode(), NUM_CHUNKS_PER_READ).await?;
        let is_last = entries.len() < NUM_CHUNKS_PER_READ;
        for (entry_key, bytes) in entries {
            let first = Key::last_u64(&entry_key).unwrap_or(u64::MAX);
            if first >= range.end {
                break;
            }
            from = first + 1;
            // Chunks that end before the range are only there because the search began early.
            let num_items = visit(first, &bytes)?;
            if first + num_items > next {
                if first > next {
                    break;
                }
                next = first + num_items;
            }
        }
        if is_last {
            break;
        }
    }
    if next < range.end {
        return Err(StorageError::Corrupt { what: format!("number {next} of a series is missing") });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::storage::{MemoryStorage, Storage};

    fn key(first: u64) -> Key {
        Key::Observations(0, 3, first)
    }

    #[tokio::test]
    async fn any_window_of_any_chunking_is_read_back() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let store = MemoryStorage::default().open("site").await.unwrap();
        let mut total = 0u64;
        for _ in 0..200 {
            let num = rng.random_range(0..40);
            let items: Vec<u64> = (total..total + num).collect();
            let mut batch = Batch::default();
            append(&mut batch, &items, total, key);
            store.commit(batch, vec![]).await.unwrap();
            total += num;
        }
        let big: Vec<u64> = (total..total + 1000).collect();
        let mut batch = Batch::default();
        append(&mut batch, &big, total, key);
        store.commit(batch, vec![]).await.unwrap();
        total += 1000;
        let prefix = Key::all_observations(0, 3);
        for _ in 0..200 {
            let start = rng.random_range(0..=total);
            let limit = rng.random_range(0..2000);
            let items: Vec<u64> = read(&*store, &prefix, key, start..total, limit).await.unwrap();
            assert_eq!(items, (start..total.min(start + limit as u64)).collect::<Vec<_>>());
        }
    }

    #[tokio::test]
    async fn a_missing_chunk_is_noticed() {
        let store = MemoryStorage::default().open("site").await.unwrap();
        let mut batch = Batch::default();
        append(&mut batch, &[1u64, 2], 0, key);
        append(&mut batch, &[5u64], 4, key);
        store.commit(batch, vec![]).await.unwrap();
        let outcome = read::<u64>(&*store, &Key::all_observations(0, 3), key, 0..5, 99).await;
        assert!(matches!(outcome, Err(StorageError::Corrupt { .. })));
    }
}
