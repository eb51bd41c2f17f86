//! Registrations that builds of a site have finished, so that the next build computes only what is new.
//!
//! They are kept in memory. When the server stops in the middle of a build they are stored, and taken up by the build that
//! begins anew after the next start: so it goes on from where it was.

use std::sync::{Mutex, PoisonError};

use locution_engine::mapping::RegistrationMemo;

use crate::app::{AppError, on_blocking_thread};
use crate::records::{Key, delete_prefixes, join_pieces, pieces};
use crate::storage::{Batch, SiteStore};

/// Beyond this they are forgotten, so that memory stays bounded.
const NUM_REMEMBERED_MAX: usize = 500_000;
/// More than this are not stored: computing them again costs less than holding up the end of the server.
const NUM_STORED_MAX: usize = 100_000;
/// Pieces of half a mebibyte in one commit.
const NUM_PIECES_PER_COMMIT: usize = 8;

/// What the builds of a site have registered; nothing while a build has it, and before it was looked for in storage.
#[derive(Default)]
pub struct Registrations(Mutex<Option<RegistrationMemo>>);

impl Registrations {
    /// Hands out what is remembered, to be given back.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn take(&self, store: &dyn SiteStore) -> Result<RegistrationMemo, AppError> {
        if let Some(memo) = self.memo().take() {
            return Ok(memo);
        }
        let stored = store.scan(&Key::all_registrations(), &[], usize::MAX).await?;
        if stored.is_empty() {
            return Ok(RegistrationMemo::default());
        }
        let bytes = join_pieces(stored.iter().map(|(_, piece)| piece), "stored registrations")?;
        // They were stored for this one build.
        delete_prefixes(store, &[Key::all_registrations()]).await?;
        on_blocking_thread(move || postcard::from_bytes(&bytes).unwrap_or_else(forgotten)).await
    }

    /// Takes back what was handed out.
    pub fn give_back(&self, memo: RegistrationMemo) {
        let memo = if memo.len() <= NUM_REMEMBERED_MAX { memo } else { RegistrationMemo::default() };
        *self.memo() = Some(memo);
    }

    /// Stores what is remembered for the time after the next start.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn store(&self, store: &dyn SiteStore) -> Result<(), AppError> {
        let Some(memo) = self.memo().take().filter(|memo| !memo.is_empty() && memo.len() <= NUM_STORED_MAX)
        else {
            return Ok(());
        };
        let bytes =
            on_blocking_thread(move || postcard::to_allocvec(&memo)).await?.map_err(AppError::internal)?;
        let pieces: Vec<_> = (0..).zip(pieces(&bytes)).collect();
        for some in pieces.chunks(NUM_PIECES_PER_COMMIT) {
            let mut batch = Batch::default();
            some.iter()
                .for_each(|(part, piece)| batch.put(Key::Registrations(*part).encode(), piece.clone()));
            store.commit(batch, vec![]).await?;
        }
        Ok(())
    }

    fn memo(&self) -> std::sync::MutexGuard<'_, Option<RegistrationMemo>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Those of another version of the program cannot be read, and need not be.
fn forgotten(error: postcard::Error) -> RegistrationMemo {
    tracing::info!(%error, "stored registrations cannot be read and are computed again");
    RegistrationMemo::default()
}
