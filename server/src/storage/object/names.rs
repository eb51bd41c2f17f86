//! Which sites exist: one small object for each, whose content says which incarnation stands.

use std::collections::BTreeSet;
use std::sync::Arc;

use futures::TryStreamExt;
use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt, PutMode, PutOptions};
use rand::TryRng;
use rand::rngs::SysRng;

use super::super::{StorageError, unavailable};

/// The names of all sites under a prefix.
pub(super) struct Names {
    store: Arc<dyn ObjectStore>,
    directory: Path,
}

impl Names {
    pub(super) fn new(store: Arc<dyn ObjectStore>, prefix: &Path) -> Self {
        Self { store, directory: prefix.clone().join("names") }
    }

    fn path(&self, site: &str) -> Path {
        self.directory.clone().join(site)
    }

    /// The incarnation of a site that exists.
    pub(super) async fn find(&self, site: &str) -> Result<Option<String>, StorageError> {
        let found = match self.store.get(&self.path(site)).await {
            Ok(found) => found.bytes().await,
            Err(error) => Err(error),
        };
        match found {
            Ok(bytes) => match String::from_utf8(bytes.to_vec()) {
                Ok(incarnation) if is_incarnation(&incarnation) => Ok(Some(incarnation)),
                _ => Err(StorageError::Corrupt { what: format!("the name of the site `{site}`") }),
            },
            Err(Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(unavailable(&error)),
        }
    }

    /// The incarnation of a site, which is made when it does not exist; of several makers one wins for all.
    pub(super) async fn find_or_make(&self, site: &str) -> Result<String, StorageError> {
        if let Some(incarnation) = self.find(site).await? {
            return Ok(incarnation);
        }
        let incarnation = new_incarnation()?;
        let if_absent = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
        match self.store.put_opts(&self.path(site), incarnation.clone().into(), if_absent).await {
            Ok(_) => Ok(incarnation),
            // Somebody else was first, or this very write was sent twice: what stands counts.
            Err(Error::AlreadyExists { .. } | Error::Precondition { .. }) => {
                self.find(site).await?.ok_or(StorageError::Conflict)
            }
            Err(error) => Err(unavailable(&error)),
        }
    }

    /// All names in byte order.
    pub(super) async fn list(&self) -> Result<BTreeSet<String>, StorageError> {
        let names = self.store.list(Some(&self.directory));
        let names = names.try_filter_map(async |object| Ok(object.location.filename().map(str::to_owned)));
        names.try_collect().await.map_err(|error| unavailable(&error))
    }

    /// Forgets a name; what lies in its database is nobody's from then on.
    pub(super) async fn remove(&self, site: &str) -> Result<(), StorageError> {
        match self.store.delete(&self.path(site)).await {
            Ok(()) | Err(Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(unavailable(&error)),
        }
    }
}

fn new_incarnation() -> Result<String, StorageError> {
    let mut bytes = [0; 16];
    SysRng.try_fill_bytes(&mut bytes).map_err(|error| unavailable(&error))?;
    Ok(format!("{:032x}", u128::from_be_bytes(bytes)))
}

fn is_incarnation(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}
