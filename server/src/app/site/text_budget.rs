//! Bounds what the indexes of all sites' texts take together: those that nobody asked for longest make way, and are read
//! again when somebody asks.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::texts::SiteTexts;

/// The texts of all open sites.
pub struct TextBudget {
    num_bytes_max: usize,
    clock: AtomicU64,
    texts: Mutex<Vec<Weak<SiteTexts>>>,
}

impl TextBudget {
    pub fn new(num_bytes_max: usize) -> Self {
        Self { num_bytes_max, clock: AtomicU64::new(0), texts: Mutex::default() }
    }

    /// Notes that texts were asked for, and lets others go while all take too much. Those just asked for stay, whatever
    /// they take.
    pub(super) fn used(&self, texts: &Arc<SiteTexts>) {
        texts.last_use.store(self.clock.fetch_add(1, Ordering::Relaxed) + 1, Ordering::Relaxed);
        let mut known = self.texts.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|other| other.strong_count() > 0);
        if !known.iter().any(|other| std::ptr::eq(other.as_ptr(), Arc::as_ptr(texts))) {
            known.push(Arc::downgrade(texts));
        }
        let mut others: Vec<Arc<SiteTexts>> = known.iter().filter_map(Weak::upgrade).collect();
        drop(known);
        others.sort_by_key(|other| other.last_use.load(Ordering::Relaxed));
        let mut num_bytes: usize = others.iter().map(|other| other.num_index_bytes()).sum();
        for other in others.iter().filter(|other| !Arc::ptr_eq(other, texts)) {
            if num_bytes <= self.num_bytes_max {
                break;
            }
            num_bytes -= other.let_go();
        }
    }
}
