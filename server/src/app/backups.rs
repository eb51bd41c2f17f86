//! Backups: a site as a stream while it serves, and a site made of such a stream.

use std::sync::Arc;

use bytes::Bytes;
use futures::{Stream, StreamExt};

use super::site::Site;
use super::sites::new_birth;
use super::{App, AppError, Name};
use crate::records::SiteRecord;
use crate::storage::StorageError;
use crate::storage::backup::{Restore, RestoreError, export};

/// The site as of now; what is written meanwhile does not show in it.
///
/// # Errors
/// Those of the storage.
pub async fn backup(
    site: &Site,
) -> Result<impl Stream<Item = Result<Bytes, StorageError>> + Send + use<>, AppError> {
    Ok(export(site.store().snapshot().await?, site.name().as_str()))
}

impl App {
    /// Makes a site of a backup. It is another site than the one that the backup was made of, with a birth of its own.
    ///
    /// # Errors
    /// [`AppError::Exists`] when there is a site of the name, [`AppError::Invalid`] when the stream is not a whole
    /// backup; then there is no site.
    pub async fn restore_site<E: std::fmt::Display>(
        self: &Arc<Self>,
        name: &Name,
        backup: impl Stream<Item = Result<Bytes, E>> + Send,
    ) -> Result<Arc<Site>, AppError> {
        self.check_here(name)?;
        let _queue = self.making_sites.lock().await;
        if self.storage.contains(name.as_str()).await? {
            return Err(AppError::Exists { detail: format!("the site `{name}` stands") });
        }
        if let Err(error) = self.fill(name, backup).await {
            self.storage.delete(name.as_str()).await?;
            return Err(error);
        }
        self.site(name).await
    }

    async fn fill<E: std::fmt::Display>(
        &self,
        name: &Name,
        backup: impl Stream<Item = Result<Bytes, E>> + Send,
    ) -> Result<(), AppError> {
        let mut backup = std::pin::pin!(backup);
        let mut restore = Restore::into_site(self.storage.open(name.as_str()).await?);
        while let Some(piece) = backup.next().await {
            let piece = piece.map_err(|error| AppError::invalid("body", error.to_string()))?;
            restore.push(&piece).await.map_err(refused)?;
        }
        let birth = new_birth()?;
        let adopt = |record: &[u8]| {
            let mut record = SiteRecord::decode(record, birth)?;
            record.birth = birth;
            Ok(record.encode())
        };
        restore.finish(adopt).await.map_err(refused)
    }
}

fn refused(error: RestoreError) -> AppError {
    match error {
        RestoreError::Storage(error) => error.into(),
        RestoreError::Malformed(_) => AppError::invalid("body", error.to_string()),
    }
}
