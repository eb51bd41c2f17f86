//! One flush for many commits.
//!
//! ```text
//! commit A  apply ─ ticket 1 ─┐ leader: flush covers 1 ────────┐ done
//! commit B     apply ─ ticket 2 ─ waits ─┐ leader: covers 2, 3 ┴────────┐ done
//! commit C        apply ─ ticket 3 ─ waits ──────────────────────────── done
//! ```
//!
//! Whoever finds no flush under way becomes the leader and flushes everything applied so far; the others wait for the
//! flush that covers their ticket. Only sled's blocking `flush` is used: its `flush_async` deadlocks under
//! concurrent callers.

use std::sync::{Condvar, Mutex, PoisonError};

use super::StorageError;

#[derive(Default)]
pub(super) struct Flusher {
    progress: Mutex<Progress>,
    flush_ended: Condvar,
}

#[derive(Default)]
struct Progress {
    num_applied: u64,
    num_durable: u64,
    is_flushing: bool,
    failure: Option<StorageError>,
}

impl Flusher {
    /// The error of an earlier flush: after one, memory and disk differ and nothing more may be trusted.
    pub(super) fn failure(&self) -> Option<StorageError> {
        self.lock().failure.clone()
    }

    /// Says that a batch was applied; the ticket to wait for.
    pub(super) fn applied(&self) -> u64 {
        let mut progress = self.lock();
        progress.num_applied += 1;
        progress.num_applied
    }

    /// Blocks until a flush covered `ticket`, running `flush` itself when nobody else is.
    pub(super) fn wait_durable(
        &self,
        ticket: u64,
        flush: impl Fn() -> Result<(), StorageError>,
    ) -> Result<(), StorageError> {
        let mut progress = self.lock();
        loop {
            if let Some(failure) = &progress.failure {
                return Err(failure.clone());
            }
            if progress.num_durable >= ticket {
                return Ok(());
            }
            if progress.is_flushing {
                progress = self.flush_ended.wait(progress).unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            progress.is_flushing = true;
            let covered = progress.num_applied;
            drop(progress);
            let outcome = flush();
            progress = self.lock();
            progress.is_flushing = false;
            match outcome {
                Ok(()) => progress.num_durable = covered,
                Err(error) => progress.failure = Some(error),
            }
            self.flush_ended.notify_all();
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    use super::*;

    #[test]
    fn concurrent_commits_share_flushes() {
        let flusher = Flusher::default();
        let num_flushes = AtomicU64::new(0);
        std::thread::scope(|scope| {
            for _ in 0..32 {
                scope.spawn(|| {
                    let ticket = flusher.applied();
                    let flush = || {
                        std::thread::sleep(Duration::from_millis(20));
                        num_flushes.fetch_add(1, Ordering::Relaxed);
                        Ok(())
                    };
                    flusher.wait_durable(ticket, flush).unwrap();
                });
            }
        });
        let num_flushes = num_flushes.load(Ordering::Relaxed);
        assert!(num_flushes < 32, "32 commits took {num_flushes} flushes");
    }

    #[test]
    fn after_a_failed_flush_nothing_is_promised() {
        let flusher = Flusher::default();
        let ticket = flusher.applied();
        let broken = || Err(StorageError::Corrupt { what: "disk".into() });
        assert!(flusher.wait_durable(ticket, broken).is_err());
        let later = flusher.applied();
        assert!(flusher.wait_durable(later, || Ok(())).is_err());
        assert!(flusher.failure().is_some());
    }
}
