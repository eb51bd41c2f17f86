//! What happens in a site, for those who watch: numbered, the latest kept.
//!
//! Nobody has a queue of his own: whoever watches reads from the events that are kept, and is told when he was too slow
//! and some have gone. So watching costs the same however many do and however slow they are.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use locution_engine::locate::LocalizationState;
use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;

use super::jobs::JobInfo;
use crate::records::{MapVersion, Receipt};

/// Events kept per site.
const NUM_KEPT: usize = 1_000;

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunChange {
    Made,
    Finished,
    Deleted,
}

/// Something that happened.
#[derive(Clone, Debug)]
pub enum SiteEvent {
    /// A run was made, finished or deleted.
    Run { run: String, change: RunChange },
    /// Scans were stored and became text.
    Words { run: String, receipt: Receipt },
    /// A job was queued, begun or ended.
    Job(JobInfo),
    /// Another version of the map serves.
    Version { version: MapVersion, num_components: u32 },
    /// How many matches the version that serves has, and how many of them hold it together.
    Matches { version: MapVersion, num_matches: u64, num_verified: u64 },
    /// A robot was found, or lost.
    Localization { id: u64, state: LocalizationState },
}

/// The events of a site.
pub struct Events {
    /// Tells the numbers of this process from those of another.
    epoch: u64,
    kept: Mutex<Kept>,
    news: Notify,
    /// Set when the site is deleted or the server stops.
    stop: CancellationToken,
}

#[derive(Default)]
struct Kept {
    /// Number of the first that is kept.
    first: u64,
    events: VecDeque<Arc<SiteEvent>>,
}

/// Names an event: which process numbered it, and its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EventId {
    pub epoch: u64,
    pub number: u64,
}

/// What a watcher reads next.
#[derive(Clone, Debug)]
pub enum Watched {
    /// An event.
    Event(EventId, Arc<SiteEvent>),
    /// Events that have gone, or that an earlier process had.
    Missed(EventId),
}

/// Somebody who watches.
pub struct Watcher {
    events: Arc<Events>,
    /// Number of the next one to read.
    next: u64,
    missed: bool,
}

impl Events {
    pub fn new(stop: CancellationToken) -> Self {
        static NUM_EPOCHS: AtomicU64 = AtomicU64::new(0);
        // Seconds since 1970 with a count behind: no two processes that serve a site one after the other agree in it.
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        let epoch = now.as_secs() << 20 | (NUM_EPOCHS.fetch_add(1, Ordering::Relaxed) & 0xf_ffff);
        Self { epoch, kept: Mutex::default(), news: Notify::new(), stop }
    }

    /// Tells those who watch.
    pub fn tell(&self, event: SiteEvent) {
        let mut kept = self.kept();
        kept.events.push_back(Arc::new(event));
        if kept.events.len() > NUM_KEPT {
            kept.events.pop_front();
            kept.first += 1;
        }
        drop(kept);
        self.news.notify_waiters();
    }

    /// Watches from now on, or from behind an event that was read before.
    pub fn watch(self: &Arc<Self>, last: Option<EventId>) -> Watcher {
        let kept = self.kept();
        let end = kept.first + kept.events.len() as u64;
        let (next, missed) = match last {
            None => (end, false),
            Some(last) if last.epoch == self.epoch && last.number < end => (last.number + 1, false),
            Some(_) => (end, true),
        };
        drop(kept);
        Watcher { events: Arc::clone(self), next, missed }
    }

    fn kept(&self) -> std::sync::MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watcher {
    /// The next thing to read; none once the site is deleted or the server stops.
    pub async fn next(&mut self) -> Option<Watched> {
        loop {
            let events = Arc::clone(&self.events);
            let news = events.news.notified();
            if events.stop.is_cancelled() {
                return None;
            }
            if let Some(watched) = self.read() {
                return Some(watched);
            }
            tokio::select! {
                () = news => {}
                () = events.stop.cancelled() => return None,
            }
        }
    }

    fn read(&mut self) -> Option<Watched> {
        let kept = self.events.kept();
        let id = |number| EventId { epoch: self.events.epoch, number };
        if std::mem::take(&mut self.missed) {
            return Some(Watched::Missed(id(self.next.saturating_sub(1))));
        }
        if self.next < kept.first {
            self.next = kept.first;
            return Some(Watched::Missed(id(self.next - 1)));
        }
        let event = kept.events.get((self.next - kept.first) as usize)?;
        let watched = Watched::Event(id(self.next), Arc::clone(event));
        self.next += 1;
        Some(watched)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn version(version: MapVersion) -> SiteEvent {
        SiteEvent::Version { version, num_components: 1 }
    }

    /// The next event's number and version.
    async fn read(watcher: &mut Watcher) -> (EventId, MapVersion) {
        match watcher.next().await {
            Some(Watched::Event(id, event)) => match *event {
                SiteEvent::Version { version, .. } => (id, version),
                _ => panic!("{event:?}"),
            },
            other => panic!("{other:?}"),
        }
    }

    #[tokio::test]
    async fn whoever_comes_again_goes_on_where_he_was() {
        let events = Arc::new(Events::new(CancellationToken::new()));
        events.tell(version(1));
        let mut watcher = events.watch(None);
        events.tell(version(2));
        events.tell(version(3));
        let (id, seen) = read(&mut watcher).await;
        assert_eq!(seen, 2, "what came before is not told");
        let mut again = events.watch(Some(id));
        assert_eq!(read(&mut again).await.1, 3);
        let mut stranger = events.watch(Some(EventId { epoch: id.epoch + 1, ..id }));
        assert!(matches!(stranger.next().await, Some(Watched::Missed(_))), "another process numbered it");
        events.tell(version(4));
        assert_eq!(read(&mut stranger).await.1, 4);
    }

    #[tokio::test]
    async fn whoever_is_too_slow_is_told_and_goes_on_with_what_is_kept() {
        let events = Arc::new(Events::new(CancellationToken::new()));
        let mut watcher = events.watch(None);
        let num_told = NUM_KEPT as u64 + 7;
        (0..num_told).for_each(|number| events.tell(version(number)));
        assert!(matches!(watcher.next().await, Some(Watched::Missed(_))));
        for expected in 7..num_told {
            assert_eq!(read(&mut watcher).await.1, expected);
        }
    }

    #[tokio::test]
    async fn watching_ends_with_the_site() {
        let stop = CancellationToken::new();
        let events = Arc::new(Events::new(stop.clone()));
        let mut watcher = events.watch(None);
        let (watched, ()) = tokio::join!(watcher.next(), async { stop.cancel() });
        assert!(watched.is_none());
    }
}
