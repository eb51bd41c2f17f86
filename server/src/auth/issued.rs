//! Issued keys on disk: one small file, replaced as a whole, with hashes only.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::app::AppError;
use crate::config::ApiKeyConfig;

/// The layout of the file.
const LAYOUT: u32 = 1;

/// A key with what is known of its life.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IssuedKey {
    /// What it may do.
    pub key: ApiKeyConfig,
    /// When it was issued, seconds since 1970.
    pub created_at_s: u64,
    /// The secret before the last rotation.
    pub previous: Option<PreviousSecret>,
}

/// A secret that opens for a while longer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PreviousSecret {
    /// Its hash, as that of the key.
    pub sha256: String,
    /// Until when it opens, seconds since 1970.
    pub until_s: u64,
}

#[derive(Serialize, Deserialize)]
struct Content {
    layout: u32,
    keys: Vec<IssuedKey>,
}

/// Where issued keys are kept.
pub(super) struct KeyFile {
    path: PathBuf,
}

impl KeyFile {
    pub(super) fn in_directory(data_directory: &Path) -> Self {
        Self { path: data_directory.join("keys.json") }
    }

    /// What was written last; nothing when there is no file. A file that cannot be read is an error: without it keys that
    /// somebody relies on would be forgotten, and an open server would take itself for one without keys.
    pub(super) fn read(&self) -> Result<Vec<IssuedKey>, AppError> {
        let text = match std::fs::read_to_string(&self.path) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(self.failed(&error)),
        };
        let content: Content = serde_json::from_str(&text).map_err(|error| self.failed(&error))?;
        if content.layout != LAYOUT {
            return Err(
                self.failed(&format!("its layout is {}, this version reads {LAYOUT}", content.layout))
            );
        }
        Ok(content.keys)
    }

    /// Replaces the file; when this returns it is on disk, and a power cut at any moment leaves the old or the new one.
    pub(super) fn write(&self, keys: &[IssuedKey]) -> Result<(), AppError> {
        let content = Content { layout: LAYOUT, keys: keys.to_vec() };
        let bytes = serde_json::to_vec_pretty(&content).map_err(AppError::internal)?;
        self.replace(&bytes).map_err(|error| self.failed(&error))
    }

    fn replace(&self, bytes: &[u8]) -> std::io::Result<()> {
        let draft = self.path.with_extension("json.new");
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(true);
        // Hashes open nothing, but names and sites are nobody else's business.
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = options.open(&draft)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        std::fs::rename(&draft, &self.path)?;
        match self.path.parent() {
            Some(directory) => File::open(directory)?.sync_all(),
            None => Ok(()),
        }
    }

    fn failed(&self, error: &dyn std::fmt::Display) -> AppError {
        AppError::internal(format!("the keys in {}: {error}", self.path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_read_is_no_empty_file() {
        let directory = tempfile::tempdir().unwrap();
        let file = KeyFile::in_directory(directory.path());
        assert!(file.read().unwrap().is_empty());
        let key = IssuedKey { key: ApiKeyConfig::default(), created_at_s: 1, previous: None };
        file.write(std::slice::from_ref(&key)).unwrap();
        assert_eq!(file.read().unwrap(), [key]);
        for damaged in ["", "{", r#"{"layout":2,"keys":[]}"#] {
            std::fs::write(directory.path().join("keys.json"), damaged).unwrap();
            assert!(file.read().is_err(), "{damaged}");
        }
    }
}
