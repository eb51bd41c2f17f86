//! Files, lengths and names that survive a power cut.
//!
//! A file system keeps three things apart: the bytes of a file, its length and place on the disk, and the name in its
//! directory. Each is on the disk only after it was asked for: the first two by syncing the file, the third by syncing
//! the directory.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Puts the names in a directory on the disk.
pub(super) fn sync_directory(path: &Path) -> io::Result<()> {
    // Directories cannot be opened as files on Windows, where names are on the disk with the file.
    if cfg!(windows) {
        return Ok(());
    }
    File::open(path)?.sync_all()
}

/// Puts everything in and below a directory on the disk, and its own name in the directory above.
pub(super) fn sync_tree(path: &Path) -> io::Result<()> {
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        match entry.file_type()? {
            kind if kind.is_dir() => sync_tree(&entry.path())?,
            kind if kind.is_file() => File::open(entry.path())?.sync_all()?,
            _ => {}
        }
    }
    sync_directory(path)?;
    path.parent().map_or(Ok(()), sync_directory)
}

/// Makes a directory and those above it, each with its name on the disk.
pub(super) fn make_directories(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        make_directories(parent)?;
    }
    match fs::create_dir(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    sync_directory(parent.unwrap_or(Path::new(".")))
}

/// Gives a directory another name on the same file system; on the disk when this returns.
pub(super) fn rename_directory(from: &Path, to: &Path) -> io::Result<()> {
    fs::rename(from, to)?;
    to.parent().map_or(Ok(()), sync_directory)
}

/// Copies a directory with everything in and below it.
pub(super) fn copy_tree(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy_tree(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

/// Bytes that may still be written to the file system of a path, and those it has in all.
pub(super) fn space(path: &Path) -> io::Result<Space> {
    let found = rustix::fs::statvfs(path)?;
    Ok(Space { free_bytes: found.f_bavail * found.f_frsize, total_bytes: found.f_blocks * found.f_frsize })
}

/// Room on a file system.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    pub free_bytes: u64,
    pub total_bytes: u64,
}
