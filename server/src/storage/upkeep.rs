//! Looking after a data directory while no server holds it: check, repair, compact.
//!
//! Nothing here changes a site in place. What is written goes into a new directory, is on the disk before it takes the
//! name of the old one, and a repair keeps the old one under `DATA/damaged/`.

use std::fs;
use std::path::{Path, PathBuf};

use super::data_directory::DataDirectory;
use super::ledger::{Ledger, LedgerError};
use super::sled_database::damaged;
use super::sled_open::open_database;
use super::sled_rewrite::{Salvage, num_bytes_of, rewrite, salvage};
use super::{StorageError, files, sled_log, unavailable};

/// What is known of one site.
#[derive(Debug)]
pub struct SiteReport {
    /// Its name.
    pub site: String,
    /// Commits that were acknowledged, as the ledger says.
    pub num_acknowledged: u64,
    /// Commits that the database holds.
    pub num_commits: u64,
    /// Records that can be read.
    pub num_records: u64,
    /// Bytes on disk before.
    pub num_bytes_before: u64,
    /// Bytes on disk after.
    pub num_bytes_after: u64,
    /// What is damaged, in words; none when the site is sound.
    pub problems: Vec<String>,
}

/// Reads everything of every site, or of one, and says what is damaged. Changes nothing.
///
/// `check_record` is told key and value of every record and answers what is wrong with it.
///
/// # Errors
/// [`StorageError::Held`] while a server runs, and those of the file system.
pub fn check(
    directory: &Path,
    only: Option<&str>,
    check_record: &dyn Fn(&[u8], &[u8]) -> Option<String>,
) -> Result<Vec<SiteReport>, StorageError> {
    let held = DataDirectory::hold(directory)?;
    let mut reports = Vec::new();
    for site in wanted(&held, only)? {
        let copy = held.new_site_path(&site);
        let outcome = check_site(&site, &held.site_path(&site), &copy, check_record);
        remove(&copy)?;
        reports.push(outcome?);
    }
    Ok(reports)
}

/// Opening changes a database, so a copy is opened.
fn check_site(
    site: &str,
    path: &Path,
    copy: &Path,
    check_record: &dyn Fn(&[u8], &[u8]) -> Option<String>,
) -> Result<SiteReport, StorageError> {
    let io = |error: std::io::Error| unavailable(&error);
    let num_bytes = num_bytes_of(path).map_err(io)?;
    let mut report = SiteReport {
        site: site.to_owned(),
        num_acknowledged: 0,
        num_commits: 0,
        num_records: 0,
        num_bytes_before: num_bytes,
        num_bytes_after: num_bytes,
        problems: sled_log::damages(path),
    };
    match acknowledged(path)? {
        Ok(num_acknowledged) => report.num_acknowledged = num_acknowledged,
        Err(problem) => report.problems.push(problem),
    }
    files::copy_tree(path, copy).map_err(io)?;
    let db = match open_database(site, copy, 64 << 20) {
        Ok(db) => db,
        Err(error) => {
            report.problems.push(error.to_string());
            return Ok(report);
        }
    };
    let mut problems = Vec::new();
    let salvage = salvage(&db, |key, value| {
        problems.extend(check_record(key, value));
        Ok(())
    })?;
    report.problems.extend(problems);
    report.problems.extend(problems_of(&salvage, report.num_acknowledged));
    report.num_commits = salvage.content.num_commits;
    report.num_records = salvage.content.num_pairs;
    Ok(report)
}

/// What is missing from what was read.
fn problems_of(salvage: &Salvage, num_acknowledged: u64) -> Vec<String> {
    let mut problems = salvage.lost.clone();
    let content = &salvage.content;
    if let Some(recorded) = &salvage.recorded
        && !salvage.is_whole()
    {
        problems.push(format!("{} of {} records can be read", content.num_pairs, recorded.num_pairs));
    }
    // What was read says how far it goes; a site that was written anew counts on from what was acknowledged.
    let num_read = salvage.recorded.as_ref().map_or(0, |recorded| recorded.num_commits);
    if num_read < num_acknowledged {
        let missing = num_acknowledged - num_read;
        problems.push(format!("the last {missing} of {num_acknowledged} acknowledged commits are not there"));
    }
    problems
}

/// Writes what can be read of a site into a new one and puts that in its place; the damaged one is kept beside.
///
/// # Errors
/// [`StorageError::Held`] while a server runs, [`StorageError::Corrupt`] when nothing can be read.
pub fn repair(directory: &Path, site: &str) -> Result<(SiteReport, PathBuf), StorageError> {
    let io = |error: std::io::Error| unavailable(&error);
    let held = DataDirectory::hold(directory)?;
    let path = existing(&held, site)?;
    let (copy, new) = (held.new_site_path(&format!("{site}.copy")), held.new_site_path(site));
    files::copy_tree(&path, &copy).map_err(io)?;
    let known = acknowledged(&path)?;
    let num_acknowledged = *known.as_ref().unwrap_or(&0);
    let salvage =
        readable_copy(&copy).map_err(io).and_then(|()| rewrite(site, &copy, &new, num_acknowledged));
    remove(&copy)?;
    let salvage = salvage?;
    let mut problems = problems_of(&salvage, num_acknowledged);
    problems.extend(known.err());
    let graveyard = directory.join("damaged");
    files::make_directories(&graveyard).map_err(io)?;
    let kept = (0..).map(|number| graveyard.join(format!("{site}-{number}"))).find(|path| !path.exists());
    let kept = kept.ok_or_else(|| unavailable(&"too many damaged sites are kept"))?;
    let num_bytes_before = num_bytes_of(&path).map_err(io)?;
    files::rename_directory(&path, &kept).and_then(|()| files::rename_directory(&new, &path)).map_err(io)?;
    let report = SiteReport {
        site: site.to_owned(),
        num_acknowledged,
        num_commits: salvage.recorded.map_or(0, |recorded| recorded.num_commits),
        num_records: salvage.content.num_pairs,
        num_bytes_before,
        num_bytes_after: num_bytes_of(&path).map_err(io)?,
        problems,
    };
    Ok((report, kept))
}

/// Helps sled over files that it can do without: the parameters are always the same, and without a snapshot it reads
/// the whole log.
fn readable_copy(copy: &Path) -> std::io::Result<()> {
    if sled_log::is_snapshot_damaged(copy) {
        for entry in fs::read_dir(copy)? {
            let entry = entry?;
            if entry.file_name().to_string_lossy().starts_with("snap.") {
                fs::remove_file(entry.path())?;
            }
        }
    }
    if sled_log::is_conf_damaged(copy) && copy.join("conf").exists() {
        // Without one, sled writes its own.
        fs::remove_file(copy.join("conf"))?;
    }
    fs::create_dir_all(copy.join("blobs"))
}

/// Writes a site anew without its garbage, when all of it can be read.
///
/// # Errors
/// [`StorageError::Held`] while a server runs, [`StorageError::Corrupt`] when the site is damaged; then it is as it was.
pub fn compact(directory: &Path, site: &str) -> Result<SiteReport, StorageError> {
    let held = DataDirectory::hold(directory)?;
    existing(&held, site)?;
    compact_site(&held, site)
}

/// The same for whoever holds the directory and has the site closed.
pub(super) fn compact_site(held: &DataDirectory, site: &str) -> Result<SiteReport, StorageError> {
    let io = |error: std::io::Error| unavailable(&error);
    let (path, new) = (held.site_path(site), held.new_site_path(site));
    let num_acknowledged = acknowledged(&path)?.map_err(|problem| damaged(site, &problem))?;
    sled_log::inspect(&path, Some(num_acknowledged)).map_err(|problem| damaged(site, &problem))?;
    let num_bytes_before = num_bytes_of(&path).map_err(io)?;
    let salvage = rewrite(site, &path, &new, num_acknowledged)?;
    if !salvage.is_whole() || salvage.content.num_commits < num_acknowledged {
        remove(&new)?;
        return Err(damaged(site, &problems_of(&salvage, num_acknowledged).join("; ")));
    }
    held.replace(site, &new).map_err(io)?;
    Ok(SiteReport {
        site: site.to_owned(),
        num_acknowledged,
        num_commits: salvage.content.num_commits,
        num_records: salvage.content.num_pairs,
        num_bytes_before,
        num_bytes_after: num_bytes_of(&path).map_err(io)?,
        problems: Vec::new(),
    })
}

/// The number of commits that the ledger says, or why it says none.
fn acknowledged(path: &Path) -> Result<Result<u64, String>, StorageError> {
    match Ledger::open(path) {
        Ok((_, num_commits)) => Ok(Ok(num_commits)),
        Err(LedgerError::Missing) => Ok(Ok(0)),
        Err(LedgerError::Damaged) => Ok(Err("the ledger cannot be read".into())),
        Err(LedgerError::Later { format }) => Ok(Err(format!("it is stored in the later format {format}"))),
        Err(LedgerError::Io(error)) => Err(unavailable(&error)),
    }
}

fn wanted(held: &DataDirectory, only: Option<&str>) -> Result<Vec<String>, StorageError> {
    match only {
        Some(site) => existing(held, site).map(|_| vec![site.to_owned()]),
        None => held.sites().map_err(|error| unavailable(&error)),
    }
}

fn existing(held: &DataDirectory, site: &str) -> Result<PathBuf, StorageError> {
    let sites = held.sites().map_err(|error| unavailable(&error))?;
    match sites.iter().any(|known| known == site) {
        true => Ok(held.site_path(site)),
        false => Err(unavailable(&format!("there is no site `{site}`"))),
    }
}

fn remove(path: &Path) -> Result<(), StorageError> {
    match path.exists() {
        true => fs::remove_dir_all(path).map_err(|error| unavailable(&error)),
        false => Ok(()),
    }
}
