//! Writing a database anew: what can be read of the old one, in order, without garbage.
//!
//! `compact` wants all of it and refuses otherwise; `repair` takes what there is and says what was lost. A page that
//! cannot be read hides the keys of one leaf: reading goes on behind it at the nearest key that can be read.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::content::{CONTENT_KEY, Content};
use super::ledger::Ledger;
use super::sled_database::from_sled;
use super::sled_open::open_database;
use super::{StorageError, files, unavailable};

/// Keys are looked for behind an unreadable page as numbers of so many bytes; those of the application are shorter.
const SEARCH_BYTES: usize = 48;
const BATCH_BYTES_MAX: usize = 4 << 20;
const CACHE_BYTES: u64 = 64 << 20;

/// What was read of a database.
#[derive(Debug, Default)]
pub(super) struct Salvage {
    /// What there is, and the number of commits that the database says.
    pub content: Content,
    /// What the database says that there should be.
    pub recorded: Option<Content>,
    /// Stretches of keys that could not be read, in words.
    pub lost: Vec<String>,
}

impl Salvage {
    /// Whether all is there.
    pub fn is_whole(&self) -> bool {
        let adds_up = |recorded: &Content| {
            (recorded.num_pairs, recorded.sum) == (self.content.num_pairs, self.content.sum)
        };
        self.lost.is_empty() && self.recorded.as_ref().is_none_or(adds_up)
    }
}

/// Reads all that can be read, in the order of the keys.
///
/// # Errors
/// Those of `keep`.
pub(super) fn salvage(
    db: &sled::Db,
    mut keep: impl FnMut(&[u8], &[u8]) -> Result<(), StorageError>,
) -> Result<Salvage, StorageError> {
    let mut salvage = Salvage::default();
    let mut from = Vec::new();
    loop {
        let mut failure = None;
        let mut entries = db.range(from.clone()..);
        while let Some(entry) = guarded(|| entries.next()) {
            let (key, value) = match entry {
                // Where pages are missing sled may come back to keys that it passed.
                Ok((key, _)) if key.as_ref() < from.as_slice() => {
                    failure = Some(sled::Error::ReportableBug("keys are out of order".into()));
                    break;
                }
                Ok(entry) => entry,
                Err(error) => {
                    failure = Some(error);
                    break;
                }
            };
            if key.as_ref() == CONTENT_KEY {
                salvage.recorded = Content::decode(&value);
            } else {
                salvage.content.add(&key, &value);
                keep(&key, &value)?;
            }
            from = [key.as_ref(), &[0]].concat();
        }
        let Some(error) = failure else { break };
        let Some(next) = next_readable(db, &from) else {
            salvage.lost.push(format!("all keys from {} on: {error}", hex(&from)));
            break;
        };
        salvage.lost.push(format!("keys from {} to below {}: {error}", hex(&from), hex(&next)));
        from = next;
    }
    salvage.content.num_commits = salvage.recorded.map_or(0, |recorded| recorded.num_commits);
    Ok(salvage)
}

/// A panic of sled on a damaged page is one more page that cannot be read.
fn guarded(
    next: impl FnOnce() -> Option<sled::Result<(sled::IVec, sled::IVec)>>,
) -> Option<sled::Result<(sled::IVec, sled::IVec)>> {
    catch_unwind(AssertUnwindSafe(next))
        .unwrap_or_else(|_| Some(Err(sled::Error::ReportableBug("a page could not be read".into()))))
}

/// The nearest key from which on reading works again: searched in steps that double, then halved.
fn next_readable(db: &sled::Db, from: &[u8]) -> Option<Vec<u8>> {
    let is_readable = |number: &[u8; SEARCH_BYTES]| {
        let from = key_of(number);
        guarded(|| db.range(from.clone()..).next())
            .is_none_or(|entry| entry.is_ok_and(|(key, _)| key.as_ref() >= from.as_slice()))
    };
    let mut start = [0; SEARCH_BYTES];
    let num_bytes = from.len().min(SEARCH_BYTES);
    start[..num_bytes].copy_from_slice(&from[..num_bytes]);
    let mut bit =
        (0..SEARCH_BYTES * 8).find(|bit| plus_bit(&start, *bit).is_none_or(|number| is_readable(&number)))?;
    let mut found = plus_bit(&start, bit)?;
    let mut unreadable = start;
    // The last key known to be unreadable moves up by ever smaller steps.
    while bit > 0 {
        bit -= 1;
        match plus_bit(&unreadable, bit) {
            Some(number) if number < found && is_readable(&number) => found = number,
            Some(number) if number < found => unreadable = number,
            _ => {}
        }
    }
    Some(key_of(&found))
}

/// The shortest key that is not below a number, as the keys at which pages begin are.
fn key_of(number: &[u8; SEARCH_BYTES]) -> Vec<u8> {
    let num_bytes = number.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    number[..num_bytes].to_vec()
}

/// A number with a power of two added; `None` when it is too large then.
fn plus_bit(number: &[u8; SEARCH_BYTES], bit: usize) -> Option<[u8; SEARCH_BYTES]> {
    let mut sum = *number;
    let mut carry = 1u16 << (bit % 8);
    for byte in sum[..SEARCH_BYTES - bit / 8].iter_mut().rev() {
        carry += u16::from(*byte);
        *byte = (carry & 0xff) as u8;
        carry >>= 8;
        if carry == 0 {
            return Some(sum);
        }
    }
    None
}

fn hex(key: &[u8]) -> String {
    key.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes what can be read of the database in one directory into a new one in another, which must not exist.
///
/// # Errors
/// Those of sled and the file system.
pub(super) fn rewrite(
    site: &str,
    from: &Path,
    to: &Path,
    num_commits_min: u64,
) -> Result<Salvage, StorageError> {
    let old = open_database(site, from, CACHE_BYTES)?;
    let new = open_database(site, to, CACHE_BYTES)?;
    let mut batch = sled::Batch::default();
    let mut num_bytes = 0;
    let sled_error = |error| from_sled(site, error);
    let mut salvage = salvage(&old, |key, value| {
        batch.insert(key, value);
        num_bytes += key.len() + value.len();
        if num_bytes > BATCH_BYTES_MAX {
            num_bytes = 0;
            new.apply_batch(std::mem::take(&mut batch)).map_err(sled_error)?;
        }
        Ok(())
    })?;
    new.apply_batch(batch).map_err(sled_error)?;
    // A damaged tree may offer a record twice; what counts is what the new one holds.
    let num_commits = salvage.content.num_commits.max(num_commits_min);
    salvage.content = Content { num_commits, ..Content::default() };
    for record in new.iter() {
        let (key, value) = record.map_err(sled_error)?;
        salvage.content.add(&key, &value);
    }
    new.insert(CONTENT_KEY, salvage.content.encode()).map_err(sled_error)?;
    new.flush().map_err(sled_error)?;
    drop((old, new));
    let io = |error: std::io::Error| unavailable(&error);
    Ledger::make(to, salvage.content.num_commits).map_err(io)?;
    files::sync_tree(to).map_err(io)?;
    Ok(salvage)
}

/// Bytes of all files in and below a directory.
pub(super) fn num_bytes_of(path: &Path) -> std::io::Result<u64> {
    let mut num_bytes = 0;
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        num_bytes += match entry.file_type()?.is_dir() {
            true => num_bytes_of(&entry.path())?,
            false => entry.metadata()?.len(),
        };
    }
    Ok(num_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two_are_added_to_long_numbers() {
        let mut number = [0; SEARCH_BYTES];
        number[SEARCH_BYTES - 1] = 0xff;
        let sum = plus_bit(&number, 0).unwrap();
        assert_eq!(sum[SEARCH_BYTES - 2..], [1, 0]);
        assert_eq!(plus_bit(&number, 8 * SEARCH_BYTES - 1).unwrap()[0], 0x80);
        assert_eq!(plus_bit(&[0xff; SEARCH_BYTES], 3), None);
    }

    #[test]
    fn a_database_written_anew_holds_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let (from, to) = (directory.path().join("old"), directory.path().join("new"));
        let db = open_database("s", &from, 1 << 20).unwrap();
        let mut content = Content { num_commits: 3, ..Content::default() };
        for number in 0..500u32 {
            let (key, value) = (number.to_be_bytes(), vec![number as u8; 3_000]);
            content.add(&key, &value);
            db.insert(key, value).unwrap();
        }
        db.insert(CONTENT_KEY, content.encode()).unwrap();
        db.flush().unwrap();
        drop(db);
        let salvage = rewrite("s", &from, &to, 0).unwrap();
        assert!(salvage.is_whole(), "{salvage:?}");
        assert_eq!(salvage.content, content);
        let again = open_database("s", &to, 1 << 20).unwrap();
        assert_eq!(super::super::sled_open::add_up(&again).unwrap().0.sum, content.sum);
    }
}
