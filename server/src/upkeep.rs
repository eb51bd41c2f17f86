//! Looking after a data directory that no server holds: checked, repaired, compacted.

use std::path::Path;

use crate::records::codec;
use crate::storage::upkeep;

pub use crate::storage::StorageError;
pub use crate::storage::upkeep::{SiteReport, compact, repair};

/// Reads everything of every site, or of one, down to the checksum of every record; changes nothing.
///
/// # Errors
/// [`StorageError::Held`] while a server runs, and those of the file system.
pub fn check(directory: &Path, site: Option<&str>) -> Result<Vec<SiteReport>, StorageError> {
    upkeep::check(directory, site, &|key, value| {
        let problem = codec::verify(value).err()?;
        let key: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
        Some(format!("the record under key {key}: {problem}"))
    })
}
