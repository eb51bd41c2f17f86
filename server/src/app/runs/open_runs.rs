//! Bounds how many translators are in memory: the run longest idle makes way.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::app::site::RunWriter;

/// The runs whose translators are in memory.
pub struct OpenRuns {
    num_max: usize,
    clock: AtomicU64,
    runs: Mutex<Vec<Weak<RunWriter>>>,
}

impl OpenRuns {
    pub fn new(num_max: usize) -> Self {
        Self { num_max, clock: AtomicU64::new(0), runs: Mutex::default() }
    }

    /// Notes the use of a run, and puts others to sleep while there are too many.
    pub(super) fn used(&self, writer: &Arc<RunWriter>) {
        writer.touch(self.clock.fetch_add(1, Ordering::Relaxed));
        let mut runs = self.runs.lock().unwrap_or_else(PoisonError::into_inner);
        if !runs.iter().any(|run| std::ptr::eq(run.as_ptr(), Arc::as_ptr(writer))) {
            runs.push(Arc::downgrade(writer));
        }
        runs.retain(|run| run.strong_count() > 0);
        if runs.len() > self.num_max {
            runs.sort_by_key(|run| run.upgrade().map_or(0, |run| run.last_use.load(Ordering::Relaxed)));
            let mut surplus = runs.len() - self.num_max;
            // A run in use cannot sleep; it stays, and is asked again at the next use of any run.
            runs.retain(|run| {
                let sleeps = surplus > 0 && run.upgrade().is_none_or(|run| run.put_to_sleep());
                surplus -= usize::from(sleeps);
                !sleeps
            });
        }
        metrics::gauge!("locution_open_runs").set(runs.len() as f64);
    }
}
