//! What builds of a site leave to the next, so that it computes only what is new: registrations, and what is settled.
//!
//! It is kept in memory. When the server stops in the middle of a build it is stored, and taken up by the build that
//! begins anew after the next start: so it goes on from where it was.

use std::sync::{Mutex, PoisonError};

use locution_engine::mapping::{Foundation, RegistrationMemo};
use serde::{Deserialize, Serialize};

use crate::app::{AppError, on_blocking_thread};
use crate::records::{Digest, Key, delete_prefixes, join_pieces, pieces};
use crate::storage::{Batch, SiteStore};

/// Registrations beyond this are forgotten, so that memory stays bounded.
const NUM_REMEMBERED_MAX: usize = 500_000;
/// More registrations than this are not stored: computing them again costs less than holding up the end of the server.
const NUM_STORED_MAX: usize = 100_000;
/// Pieces of half a mebibyte in one commit.
const NUM_PIECES_PER_COMMIT: usize = 8;

/// What the builds of a site leave to the next.
#[derive(Default, Serialize, Deserialize)]
pub struct BuildMemory {
    pub registrations: RegistrationMemo,
    /// What the first runs of the site amount to, each with the digest of what it was made from, the latest last.
    pub foundations: Vec<(Digest, Foundation)>,
}

/// What the builds of a site remember; nothing while a build has it, and before it was looked for in storage.
#[derive(Default)]
pub struct Remembered(Mutex<Option<BuildMemory>>);

impl Remembered {
    /// Hands out what is remembered, to be given back.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn take(&self, store: &dyn SiteStore) -> Result<BuildMemory, AppError> {
        if let Some(memory) = self.memory().take() {
            return Ok(memory);
        }
        let stored = store.scan(&Key::all_registrations(), &[], usize::MAX).await?;
        if stored.is_empty() {
            return Ok(BuildMemory::default());
        }
        let bytes = join_pieces(stored.iter().map(|(_, piece)| piece), "stored registrations")?;
        // They were stored for this one build.
        delete_prefixes(store, &[Key::all_registrations()]).await?;
        on_blocking_thread(move || postcard::from_bytes(&bytes).unwrap_or_else(forgotten)).await
    }

    /// Takes back what was handed out.
    pub fn give_back(&self, mut memory: BuildMemory) {
        if memory.registrations.len() > NUM_REMEMBERED_MAX {
            memory.registrations = RegistrationMemo::default();
        }
        *self.memory() = Some(memory);
    }

    /// Stores what is remembered for the time after the next start.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn store(&self, store: &dyn SiteStore) -> Result<(), AppError> {
        let Some(mut memory) = self.memory().take() else { return Ok(()) };
        if memory.registrations.len() > NUM_STORED_MAX {
            memory.registrations = RegistrationMemo::default();
        }
        if memory.registrations.is_empty() && memory.foundations.is_empty() {
            return Ok(());
        }
        let bytes =
            on_blocking_thread(move || postcard::to_allocvec(&memory)).await?.map_err(AppError::internal)?;
        let pieces: Vec<_> = (0..).zip(pieces(&bytes)).collect();
        for some in pieces.chunks(NUM_PIECES_PER_COMMIT) {
            let mut batch = Batch::default();
            some.iter()
                .for_each(|(part, piece)| batch.put(Key::Registrations(*part).encode(), piece.clone()));
            store.commit(batch, vec![]).await?;
        }
        Ok(())
    }

    fn memory(&self) -> std::sync::MutexGuard<'_, Option<BuildMemory>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Those of another version of the program cannot be read, and need not be.
fn forgotten(error: postcard::Error) -> BuildMemory {
    tracing::info!(%error, "what builds remembered cannot be read and is computed again");
    BuildMemory::default()
}
