//! A bounded number of places, of which no key may hold them all.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;

/// Places such as slots of a queue or bytes of memory.
#[derive(Debug)]
pub(super) struct Pool {
    num_places: usize,
    used: Mutex<Used>,
    freed: Notify,
}

#[derive(Debug, Default)]
struct Used {
    sum: usize,
    by_key: HashMap<Arc<str>, usize>,
}

/// Who takes places.
#[derive(Clone, Debug)]
pub(super) struct Holder {
    pub(super) key: Arc<str>,
    /// Share of all places that the key may hold.
    pub(super) share_max: f64,
}

/// Places held; they are free again when it is dropped.
#[derive(Debug)]
pub(super) struct Share {
    pool: Arc<Pool>,
    holder: Holder,
    num: usize,
}

impl Pool {
    /// So many places.
    pub(super) fn new(num_places: usize) -> Arc<Self> {
        Arc::new(Self { num_places, used: Mutex::default(), freed: Notify::new() })
    }

    /// Most places that somebody may hold.
    pub(super) fn num_max(&self, holder: &Holder) -> usize {
        ((self.num_places as f64 * holder.share_max).ceil() as usize).clamp(1, self.num_places)
    }

    /// Places for a key; none when there are too few, or when the key has its share.
    pub(super) fn try_take(self: &Arc<Self>, holder: &Holder, num: usize) -> Option<Share> {
        let mut share = Share { pool: Arc::clone(self), holder: holder.clone(), num: 0 };
        share.try_grow(num).then_some(share)
    }

    /// The same, but waits for places to become free.
    pub(super) async fn take(
        self: &Arc<Self>,
        holder: &Holder,
        num: usize,
        patience: Duration,
    ) -> Option<Share> {
        let taking = async {
            loop {
                let mut freed = std::pin::pin!(self.freed.notified());
                freed.as_mut().enable();
                match self.try_take(holder, num) {
                    Some(share) => return share,
                    None => freed.await,
                }
            }
        };
        tokio::time::timeout(patience, taking).await.ok()
    }

    /// Places held now.
    pub(super) fn num_used(&self) -> usize {
        self.used().sum
    }

    fn used(&self) -> MutexGuard<'_, Used> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Share {
    /// Takes more places; false and unchanged when there are too few.
    pub(super) fn try_grow(&mut self, num: usize) -> bool {
        let mut used = self.pool.used();
        let of_key = used.by_key.get(&self.holder.key).copied().unwrap_or(0);
        if used.sum + num > self.pool.num_places || of_key + num > self.pool.num_max(&self.holder) {
            return false;
        }
        used.sum += num;
        *used.by_key.entry(Arc::clone(&self.holder.key)).or_default() += num;
        drop(used);
        self.num += num;
        true
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut used = self.pool.used();
        used.sum -= self.num;
        if let Some(of_key) = used.by_key.get_mut(&self.holder.key) {
            *of_key -= self.num;
            if *of_key == 0 {
                used.by_key.remove(&self.holder.key);
            }
        }
        drop(used);
        self.pool.freed.notify_waiters();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holder(key: &str, share_max: f64) -> Holder {
        Holder { key: Arc::from(key), share_max }
    }

    #[test]
    fn no_key_takes_all() {
        let pool = Pool::new(10);
        let [a, b, c] = ["a", "b", "c"].map(|key| holder(key, 0.5));
        let held: Vec<Share> = (0..5).map(|_| pool.try_take(&a, 1).unwrap()).collect();
        assert!(pool.try_take(&a, 1).is_none());
        let _most = pool.try_take(&b, 4).unwrap();
        assert!(pool.try_take(&c, 2).is_none());
        drop(held);
        let mut share = pool.try_take(&c, 2).unwrap();
        assert!(share.try_grow(3) && !share.try_grow(1) && pool.num_used() == 9);
        drop(share);
        assert_eq!(pool.num_used(), 4);
        assert_eq!(pool.num_max(&holder("alone", 1.0)), 10);
    }

    #[tokio::test]
    async fn waiting_ends_with_a_place_or_in_time() {
        let pool = Pool::new(1);
        let key = holder("a", 1.0);
        let held = pool.try_take(&key, 1).unwrap();
        assert!(pool.take(&key, 1, Duration::from_millis(20)).await.is_none());
        let (for_task, for_key) = (Arc::clone(&pool), key.clone());
        let waiting = tokio::spawn(async move { for_task.take(&for_key, 1, Duration::from_secs(30)).await });
        tokio::time::sleep(Duration::from_millis(20)).await;
        drop(held);
        assert!(waiting.await.unwrap().is_some());
    }
}
