//! Forgetting what stands under a prefix.

use crate::storage::{Batch, SiteStore, StorageError};

/// Keys deleted in one commit.
const NUM_KEYS_PER_DELETION: usize = 1_000;

/// Deletes everything under some prefixes, in steps.
///
/// # Errors
/// Those of the storage; what was deleted before stays deleted.
pub async fn delete_prefixes(store: &dyn SiteStore, prefixes: &[Vec<u8>]) -> Result<(), StorageError> {
    for prefix in prefixes {
        loop {
            let entries = store.scan(prefix, &[], NUM_KEYS_PER_DELETION).await?;
            if entries.is_empty() {
                break;
            }
            let mut batch = Batch::default();
            entries.iter().for_each(|(key, _)| batch.delete(key.to_vec()));
            store.commit(batch, vec![]).await?;
        }
    }
    Ok(())
}
