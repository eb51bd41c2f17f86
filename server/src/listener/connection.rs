//! What every open connection is doing, and which one makes way when there are too many.

use std::collections::BTreeMap;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use http_body::{Body as HttpBody, Frame, SizeHint};
use tokio_util::sync::CancellationToken;

/// Open connections, by age.
pub(super) struct Connections {
    num_max: usize,
    table: Arc<Mutex<Table>>,
}

#[derive(Default)]
struct Table {
    next_id: u64,
    open: BTreeMap<u64, Arc<Connection>>,
}

/// An open connection; an extension of its requests.
pub struct Connection {
    doing: Mutex<Doing>,
    ended: CancellationToken,
}

/// A connection's place in the table, given back when it is dropped.
pub(super) struct Place {
    id: u64,
    table: Arc<Mutex<Table>>,
    connection: Arc<Connection>,
}

/// Requests on a connection.
struct Doing {
    /// Whose head is here and whose answer is not sent.
    num_requests: usize,
    /// Of these, those whose body is still coming.
    num_receiving: usize,
    /// Since when there was no request, or none before the eldest now.
    since: Instant,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Connections {
    pub(super) fn new(num_max: usize) -> Self {
        Self { num_max, table: Arc::default() }
    }

    /// Takes a new connection in. When there are too many, the one that has waited longest for a head makes way, else the
    /// one that has waited longest for a body; when all are at work the new one is refused.
    pub(super) fn admit(&self) -> Option<Place> {
        let mut table = locked(&self.table);
        if table.open.len() >= self.num_max {
            let idleness = |(id, connection): (&u64, &Arc<Connection>)| Some((connection.idleness()?, *id));
            let Some((_, idlest)) = table.open.iter().filter_map(idleness).min() else {
                metrics::counter!("locution_connections_refused_total").increment(1);
                return None;
            };
            if let Some(connection) = table.open.remove(&idlest) {
                connection.ended.cancel();
            }
            metrics::counter!("locution_connections_evicted_total").increment(1);
        }
        let id = table.next_id;
        table.next_id += 1;
        let doing = Doing { num_requests: 0, num_receiving: 0, since: Instant::now() };
        let connection = Arc::new(Connection { doing: Mutex::new(doing), ended: CancellationToken::new() });
        table.open.insert(id, Arc::clone(&connection));
        metrics::gauge!("locution_connections_open").set(table.open.len() as f64);
        Some(Place { id, table: Arc::clone(&self.table), connection })
    }

    pub(super) fn end_all(&self) {
        locked(&self.table).open.values().for_each(|connection| connection.ended.cancel());
    }
}

impl Place {
    /// Whose it is.
    pub(super) fn connection(&self) -> &Arc<Connection> {
        &self.connection
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut table = locked(&self.table);
        table.open.remove(&self.id);
        metrics::gauge!("locution_connections_open").set(table.open.len() as f64);
    }
}

impl Connection {
    /// When it must end at once.
    pub(super) async fn ended(&self) {
        self.ended.cancelled().await;
    }

    /// When it had no request for so long.
    pub(super) async fn quiet_for(&self, limit: Duration) {
        loop {
            let remaining = {
                let doing = locked(&self.doing);
                if doing.num_requests > 0 { limit } else { limit.saturating_sub(doing.since.elapsed()) }
            };
            if remaining.is_zero() {
                return;
            }
            tokio::time::sleep(remaining).await;
        }
    }

    /// How dispensable it is, the most first: waiting for a head before waiting for a body, the longest first. None
    /// while it works.
    fn idleness(&self) -> Option<(bool, Instant)> {
        let doing = locked(&self.doing);
        (doing.num_requests == doing.num_receiving).then_some((doing.num_requests > 0, doing.since))
    }

    /// A request begins.
    pub(super) fn begin(self: &Arc<Self>) -> Busy {
        let mut doing = locked(&self.doing);
        if doing.num_requests == 0 {
            doing.since = Instant::now();
        }
        doing.num_requests += 1;
        Busy(Arc::clone(self))
    }

    /// The body of a request is being received until the guard is dropped.
    pub fn receiving(self: &Arc<Self>) -> Receiving {
        locked(&self.doing).num_receiving += 1;
        Receiving(Arc::clone(self))
    }
}

/// A body that is being received.
pub struct Receiving(Arc<Connection>);

impl Drop for Receiving {
    fn drop(&mut self) {
        locked(&self.0.doing).num_receiving -= 1;
    }
}

/// A request under way.
pub(super) struct Busy(Arc<Connection>);

impl Drop for Busy {
    fn drop(&mut self) {
        let mut doing = locked(&self.0.doing);
        doing.num_requests -= 1;
        if doing.num_requests == 0 {
            doing.since = Instant::now();
        }
    }
}

impl Busy {
    /// The request is under way until this body was sent.
    pub(super) fn until_sent(self, body: Body) -> impl HttpBody<Data = Bytes, Error = axum::Error> {
        BusyBody { body, _busy: self }
    }
}

struct BusyBody {
    body: Body,
    _busy: Busy,
}

impl HttpBody for BusyBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_gives_least_makes_way() {
        let connections = Connections::new(3);
        let [working, receiving, quiet] = [(); 3].map(|()| connections.admit().unwrap());
        let work = working.connection().begin();
        let _request = receiving.connection().begin();
        let body = receiving.connection().receiving();
        let is_ended = |place: &Place| place.connection().ended.is_cancelled();
        let fourth = connections.admit().unwrap();
        assert!(is_ended(&quiet) && !is_ended(&receiving));
        let _fourth_works = fourth.connection().begin();
        let fifth = connections.admit().unwrap();
        assert!(is_ended(&receiving) && !is_ended(&working));
        drop(body);
        let _fifth_works = fifth.connection().begin();
        assert!(connections.admit().is_none());
        drop((work, working));
        assert!(connections.admit().is_some());
    }
}
