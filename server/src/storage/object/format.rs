//! What a prefix of a store holds, and whether the store keeps what everything else rests on.
//!
//! Two servers can only tell who owns a site when a write with a precondition is refused once the precondition has
//! failed. A store that takes such writes all the same would let one server write over the other without a word, so it
//! is tried before anything is stored.

use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt, PutMode, PutOptions, UpdateVersion};

use super::super::{StorageError, unavailable};

/// The layout of this version.
const FORMAT: &str = "LOCUTION OBJECT STORE 1\n";

/// Marks an empty prefix, or checks the mark, and tries both kinds of preconditions on it.
pub(super) async fn check(store: &dyn ObjectStore, prefix: &Path) -> Result<(), StorageError> {
    let path = prefix.clone().join("format");
    let create = || PutOptions { mode: PutMode::Create, ..PutOptions::default() };
    match store.put_opts(&path, FORMAT.into(), create()).await {
        Ok(_) | Err(Error::AlreadyExists { .. } | Error::Precondition { .. }) => {}
        Err(error) => return Err(unreachable(&error)),
    }
    let found = store.get(&path).await.map_err(|error| unreachable(&error))?;
    let found = found.bytes().await.map_err(|error| unreachable(&error))?;
    if found != FORMAT.as_bytes() {
        let found = String::from_utf8_lossy(&found[..found.len().min(FORMAT.len())]).into_owned();
        return Err(StorageError::Corrupt {
            what: format!("{path} says {found:?}, this version reads {FORMAT:?}"),
        });
    }
    match store.put_opts(&path, FORMAT.into(), create()).await {
        Err(Error::AlreadyExists { .. } | Error::Precondition { .. }) => {}
        Err(error) => return Err(unreachable(&error)),
        Ok(_) => return Err(careless("If-None-Match")),
    }
    let stale = UpdateVersion { e_tag: Some(format!("\"{:032x}\"", 0)), version: None };
    let update = PutOptions { mode: PutMode::Update(stale), ..PutOptions::default() };
    match store.put_opts(&path, FORMAT.into(), update).await {
        Err(Error::Precondition { .. } | Error::NotFound { .. }) => Ok(()),
        Err(error) => Err(unreachable(&error)),
        Ok(_) => Err(careless("If-Match")),
    }
}

fn unreachable(error: &Error) -> StorageError {
    let hint = if std::env::var_os("AWS_ACCESS_KEY_ID").is_some() {
        "check AWS_ENDPOINT_URL, AWS_REGION, the bucket and what the credentials may do"
    } else {
        "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY are not set, and nothing on this machine hands out credentials"
    };
    unavailable(&format!("the object store cannot be used: {error}; {hint}"))
}

fn careless(header: &str) -> StorageError {
    unavailable(&format!(
        "the object store does not keep `{header}`, so two servers would write over each other; use one that does"
    ))
}
