//! Opening a site's database so that damage is told and never written over, and making one that is whole at once.
//!
//! ```text
//! open:  sync what an earlier process left ─ ledger ─ read sled's log ─ sled opens it ─ content record ─ add it up
//! make:  under a name that no site has ─ sync ─ rename
//! ```
//!
//! When sled opens a log that ends early it takes that for a torn end: it goes on from there and overwrites the rest.
//! So the log is read before sled may touch it, and a site that would lose acknowledged commits is refused as it is.

use std::collections::HashSet;
use std::fs::{self, File};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, RwLock};
use std::time::Duration;

use super::content::{CONTENT_KEY, Content};
use super::data_directory::DataDirectory;
use super::ledger::{Ledger, LedgerError};
use super::sled_database::{Database, Disk, Writes, check_room, damaged, from_sled};
use super::sled_flusher::Flusher;
use super::sled_log::{self, Verdict};
use super::sled_rewrite::num_bytes_of;
use super::upkeep::compact_site;
use super::{StorageError, files, unavailable};

/// A database that was closed a moment ago may still be held by a thread of sled's.
const NUM_LOCK_ATTEMPTS: usize = 100;
const LOCK_RETRY: Duration = Duration::from_millis(10);
/// What an empty database takes.
const NEW_SITE_BYTES: u64 = 1 << 20;
/// A site is written anew at opening when it takes so much more than what it holds.
const GARBAGE_BYTES_MIN: u64 = 64 << 20;
const GARBAGE_FACTOR: u64 = 4;
const COPY_CACHE_BYTES: u64 = 16 << 20;

/// Opens a site that is there; first writes it anew when it is mostly garbage.
pub(super) fn open_site(
    name: &str,
    directory: &DataDirectory,
    cache_bytes: u64,
) -> Result<Database, StorageError> {
    let (database, num_live_bytes) = open_as_it_is(name, directory, cache_bytes)?;
    let num_bytes = num_bytes_of(&database.path).map_err(|error| unavailable(&error))?;
    if num_bytes < GARBAGE_BYTES_MIN + GARBAGE_FACTOR * num_live_bytes
        || check_room(&database.path, num_live_bytes).is_err()
    {
        return Ok(database);
    }
    database.close()?;
    drop(database);
    match compact_site(directory, name) {
        Ok(report) => {
            let (before, after) = (report.num_bytes_before, report.num_bytes_after);
            tracing::info!(site = name, before, after, "mostly garbage, written anew");
        }
        Err(error) => tracing::warn!(site = name, %error, "mostly garbage, but it could not be written anew"),
    }
    Ok(open_as_it_is(name, directory, cache_bytes)?.0)
}

/// The database, and the bytes of what it holds.
fn open_as_it_is(
    name: &str,
    directory: &DataDirectory,
    cache_bytes: u64,
) -> Result<(Database, u64), StorageError> {
    let path = &directory.site_path(name);
    // What a killed process handed to the system must be on the disk before recovery builds on it.
    files::sync_tree(path).map_err(|error| unavailable(&error))?;
    let known = match Ledger::open(path) {
        Ok(known) => Some(known),
        Err(LedgerError::Missing) => None,
        Err(LedgerError::Damaged) => return Err(damaged(name, "its ledger cannot be read")),
        Err(LedgerError::Later { format }) => {
            let what = format!("it is stored in format {format}, which this version does not know");
            return Err(damaged(name, &what));
        }
        Err(LedgerError::Io(error)) => return Err(unavailable(&error)),
    };
    let acknowledged = known.as_ref().map(|(_, num_commits)| *num_commits);
    let num_acknowledged = acknowledged.unwrap_or(0);
    let verdict = sled_log::inspect(path, acknowledged).map_err(|problem| damaged(name, &problem))?;
    if verdict == Verdict::Suspicious {
        try_a_copy(name, path, &directory.new_site_path(name), num_acknowledged)?;
    }
    let db = open_database(name, path, cache_bytes)?;
    let (content, num_live_bytes) = content_of(name, &db, num_acknowledged)?;
    let mut ledger = match known {
        Some((ledger, _)) => ledger,
        None => {
            tracing::info!(site = name, pairs = content.num_pairs, "stored in format 2 from now on");
            Ledger::make(path, 0).map_err(|error| unavailable(&error))?
        }
    };
    db.insert(CONTENT_KEY, content.encode()).map_err(|error| from_sled(name, error))?;
    db.flush().map_err(|error| from_sled(name, error))?;
    files::sync_tree(path)
        .and_then(|()| ledger.record(content.num_commits))
        .map_err(|error| unavailable(&error))?;
    Ok((assemble(name, path, db, content, ledger)?, num_live_bytes))
}

/// Makes a site; it has its name once it is whole and on the disk.
pub(super) fn make_site(
    name: &str,
    directory: &DataDirectory,
    cache_bytes: u64,
) -> Result<Database, StorageError> {
    let io = |error: std::io::Error| unavailable(&error);
    let (new, path) = (directory.new_site_path(name), directory.site_path(name));
    check_room(&directory.sites_path(), NEW_SITE_BYTES)?;
    if new.exists() {
        fs::remove_dir_all(&new).map_err(io)?;
    }
    let db = open_database(name, &new, cache_bytes)?;
    let content = Content::default();
    db.insert(CONTENT_KEY, content.encode()).map_err(|error| from_sled(name, error))?;
    db.flush().map_err(|error| from_sled(name, error))?;
    drop(db);
    let ledger = Ledger::make(&new, content.num_commits).map_err(io)?;
    files::sync_tree(&new).and_then(|()| files::rename_directory(&new, &path)).map_err(io)?;
    let db = open_database(name, &path, cache_bytes)?;
    files::sync_tree(&path).map_err(io)?;
    assemble(name, &path, db, content, ledger)
}

/// Opens a copy, so that a database which turns out to have lost something is left as it is.
fn try_a_copy(name: &str, path: &Path, copy: &Path, num_acknowledged: u64) -> Result<(), StorageError> {
    tracing::warn!(site = name, "something in the database is not whole, trying a copy first");
    let outcome = files::copy_tree(path, copy).map_err(|error| unavailable(&error)).and_then(|()| {
        let db = open_database(name, copy, COPY_CACHE_BYTES)?;
        content_of(name, &db, num_acknowledged).map(|_| ())
    });
    fs::remove_dir_all(copy).map_err(|error| unavailable(&error))?;
    outcome
}

fn assemble(
    name: &str,
    path: &Path,
    db: sled::Db,
    content: Content,
    ledger: Ledger,
) -> Result<Database, StorageError> {
    let io = |error: std::io::Error| unavailable(&error);
    let file = File::options().read(true).write(true).open(path.join("db")).map_err(io)?;
    let mut synced_blobs = HashSet::new();
    for entry in fs::read_dir(path.join("blobs")).map_err(io)? {
        synced_blobs.insert(entry.map_err(io)?.file_name());
    }
    Ok(Database {
        name: name.to_owned(),
        path: path.to_owned(),
        db,
        flusher: Flusher::starting_after(content.num_commits),
        disk: Mutex::new(Disk { file, ledger, synced_blobs }),
        writes: RwLock::new(Writes { content, snapshots: Vec::new() }),
    })
}

/// sled reports damage as an error, but on some files it panics while it reads them; both become `Corrupt`.
pub(super) fn open_database(name: &str, path: &Path, cache_bytes: u64) -> Result<sled::Db, StorageError> {
    let config = sled::Config::new()
        .path(path)
        .cache_capacity(cache_bytes)
        .flush_every_ms(None)
        .mode(sled::Mode::HighThroughput);
    let mut num_attempts = 0;
    loop {
        num_attempts += 1;
        let outcome = catch_unwind(AssertUnwindSafe(|| config.open()));
        match outcome.map_err(|_| damaged(name, "the database cannot be read"))? {
            Err(sled::Error::Io(error))
                if num_attempts < NUM_LOCK_ATTEMPTS && error.to_string().contains("acquire lock") =>
            {
                std::thread::sleep(LOCK_RETRY);
            }
            outcome => return outcome.map_err(|error| from_sled(name, error)),
        }
    }
}

/// What the database says it holds, after adding up what it does hold; and its bytes.
///
/// A page that cannot be read is told in the log and by every request that needs it; the rest of the site serves.
fn content_of(name: &str, db: &sled::Db, num_acknowledged: u64) -> Result<(Content, u64), StorageError> {
    let recorded = match db.get(CONTENT_KEY).map_err(|error| from_sled(name, error))? {
        Some(bytes) => Some(
            Content::decode(&bytes)
                .ok_or_else(|| damaged(name, "the record of its content cannot be read"))?,
        ),
        None if num_acknowledged > 0 => return Err(damaged(name, "the record of its content is missing")),
        None => None,
    };
    let num_commits = recorded.map_or(0, |recorded| recorded.num_commits);
    if num_commits < num_acknowledged {
        let what =
            format!("its database holds {num_commits} commits of {num_acknowledged} that were acknowledged");
        return Err(damaged(name, &what));
    }
    let added_up = catch_unwind(AssertUnwindSafe(|| add_up(db)))
        .map_err(|_| damaged(name, "the database failed while reading"))?;
    match (added_up, recorded) {
        (Ok((content, num_bytes)), None) => Ok((content, num_bytes)),
        (Ok((content, num_bytes)), Some(recorded)) if is_same_content(&content, &recorded) => {
            Ok((recorded, num_bytes))
        }
        (Ok((content, _)), Some(recorded)) => {
            let what = format!(
                "{} records should be there and {} are, and they do not add up",
                recorded.num_pairs, content.num_pairs
            );
            Err(damaged(name, &what))
        }
        (Err(error), Some(recorded)) => {
            tracing::error!(site = name, %error, "a part of the site cannot be read, the rest serves; {REMEDY}");
            // Not known, so that nobody takes the rest for garbage.
            Ok((recorded, u64::MAX / 8))
        }
        (Err(error), None) => Err(from_sled(name, error)),
    }
}

const REMEDY: &str = "see `locution check`";

fn is_same_content(a: &Content, b: &Content) -> bool {
    (a.num_pairs, a.sum) == (b.num_pairs, b.sum)
}

/// Counts and sums all pairs of a database, and their bytes.
pub(super) fn add_up(db: &sled::Db) -> Result<(Content, u64), sled::Error> {
    let (mut content, mut num_bytes) = (Content::default(), 0);
    for entry in db.iter() {
        let (key, value) = entry?;
        if key.as_ref() != CONTENT_KEY {
            content.add(&key, &value);
            num_bytes += (key.len() + value.len()) as u64;
        }
    }
    Ok((content, num_bytes))
}
