//! One sled database, with what sled does not give: preconditions and snapshots (one lock around apply,
//! old values kept aside for the snapshots that are alive), a sync before every answer that concurrent commits share,
//! a record of what the database holds, and errors told apart.
//!
//! ```text
//! commit: check preconditions ─ apply batch and content record ─ ticket ─ wait for the sync that covers it ─ answer
//! sync:   sled's flush ─ new blobs ─ the database file ─ ledger
//! ```
//!
//! sled's flush hands its bytes to the file system and waits for them (`sync_file_range`), but what was handed over is
//! on the disk only after the file was synced, length and all. sled reuses a part of its file once the pages in it
//! stand elsewhere, and takes "handed over" for "on the disk". So whoever commits holds an epoch pinned from before the
//! batch is applied until it was synced: sled frees nothing while a guard is older than what replaced it.

use std::collections::{BTreeMap, HashSet};
use std::ffi::OsString;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, RwLock, Weak};
use std::time::Instant;

use bytes::Bytes;

use super::content::{CONTENT_KEY, Content};
use super::ledger::Ledger;
use super::sled_flusher::Flusher;
use super::sled_snapshot::Overlay;
use super::{Batch, Entry, Precondition, StorageError, files, unavailable};

/// So much of a disk is kept free, or a part of it on a small one, for what sled writes beside the values: pages
/// moved, snapshots at opening.
const RESERVE_BYTES_MAX: u64 = 64 << 20;
const RESERVE_PART: u64 = 16;
/// A page that a value goes into is written again with what else stands in it.
const NUM_WRITES_PER_BYTE: u64 = 4;

/// One open database.
pub(super) struct Database {
    pub(super) name: String,
    pub(super) path: PathBuf,
    pub(super) db: sled::Db,
    pub(super) flusher: Flusher,
    pub(super) disk: Mutex<Disk>,
    // Commits hold this for writing, reads of a snapshot for reading.
    pub(super) writes: RwLock<Writes>,
}

/// What a commit brings up to date under the lock.
pub(super) struct Writes {
    pub(super) content: Content,
    // Dead snapshots are dropped at the next commit.
    pub(super) snapshots: Vec<Weak<Overlay>>,
}

/// What a sync needs besides the database.
pub(super) struct Disk {
    pub(super) file: File,
    pub(super) ledger: Ledger,
    pub(super) synced_blobs: HashSet<OsString>,
}

impl Database {
    /// Why it may not be used any more: after a failed sync memory and disk differ.
    pub(super) fn failure(&self) -> Option<StorageError> {
        self.flusher.failure()
    }

    /// The error for damage in this site, with what can be done about it.
    pub(super) fn damaged(&self, what: &str) -> StorageError {
        damaged(&self.name, what)
    }

    pub(super) fn sled_error(&self, error: sled::Error) -> StorageError {
        from_sled(&self.name, error)
    }

    pub(super) fn get_blocking(&self, key: &[u8]) -> Result<Option<Bytes>, StorageError> {
        let found = self.db.get(key).map_err(|error| self.sled_error(error))?;
        Ok(found.map(|value| Bytes::copy_from_slice(&value)))
    }

    /// All pairs from a key on, in byte order, without the record of the content.
    pub(super) fn pairs(
        &self,
        start: &[u8],
    ) -> impl Iterator<Item = Result<(sled::IVec, sled::IVec), StorageError>> {
        self.db
            .range(start.to_vec()..)
            .filter(|entry| !matches!(entry, Ok((key, _)) if key.as_ref() == CONTENT_KEY))
            .map(move |entry| entry.map_err(|error| self.sled_error(error)))
    }

    pub(super) fn scan_blocking(
        &self,
        prefix: &[u8],
        from: &[u8],
        limit: usize,
    ) -> Result<Vec<Entry>, StorageError> {
        let mut entries = Vec::new();
        for entry in self.pairs(from.max(prefix)) {
            let (key, value) = entry?;
            if entries.len() == limit || !key.starts_with(prefix) {
                break;
            }
            entries.push((Bytes::copy_from_slice(&key), Bytes::copy_from_slice(&value)));
        }
        Ok(entries)
    }

    pub(super) fn commit_blocking(
        &self,
        batch: Batch,
        preconditions: &[Precondition],
    ) -> Result<(), StorageError> {
        batch.check_sizes()?;
        check_room(&self.path, batch.num_value_bytes() as u64)?;
        let started = Instant::now();
        let _nothing_is_freed_before_the_sync = sled::pin();
        let ticket = self.apply_blocking(batch, preconditions)?;
        let outcome = self.flusher.wait_durable(ticket, |covered| self.sync_blocking(covered));
        metrics::histogram!("locution_commit_seconds").record(started.elapsed().as_secs_f64());
        outcome
    }

    /// Applies a batch and says the number of the commit that it became.
    fn apply_blocking(&self, batch: Batch, preconditions: &[Precondition]) -> Result<u64, StorageError> {
        let mut writes = self.writes.write().unwrap_or_else(PoisonError::into_inner);
        self.failure().map_or(Ok(()), Err)?;
        for precondition in preconditions {
            if self.get_blocking(&precondition.key)? != precondition.expected {
                return Err(StorageError::Conflict);
            }
        }
        // The last word on a key wins.
        let last_words: BTreeMap<Vec<u8>, Option<Bytes>> = batch.writes.into_iter().collect();
        writes.snapshots.retain(|overlay| overlay.strong_count() > 0);
        let overlays: Vec<_> = writes.snapshots.iter().filter_map(Weak::upgrade).collect();
        let mut content = writes.content;
        content.num_commits += 1;
        let mut sled_batch = sled::Batch::default();
        for (key, value) in last_words {
            let old = self.get_blocking(&key)?;
            overlays.iter().for_each(|overlay| overlay.keep(&key, old.as_ref()));
            if let Some(old) = old {
                content.remove(&key, &old);
            }
            match value {
                Some(value) => {
                    content.add(&key, &value);
                    sled_batch.insert(key, value.as_ref());
                }
                None => sled_batch.remove(key),
            }
        }
        sled_batch.insert(CONTENT_KEY, content.encode());
        self.db.apply_batch(sled_batch).map_err(|error| {
            let error = self.sled_error(error);
            self.flusher.fail(error.clone());
            error
        })?;
        writes.content = content;
        self.flusher.applied(content.num_commits);
        Ok(content.num_commits)
    }

    /// Puts everything applied on the disk. A panic inside sled becomes an error here, because those who wait for
    /// this sync must be told.
    pub(super) fn sync_blocking(&self, num_commits: u64) -> Result<(), StorageError> {
        let started = Instant::now();
        match catch_unwind(AssertUnwindSafe(|| self.db.flush())) {
            Ok(outcome) => outcome.map(|_| ()).map_err(|error| self.sled_error(error))?,
            Err(_) => return Err(self.damaged("the database failed while flushing")),
        }
        let mut disk = self.disk.lock().unwrap_or_else(PoisonError::into_inner);
        disk.sync(&self.path, num_commits).map_err(|error| unavailable(&error))?;
        metrics::histogram!("locution_storage_sync_seconds").record(started.elapsed().as_secs_f64());
        Ok(())
    }

    /// The state as of now.
    pub(super) fn freeze(&self) -> Arc<Overlay> {
        let overlay = Arc::new(Overlay::default());
        let mut writes = self.writes.write().unwrap_or_else(PoisonError::into_inner);
        writes.snapshots.push(Arc::downgrade(&overlay));
        overlay
    }

    /// Puts everything on the disk, the ledger too.
    pub(super) fn close(&self) -> Result<(), StorageError> {
        self.failure().map_or(Ok(()), Err)?;
        let num_commits = self.writes.read().unwrap_or_else(PoisonError::into_inner).content.num_commits;
        self.sync_blocking(num_commits)?;
        let disk = self.disk.lock().unwrap_or_else(PoisonError::into_inner);
        disk.ledger.sync().map_err(|error| unavailable(&error))
    }
}

impl Disk {
    /// Syncs what sled wrote, then notes in the ledger what may be acknowledged.
    fn sync(&mut self, site: &Path, num_commits: u64) -> std::io::Result<()> {
        self.sync_new_blobs(site)?;
        self.file.sync_data()?;
        self.ledger.record(num_commits)
    }

    /// Values too large for sled's file stand in files of their own, which are written once.
    fn sync_new_blobs(&mut self, site: &Path) -> std::io::Result<()> {
        let blobs = site.join("blobs");
        let mut present = HashSet::new();
        let mut is_any_new = false;
        for entry in std::fs::read_dir(&blobs)? {
            let entry = entry?;
            if !self.synced_blobs.contains(&entry.file_name()) {
                match File::open(entry.path()) {
                    Ok(file) => file.sync_all()?,
                    // sled removed it meanwhile: something newer stands for it.
                    Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
                    Err(error) => return Err(error),
                }
                is_any_new = true;
            }
            present.insert(entry.file_name());
        }
        self.synced_blobs = present;
        if is_any_new { files::sync_directory(&blobs) } else { Ok(()) }
    }
}

/// Refuses writes before the disk is so full that sled could fail in the middle of one. Deleting needs less.
pub(super) fn check_room(path: &Path, num_bytes: u64) -> Result<(), StorageError> {
    let space = files::space(path).map_err(|error| unavailable(&error))?;
    let reserve_bytes = RESERVE_BYTES_MAX.min(space.total_bytes / RESERVE_PART);
    let needed_bytes = match num_bytes {
        0 => reserve_bytes / 2,
        _ => reserve_bytes + NUM_WRITES_PER_BYTE * num_bytes,
    };
    // Some file systems do not say how large they are.
    if space.total_bytes > 0 && space.free_bytes < needed_bytes {
        let free_bytes = space.free_bytes;
        let reason = format!("{free_bytes} bytes are free on its disk, {needed_bytes} are needed");
        return Err(StorageError::Full { reason });
    }
    Ok(())
}

/// The error for damage in a site, with what can be done about it.
pub(super) fn damaged(site: &str, what: &str) -> StorageError {
    StorageError::Corrupt { what: format!("site `{site}`: {what}; {REMEDY}") }
}

const REMEDY: &str = "`locution check` says what is damaged, `locution repair` keeps what can be read, a backup brings \
                      back the rest";

pub(super) fn from_sled(site: &str, error: sled::Error) -> StorageError {
    match error {
        sled::Error::Corruption { at: Some(at), .. } => {
            damaged(site, &format!("a page of the database at {at} cannot be read"))
        }
        sled::Error::Corruption { .. } => damaged(site, "the database cannot be read"),
        sled::Error::CollectionNotFound(_) => StorageError::Fenced,
        other => unavailable(&other),
    }
}
