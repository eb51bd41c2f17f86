//! Requests let in: the body first, then a place among those that are served.
//!
//! Nobody holds a place without sending: a body is received at a minimal rate and within its memory, and only when it is
//! there does its request take a place. No key may hold all places or all memory.

mod body;
mod pool;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::{CONNECTION, CONTENT_LENGTH};
use axum::http::{HeaderValue, Version};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::app::AppError;
use crate::auth::Identity;
use crate::config::LimitsConfig;
use crate::error::ApiError;
use crate::listener::Connection;
use pool::{Holder, Pool, Share};

/// Memory that a parsed body may take, as a multiple of its bytes: a number of JSON or CBOR is at least one byte, and a
/// scan without readings 75 for 850.
const PARSED_PER_BYTE: usize = 12;
/// How long a request whose body is there waits for memory to parse it in.
const PARSING_PATIENCE: Duration = Duration::from_secs(10);

/// What a route takes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intake {
    /// Nothing: it answers at once whatever else goes on.
    Exempt,
    /// Small documents.
    Small,
    /// Scans: large bodies, and work that waits in the queue of batches.
    Scans,
    /// A stream that is never in memory as a whole; it holds a place while it comes.
    Stream,
}

/// Places and memory of the whole server.
#[derive(Debug)]
pub struct Places {
    limits: LimitsConfig,
    requests: Arc<Pool>,
    batches: Arc<Pool>,
    received_bytes: Arc<Pool>,
    parsed_bytes: Arc<Pool>,
}

/// Held while a request is served.
struct Admitted {
    _shares: [Option<Share>; 4],
}

impl Places {
    /// Those of a checked configuration.
    pub fn new(limits: &LimitsConfig) -> Self {
        Self {
            requests: Pool::new(limits.num_requests_max),
            batches: Pool::new(limits.num_batches_max),
            received_bytes: Pool::new(limits.received_bytes_max),
            parsed_bytes: Pool::new(limits.parsed_bytes_max),
            limits: limits.clone(),
        }
    }

    /// Tells the metrics what is taken.
    pub fn observe(&self) {
        metrics::gauge!("locution_requests_served").set(self.requests.num_used() as f64);
        metrics::gauge!("locution_batches_queued").set(self.batches.num_used() as f64);
        metrics::gauge!("locution_received_body_bytes").set(self.received_bytes.num_used() as f64);
        metrics::gauge!("locution_parsed_body_bytes").set(self.parsed_bytes.num_used() as f64);
    }

    /// Receives the body of a request and finds places for it.
    async fn admit(
        &self,
        intake: Intake,
        identity: &Identity,
        request: Request,
    ) -> Result<(Request, Admitted), ApiError> {
        // Without keys there is nobody to share with.
        let share_max = if identity.is_local() { 1.0 } else { self.limits.share_per_key_max };
        let holder = Holder { key: Arc::clone(identity.name()), share_max };
        let num_bytes_max = match intake {
            Intake::Exempt => return Ok((request, Admitted { _shares: [const { None }; 4] })),
            Intake::Stream => {
                let served = self.requests.try_take(&holder, 1).ok_or_else(ApiError::overloaded)?;
                return Ok((request, Admitted { _shares: [Some(served), None, None, None] }));
            }
            Intake::Small => self.limits.small_body_bytes_max,
            Intake::Scans => self.limits.body_bytes_max,
        };
        let declared = request.headers().get(CONTENT_LENGTH).and_then(|value| value.to_str().ok());
        if declared
            .and_then(|text| text.parse::<usize>().ok())
            .is_some_and(|declared| declared > num_bytes_max)
        {
            return Err(body::too_large(num_bytes_max));
        }
        let (parts, body) = request.into_parts();
        let receiving = parts.extensions.get::<Arc<Connection>>().map(Connection::receiving);
        let (bytes, received) = body::read(body, num_bytes_max, &self.received_bytes, &holder).await?;
        drop(receiving);
        // The largest bodies count as half of what a key may hold: they must not wait until nobody else parses.
        let num_parsed = (PARSED_PER_BYTE * bytes.len()).min(self.parsed_bytes.num_max(&holder) / 2);
        let parsed = self.parsed_bytes.take(&holder, num_parsed, PARSING_PATIENCE).await;
        let parsed = parsed.ok_or_else(ApiError::overloaded)?;
        let batch = match intake {
            Intake::Scans => Some(self.batches.try_take(&holder, 1).ok_or_else(queue_full)?),
            _ => None,
        };
        let served = self.requests.try_take(&holder, 1).ok_or_else(ApiError::overloaded)?;
        let shares = [Some(received), Some(parsed), batch, Some(served)];
        Ok((Request::from_parts(parts, Body::from(bytes)), Admitted { _shares: shares }))
    }
}

/// Lets a request of a route in, or says why not now.
pub(crate) async fn serve(
    places: &Places,
    intake: Intake,
    identity: &Identity,
    request: Request,
    next: Next,
) -> Response {
    match places.admit(intake, identity, request).await {
        Ok((request, _admitted)) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

fn queue_full() -> ApiError {
    AppError::Busy { queue: "the queue of batches", retry_after: Duration::from_secs(1) }.into()
}

/// Gives every request the places, its body a pace and its coding a known spelling.
///
/// What is left of a body after its answer would stand before the next request, so its connection ends; the answer says
/// so, or a client would send that request into the closing connection.
pub async fn prepare(State(places): State<Arc<Places>>, request: Request, next: Next) -> Response {
    let is_http1 = request.version() < Version::HTTP_2;
    let (mut request, is_read) = body::pace(request, &places.limits);
    let mut response = match body::normalize_coding(&mut request) {
        Ok(()) => {
            request.extensions_mut().insert(places);
            next.run(request).await
        }
        Err(refusal) => refusal.into_response(),
    };
    if is_http1 && !is_read.load(Ordering::Relaxed) {
        response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
    }
    response
}
