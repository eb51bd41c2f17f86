//! Turns at the few places where jobs run: whoever waited longest comes next, and whoever has had a place for a while
//! gives it up when others wait.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::{Semaphore, SemaphorePermit};

use crate::app::AppError;

/// Whoever had to give way is given this many times as long when its turn comes again: what it could not keep it then
/// has the time to do.
const GROWTH: u32 = 2;

/// The places of a process.
pub struct Turns {
    places: Semaphore,
    num_waiting: AtomicUsize,
    turn: Duration,
}

/// A place that somebody has.
pub struct Turn<'a> {
    turns: &'a Turns,
    began: Instant,
    length: Duration,
    _place: SemaphorePermit<'a>,
}

/// Counts somebody as waiting until dropped.
struct Waiting<'a>(&'a AtomicUsize);

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Turns {
    /// So many places; a turn lasts so long when others wait.
    pub fn new(num_places: usize, turn: Duration) -> Self {
        Self { places: Semaphore::new(num_places), num_waiting: AtomicUsize::new(0), turn }
    }

    /// Waits for a place, in the order of asking; `num_given_up` says how often the asker gave one up already.
    ///
    /// # Errors
    /// [`AppError::Internal`], which cannot be: places are never closed.
    pub async fn take(&self, num_given_up: u32) -> Result<Turn<'_>, AppError> {
        self.num_waiting.fetch_add(1, Ordering::Relaxed);
        let waiting = Waiting(&self.num_waiting);
        let place = self.places.acquire().await.map_err(AppError::internal)?;
        drop(waiting);
        let length = self.turn * GROWTH.saturating_pow(num_given_up.min(10));
        Ok(Turn { turns: self, began: Instant::now(), length, _place: place })
    }
}

impl Turn<'_> {
    /// Returns once the turn has lasted its time and somebody waits.
    pub async fn is_over(&self) {
        const LOOK_EVERY: Duration = Duration::from_millis(100);
        tokio::time::sleep_until((self.began + self.length).into()).await;
        while self.turns.num_waiting.load(Ordering::Relaxed) == 0 {
            tokio::time::sleep(LOOK_EVERY).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    /// Works for so many milliseconds in turns, as jobs do that keep what they did.
    async fn work(turns: Arc<Turns>, name: usize, work_ms: u64, ended: Arc<Mutex<Vec<usize>>>) {
        let mut left = Duration::from_millis(work_ms);
        for num_given_up in 0.. {
            let turn = turns.take(num_given_up).await.unwrap();
            let began = Instant::now();
            tokio::select! {
                () = tokio::time::sleep(left) => break,
                () = turn.is_over() => left = left.saturating_sub(began.elapsed()),
            }
        }
        ended.lock().unwrap().push(name);
    }

    #[tokio::test]
    async fn a_long_job_lets_short_ones_pass_and_ends_itself() {
        let turns = Arc::new(Turns::new(1, Duration::from_millis(20)));
        let ended = Arc::new(Mutex::new(Vec::new()));
        let long = tokio::spawn(work(Arc::clone(&turns), 0, 1_500, Arc::clone(&ended)));
        tokio::time::sleep(Duration::from_millis(5)).await;
        let short: Vec<_> =
            (1..4).map(|name| tokio::spawn(work(Arc::clone(&turns), name, 1, Arc::clone(&ended)))).collect();
        for job in short {
            job.await.unwrap();
        }
        long.await.unwrap();
        assert_eq!(*ended.lock().unwrap(), [1, 2, 3, 0]);
    }

    #[tokio::test]
    async fn nobody_gives_way_while_nobody_waits() {
        let turns = Turns::new(1, Duration::ZERO);
        let turn = turns.take(0).await.unwrap();
        let over = tokio::time::timeout(Duration::from_millis(250), turn.is_over()).await;
        assert!(over.is_err());
    }
}
