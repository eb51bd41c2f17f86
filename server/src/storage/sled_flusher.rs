//! One sync for many commits.
//!
//! ```text
//! commit A  apply ─ ticket 1 ─┐ leader: sync covers 1 ─────────┐ done
//! commit B     apply ─ ticket 2 ─ waits ─┐ leader: covers 2, 3 ┴────────┐ done
//! commit C        apply ─ ticket 3 ─ waits ──────────────────────────── done
//! ```
//!
//! Whoever finds no sync under way becomes the leader and syncs everything applied so far; the others wait for the
//! sync that covers their ticket, which is the number of their commit. Only sled's blocking `flush` is used: its
//! `flush_async` deadlocks under concurrent callers.

use std::sync::{Condvar, Mutex, PoisonError};

use super::StorageError;

pub(super) struct Flusher {
    progress: Mutex<Progress>,
    sync_ended: Condvar,
}

/// How far applying and syncing have come; only its steps decide who syncs, who waits and who is told what.
#[derive(Clone, Default)]
struct Progress {
    num_applied: u64,
    num_durable: u64,
    is_syncing: bool,
    failure: Option<StorageError>,
}

/// What a commit that waits has to do next.
enum Step {
    /// It is on the disk, or never will be.
    Done(Result<(), StorageError>),
    /// Sync everything applied, at least up to this commit, and say how it went.
    Sync(u64),
    /// Wait until a sync ends.
    Wait,
}

impl Progress {
    fn next_step(&mut self, ticket: u64) -> Step {
        if let Some(failure) = &self.failure {
            return Step::Done(Err(failure.clone()));
        }
        if self.num_durable >= ticket {
            return Step::Done(Ok(()));
        }
        if self.is_syncing {
            return Step::Wait;
        }
        self.is_syncing = true;
        Step::Sync(self.num_applied)
    }

    fn sync_ended(&mut self, covered: u64, outcome: Result<(), StorageError>) {
        self.is_syncing = false;
        match outcome {
            Ok(()) => self.num_durable = covered,
            Err(error) => self.failure = Some(error),
        }
    }
}

impl Flusher {
    /// Begins after so many commits that are on the disk.
    pub(super) fn starting_after(num_commits: u64) -> Self {
        let progress = Progress { num_applied: num_commits, num_durable: num_commits, ..Progress::default() };
        Self { progress: Mutex::new(progress), sync_ended: Condvar::new() }
    }

    /// The error of an earlier sync: after one, memory and disk differ and nothing more may be trusted.
    pub(super) fn failure(&self) -> Option<StorageError> {
        self.lock().failure.clone()
    }

    /// Says that the commit of this number was applied, and all before it.
    pub(super) fn applied(&self, num_commits: u64) {
        self.lock().num_applied = num_commits;
    }

    /// Says that a batch was applied in part: nothing more may be trusted.
    pub(super) fn fail(&self, error: StorageError) {
        self.lock().failure.get_or_insert(error);
        self.sync_ended.notify_all();
    }

    /// Blocks until a sync covered `ticket`, running `sync` itself when nobody else is; it is told up to which commit
    /// everything was applied before.
    pub(super) fn wait_durable(
        &self,
        ticket: u64,
        sync: impl Fn(u64) -> Result<(), StorageError>,
    ) -> Result<(), StorageError> {
        let mut progress = self.lock();
        loop {
            match progress.next_step(ticket) {
                Step::Done(outcome) => return outcome,
                Step::Wait => {
                    progress = self.sync_ended.wait(progress).unwrap_or_else(PoisonError::into_inner);
                }
                Step::Sync(covered) => {
                    drop(progress);
                    let outcome = sync(covered);
                    progress = self.lock();
                    progress.sync_ended(covered, outcome);
                    self.sync_ended.notify_all();
                }
            }
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
    fn concurrent_commits_share_syncs() {
        let flusher = Flusher::starting_after(7);
        let (num_applied, num_syncs) = (Mutex::new(7), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for _ in 0..32 {
                scope.spawn(|| {
                    let ticket = {
                        let mut num_applied = num_applied.lock().unwrap();
                        *num_applied += 1;
                        flusher.applied(*num_applied);
                        *num_applied
                    };
                    let sync = |covered| {
                        assert!(covered >= 8);
                        std::thread::sleep(Duration::from_millis(20));
                        num_syncs.fetch_add(1, Ordering::Relaxed);
                        Ok(())
                    };
                    flusher.wait_durable(ticket, sync).unwrap();
                });
            }
        });
        let num_syncs = num_syncs.load(Ordering::Relaxed);
        assert!(num_syncs < 32, "32 commits took {num_syncs} syncs");
    }

    #[test]
    fn after_a_failed_sync_nothing_is_promised() {
        let flusher = Flusher::starting_after(0);
        flusher.applied(1);
        let broken = |_| Err(StorageError::Corrupt { what: "disk".into() });
        assert!(flusher.wait_durable(1, broken).is_err());
        flusher.applied(2);
        assert!(flusher.wait_durable(2, |_| Ok(())).is_err());
        assert!(flusher.failure().is_some());
    }

    /// Threads that each make some commits, one after the other, over the real [`Progress`]: every order in which their
    /// steps can follow each other is tried, with syncs that succeed and syncs that fail.
    mod every_order {
        use std::collections::HashSet;

        use super::super::*;

        const NUM_THREADS: usize = 3;
        const NUM_COMMITS_EACH: usize = 2;

        #[derive(Clone, Copy, PartialEq, Eq, Hash)]
        enum Doing {
            Apply,
            Ask(u64),
            Wait(u64),
            Sync(u64, u64),
            Tell(u64, u64, bool),
        }

        #[derive(Clone)]
        struct World {
            progress: Progress,
            num_on_disk: u64,
            doing: [Doing; NUM_THREADS],
            num_left: [usize; NUM_THREADS],
        }

        type Seen = (u64, u64, bool, bool, u64, [Doing; NUM_THREADS], [usize; NUM_THREADS]);

        impl World {
            fn new() -> Self {
                Self {
                    progress: Progress::default(),
                    num_on_disk: 0,
                    doing: [Doing::Apply; NUM_THREADS],
                    num_left: [NUM_COMMITS_EACH; NUM_THREADS],
                }
            }

            fn key(&self) -> Seen {
                let progress = &self.progress;
                let numbers = (progress.num_applied, progress.num_durable);
                let flags = (progress.is_syncing, progress.failure.is_some());
                (numbers.0, numbers.1, flags.0, flags.1, self.num_on_disk, self.doing, self.num_left)
            }

            /// The worlds after one step of a thread; none when it cannot move.
            fn after(&self, thread: usize, claim: fn(u64, u64) -> u64) -> Result<Vec<World>, String> {
                let mut next = self.clone();
                match self.doing[thread] {
                    Doing::Apply if self.num_left[thread] == 0 => return Ok(vec![]),
                    Doing::Apply => {
                        next.progress.num_applied += 1;
                        next.num_left[thread] -= 1;
                        next.doing[thread] = Doing::Ask(next.progress.num_applied);
                    }
                    Doing::Wait(_) => return Ok(vec![]),
                    Doing::Ask(ticket) => {
                        next.doing[thread] = match next.progress.next_step(ticket) {
                            Step::Done(Ok(())) if self.num_on_disk < ticket => {
                                return Err(format!("commit {ticket} was told too early"));
                            }
                            Step::Done(_) => Doing::Apply,
                            Step::Wait => Doing::Wait(ticket),
                            Step::Sync(covered) => Doing::Sync(ticket, covered),
                        }
                    }
                    Doing::Sync(ticket, covered) => {
                        let mut failed = self.clone();
                        failed.doing[thread] = Doing::Tell(ticket, covered, false);
                        next.num_on_disk = self.progress.num_applied;
                        next.doing[thread] = Doing::Tell(ticket, covered, true);
                        return Ok(vec![next, failed]);
                    }
                    Doing::Tell(ticket, covered, is_ok) => {
                        let covered = claim(covered, self.progress.num_applied);
                        let error = StorageError::Corrupt { what: "disk".into() };
                        next.progress.sync_ended(covered, if is_ok { Ok(()) } else { Err(error) });
                        for doing in &mut next.doing {
                            if let Doing::Wait(ticket) = *doing {
                                *doing = Doing::Ask(ticket);
                            }
                        }
                        next.doing[thread] = Doing::Ask(ticket);
                    }
                }
                Ok(vec![next])
            }
        }

        /// Tries every order; the number of different worlds that were seen.
        fn try_all(claim: fn(u64, u64) -> u64) -> Result<usize, String> {
            let mut seen = HashSet::new();
            let mut open = vec![World::new()];
            while let Some(world) = open.pop() {
                if !seen.insert(world.key()) {
                    continue;
                }
                let mut can_move = false;
                for thread in 0..NUM_THREADS {
                    let next = world.after(thread, claim)?;
                    can_move |= !next.is_empty();
                    open.extend(next);
                }
                let is_over = world.doing.iter().all(|doing| *doing == Doing::Apply);
                if !can_move && !is_over {
                    return Err("everybody waits".into());
                }
            }
            Ok(seen.len())
        }

        #[test]
        fn nobody_is_told_too_early_and_nobody_waits_for_ever() {
            let num_worlds = try_all(|covered, _| covered).unwrap();
            assert!(num_worlds > 1_000, "{num_worlds}");
        }

        #[test]
        fn a_sync_that_claims_what_was_applied_meanwhile_would_be_seen() {
            assert!(try_all(|_, applied_meanwhile| applied_meanwhile).is_err());
        }
    }
}
