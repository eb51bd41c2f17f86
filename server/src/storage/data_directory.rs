//! The directory that holds all sites: one holder, whole sites only, strays left alone.
//!
//! ```text
//! DATA/LOCK                 held while a server runs; says who holds it
//! DATA/sites/NAME/          a site: whole, because it is made under another name and then renamed
//! DATA/sites/.new-NAME/     a site that is being made; what a crash leaves of it goes at the next start
//! DATA/sites/.deleted-N/    a site that is being deleted, likewise
//! DATA/sites/.old-NAME/     a site in whose place a compacted one is being put
//! ```

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use fs2::FileExt;

use super::ledger::LEDGER_FILE;
use super::{StorageError, files, unavailable};

const NEW_PREFIX: &str = ".new-";
const DELETED_PREFIX: &str = ".deleted-";
const OLD_PREFIX: &str = ".old-";
/// Names of which a directory has at least one when it is a site's.
const SITE_FILES: [&str; 4] = ["conf", "db", "blobs", LEDGER_FILE];

/// A data directory, held until released or dropped.
pub struct DataDirectory {
    path: PathBuf,
    // The lock goes when the file is closed, also when the process dies.
    lock: Mutex<Option<File>>,
    num_deleted: AtomicU64,
}

impl DataDirectory {
    /// Makes the directory when it is missing and takes hold of it.
    ///
    /// # Errors
    /// [`StorageError::Held`] with who holds it, [`StorageError::Unavailable`] when it cannot be written.
    pub fn hold(path: &Path) -> Result<Self, StorageError> {
        let refused = |error: io::Error| {
            let reason = format!("the data directory {} cannot be written: {error}", path.display());
            unavailable(&reason)
        };
        files::make_directories(&path.join("sites")).map_err(refused)?;
        let lock_path = path.join("LOCK");
        let mut lock = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&lock_path)
            .map_err(refused)?;
        if let Err(error) = lock.try_lock_exclusive() {
            if error.kind() != fs2::lock_contended_error().kind() {
                return Err(refused(error));
            }
            let mut holder = String::new();
            let _ = lock.read_to_string(&mut holder);
            let directory = path.display().to_string();
            return Err(StorageError::Held { directory, holder: holder.trim().to_owned() });
        }
        lock.set_len(0)
            .and_then(|()| lock.rewind())
            .and_then(|()| writeln!(lock, "{}", this_process()))
            .and_then(|()| lock.sync_all())
            .and_then(|()| files::sync_directory(path))
            .map_err(refused)?;
        let held =
            Self { path: path.to_owned(), lock: Mutex::new(Some(lock)), num_deleted: AtomicU64::new(0) };
        held.sweep().map_err(refused)?;
        Ok(held)
    }

    /// Lets go of it; it must not be used afterwards.
    pub fn release(&self) {
        let lock = self.lock.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(lock) = lock {
            // A process that is just being started holds a copy of the file until its program is loaded, and with it the lock.
            let _ = fs2::FileExt::unlock(&lock);
        }
    }

    /// Where a site lives.
    pub fn site_path(&self, site: &str) -> PathBuf {
        self.sites_path().join(site)
    }

    /// Where a site is made before it is given its name.
    pub fn new_site_path(&self, site: &str) -> PathBuf {
        self.sites_path().join(format!("{NEW_PREFIX}{site}"))
    }

    /// Where all sites live.
    pub fn sites_path(&self) -> PathBuf {
        self.path.join("sites")
    }

    /// Names of all sites in byte order.
    ///
    /// # Errors
    /// When the directory cannot be read.
    pub fn sites(&self) -> io::Result<Vec<String>> {
        let mut names = Vec::new();
        for entry in fs::read_dir(self.sites_path())? {
            let entry = entry?;
            if let Some(name) = site_name(&entry) {
                names.push(name);
            }
        }
        names.sort();
        Ok(names)
    }

    /// Makes a site vanish at once, then removes its files. Its name is free even while old handles hold the files.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn delete(&self, site: &str) -> io::Result<()> {
        let path = self.site_path(site);
        if !path.is_dir() {
            return Ok(());
        }
        let grave = self.grave();
        files::rename_directory(&path, &grave)?;
        fs::remove_dir_all(&grave)
    }

    /// Puts a whole directory in the place of a site. A crash in between leaves the site under another name, which the
    /// next start puts back.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn replace(&self, site: &str, new: &Path) -> io::Result<()> {
        let old = self.sites_path().join(format!("{OLD_PREFIX}{site}"));
        files::rename_directory(&self.site_path(site), &old)?;
        files::rename_directory(new, &self.site_path(site))?;
        fs::remove_dir_all(&old)
    }

    fn grave(&self) -> PathBuf {
        loop {
            let number = self.num_deleted.fetch_add(1, Ordering::Relaxed);
            let grave = self.sites_path().join(format!("{DELETED_PREFIX}{number}"));
            if !grave.exists() {
                return grave;
            }
        }
    }

    /// Removes what crashes left of sites that were being made or deleted, and tells of what is not ours.
    fn sweep(&self) -> io::Result<()> {
        for entry in fs::read_dir(self.sites_path())? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if let Some(site) = name.strip_prefix(OLD_PREFIX)
                && !self.site_path(site).exists()
            {
                tracing::info!(site, "the site was not replaced, putting it back");
                files::rename_directory(&entry.path(), &self.site_path(site))?;
                continue;
            }
            if name.starts_with(OLD_PREFIX)
                || name.starts_with(NEW_PREFIX)
                || name.starts_with(DELETED_PREFIX)
            {
                tracing::info!(name, "removing what was left of a site that was being made or deleted");
                fs::remove_dir_all(entry.path())?;
            } else if site_name(&entry).is_none() {
                tracing::warn!(path = %entry.path().display(), "not a site, left alone");
            }
        }
        files::sync_directory(&self.sites_path())
    }
}

/// The name of a site when an entry is one.
fn site_name(entry: &fs::DirEntry) -> Option<String> {
    let name = entry.file_name().into_string().ok().filter(|name| !name.starts_with('.'))?;
    SITE_FILES.iter().any(|file| entry.path().join(file).exists()).then_some(name)
}

/// Who holds the directory, for whoever is refused.
fn this_process() -> String {
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let since = httpdate::fmt_http_date(SystemTime::now());
    format!("process {} on {host} since {since}", std::process::id())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_holder_is_told_who_the_first_is() {
        let directory = tempfile::tempdir().unwrap();
        let held = DataDirectory::hold(directory.path()).unwrap();
        let Err(StorageError::Held { holder, .. }) = DataDirectory::hold(directory.path()) else {
            panic!("held twice")
        };
        assert!(holder.contains(&format!("process {} on ", std::process::id())), "{holder}");
        drop(held);
        assert!(DataDirectory::hold(directory.path()).is_ok());
    }

    #[test]
    fn strays_are_left_alone_and_leavings_are_removed() {
        let directory = tempfile::tempdir().unwrap();
        let sites = directory.path().join("sites");
        for name in ["lost+found", "site", ".new-x", ".deleted-0"] {
            fs::create_dir_all(sites.join(name)).unwrap();
        }
        fs::write(sites.join("notes.txt"), "mine").unwrap();
        fs::write(sites.join("site/db"), "").unwrap();
        let held = DataDirectory::hold(directory.path()).unwrap();
        assert_eq!(held.sites().unwrap(), ["site"]);
        assert!(sites.join("notes.txt").exists() && sites.join("lost+found").exists());
        assert!(!sites.join(".new-x").exists() && !sites.join(".deleted-0").exists());
    }
}
