//! The number of the last acknowledged commit, known outside the database that holds the commits.
//!
//! ```text
//! ledger   slot 0 │ slot 1      written in turn, each with a checksum: one is always whole
//! ```
//!
//! The ledger is written after the database was synced and before anybody is told, and is not waited for. So it never
//! says more than the database holds, whatever moment the power fails at: that would be a false alarm. A killed process
//! leaves it as written. A power cut may leave it a moment behind, and then everything up to that moment was synced in
//! the database anyway. What it guards against is damage: a database that holds fewer commits than the ledger says has
//! lost acknowledged data and is not a torn end.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Its name in the directory of a site.
pub(super) const LEDGER_FILE: &str = "ledger";
/// How sites are stored; a site without a ledger is of format 1.
const FORMAT: u32 = 2;
const MARK: [u8; 8] = *b"LOCLEDGR";
const SLOT_BYTES: usize = 4096;
const ENTRY_BYTES: usize = 8 + 4 + 8 + 4;

/// An open ledger.
pub(super) struct Ledger {
    file: File,
    next_slot: u64,
}

/// Why a ledger cannot be relied upon.
#[derive(Debug)]
pub(super) enum LedgerError {
    /// There is none: the site is of format 1, or the file was lost.
    Missing,
    /// Neither slot is whole.
    Damaged,
    /// A later version of this server wrote it.
    Later { format: u32 },
    /// The file system refused.
    Io(io::Error),
}

impl Ledger {
    /// Makes the ledger of a site; on the disk when this returns.
    pub fn make(site: &Path, num_commits: u64) -> io::Result<Self> {
        let path = site.join(LEDGER_FILE);
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path)?;
        file.set_len(2 * SLOT_BYTES as u64)?;
        let mut ledger = Self { file, next_slot: 0 };
        ledger.record(num_commits)?;
        ledger.record(num_commits)?;
        ledger.sync()?;
        super::files::sync_directory(site)?;
        Ok(ledger)
    }

    /// The ledger of a site and the number of commits that were acknowledged.
    pub fn open(site: &Path) -> Result<(Self, u64), LedgerError> {
        let file = OpenOptions::new().read(true).write(true).open(site.join(LEDGER_FILE));
        let mut file = file.map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => LedgerError::Missing,
            _ => LedgerError::Io(error),
        })?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(LedgerError::Io)?;
        let entries = [0, 1].map(|slot| read_slot(&bytes, slot));
        let later = entries.iter().flatten().find(|(format, _)| *format > FORMAT);
        if let Some((format, _)) = later {
            return Err(LedgerError::Later { format: *format });
        }
        let commits = entries.map(|entry| entry.map(|(_, num_commits)| num_commits));
        let num_commits = commits[0].max(commits[1]).ok_or(LedgerError::Damaged)?;
        // The slot that holds the newer entry is kept.
        let next_slot = u64::from(commits[0] == Some(num_commits));
        Ok((Self { file, next_slot }, num_commits))
    }

    /// Notes that all commits up to a number are on the disk and may be acknowledged.
    pub fn record(&mut self, num_commits: u64) -> io::Result<()> {
        let mut entry = MARK.to_vec();
        entry.extend(FORMAT.to_le_bytes());
        entry.extend(num_commits.to_le_bytes());
        entry.extend(crc32fast::hash(&entry).to_le_bytes());
        self.file.seek(SeekFrom::Start(self.next_slot * SLOT_BYTES as u64))?;
        self.file.write_all(&entry)?;
        self.next_slot ^= 1;
        Ok(())
    }

    /// Puts it on the disk.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_all()
    }
}

/// Format and number of commits in a slot, when it is whole.
fn read_slot(bytes: &[u8], slot: usize) -> Option<(u32, u64)> {
    let entry = bytes.get(slot * SLOT_BYTES..)?.get(..ENTRY_BYTES)?;
    let (body, crc) = entry.split_last_chunk::<4>()?;
    if !body.starts_with(&MARK) || crc32fast::hash(body) != u32::from_le_bytes(*crc) {
        return None;
    }
    let format = u32::from_le_bytes(*body[8..].first_chunk()?);
    Some((format, u64::from_le_bytes(*body[12..].first_chunk()?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_number_is_known_and_a_torn_slot_gives_the_one_before() {
        let directory = tempfile::tempdir().unwrap();
        let mut ledger = Ledger::make(directory.path(), 0).unwrap();
        for number in 1..=7 {
            ledger.record(number).unwrap();
            let path = directory.path().join(LEDGER_FILE);
            let whole = std::fs::read(&path).unwrap();
            assert_eq!(Ledger::open(directory.path()).unwrap().1, number);
            let newest = (0..2).max_by_key(|slot| read_slot(&whole, *slot).unwrap().1).unwrap();
            for byte in 0..ENTRY_BYTES {
                let mut torn = whole.clone();
                torn[newest * SLOT_BYTES + byte] ^= 0x40;
                std::fs::write(&path, &torn).unwrap();
                assert_eq!(Ledger::open(directory.path()).unwrap().1, number - 1);
            }
            std::fs::write(&path, &whole).unwrap();
        }
    }

    #[test]
    fn a_reopened_ledger_keeps_its_newer_slot() {
        let directory = tempfile::tempdir().unwrap();
        Ledger::make(directory.path(), 4).unwrap().record(5).unwrap();
        let (mut ledger, number) = Ledger::open(directory.path()).unwrap();
        assert_eq!(number, 5);
        ledger.record(6).unwrap();
        let bytes = std::fs::read(directory.path().join(LEDGER_FILE)).unwrap();
        let mut numbers = [0, 1].map(|slot| read_slot(&bytes, slot).unwrap().1);
        numbers.sort_unstable();
        assert_eq!(numbers, [5, 6]);
    }

    #[test]
    fn missing_damaged_and_later_ledgers_are_told_apart() {
        let directory = tempfile::tempdir().unwrap();
        assert!(matches!(Ledger::open(directory.path()), Err(LedgerError::Missing)));
        std::fs::write(directory.path().join(LEDGER_FILE), [0; 9000]).unwrap();
        assert!(matches!(Ledger::open(directory.path()), Err(LedgerError::Damaged)));
        let mut entry = MARK.to_vec();
        entry.extend((FORMAT + 1).to_le_bytes());
        entry.extend(9u64.to_le_bytes());
        entry.extend(crc32fast::hash(&entry).to_le_bytes());
        std::fs::write(directory.path().join(LEDGER_FILE), entry).unwrap();
        assert!(matches!(Ledger::open(directory.path()), Err(LedgerError::Later { format: 3 })));
    }
}
