//! What is said of every request: a number that follows it through the log, a line when it is answered, a line more
//! when it changed something or was refused, and the metrics. No key and no content of a body is ever written.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::Response;
use tracing::Instrument;

use crate::auth::Asked;
use crate::config::Scope;
use crate::error::{Slug, shortened};

/// The header with the number of a request, both ways.
pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
/// Longest number of a request that is taken over from the client.
const REQUEST_ID_BYTES_MAX: usize = 64;
/// Longest path that is logged.
const PATH_BYTES_MAX: usize = 200;

/// Follows a request from its head to its answer.
pub async fn observe(mut request: Request, next: Next) -> Response {
    let started = Instant::now();
    let id = request_id(&request);
    request.headers_mut().insert(REQUEST_ID, id.clone());
    let seen = Seen::of(&request);
    let span = tracing::info_span!("request", id = id.to_str().unwrap_or_default());
    let mut response = next.run(request).instrument(span.clone()).await;
    response.headers_mut().insert(REQUEST_ID, id);
    let duration_s = started.elapsed().as_secs_f64();
    span.in_scope(|| seen.log(&response, duration_s));
    seen.count(&response, duration_s);
    response
}

/// What is known of a request before it is served.
struct Seen {
    method: String,
    route: String,
    path: String,
}

impl Seen {
    fn of(request: &Request) -> Self {
        let route = request.extensions().get::<MatchedPath>().map_or("none", |path| path.as_str());
        let path = shortened(request.uri().path().to_owned(), PATH_BYTES_MAX);
        Self { method: request.method().to_string(), route: route.to_owned(), path }
    }

    fn log(&self, response: &Response, duration_s: f64) {
        let (method, route, path) = (&self.method, &self.route, &self.path);
        let status = response.status().as_u16();
        let asked = response.extensions().get::<Asked>();
        let key = asked.and_then(|asked| asked.key.as_deref()).unwrap_or("none");
        let problem = response.extensions().get::<Slug>().map_or("", |slug| slug.0.as_str());
        tracing::info!(target: "locution::access", method, route, path, status, duration_s, key, problem);
        let is_change = asked.is_some_and(|asked| asked.scope.is_some_and(|scope| scope > Scope::Read));
        let is_refusal = [401, 403, 408, 413, 429, 503].contains(&status);
        if is_refusal {
            tracing::warn!(target: "locution::audit", event = "refused", method, path, status, key, problem);
        } else if is_change {
            let event = if response.status().is_success() { "changed" } else { "not changed" };
            tracing::info!(target: "locution::audit", event, method, path, status, key, problem);
        }
    }

    fn count(&self, response: &Response, duration_s: f64) {
        let status = response.status().as_u16().to_string();
        let (method, route) = (self.method.clone(), self.route.clone());
        metrics::histogram!("locution_http_request_seconds", "route" => route.clone()).record(duration_s);
        metrics::counter!("locution_http_requests_total", "method" => method, "route" => route, "status" => status)
            .increment(1);
        if let Some(Slug(reason)) = response.extensions().get::<Slug>() {
            metrics::counter!("locution_refusals_total", "reason" => reason.clone()).increment(1);
        }
    }
}

/// The client's own number when it is harmless, else a new one: a part that no other start has, and a count.
fn request_id(request: &Request) -> HeaderValue {
    static START: std::sync::OnceLock<Arc<str>> = std::sync::OnceLock::new();
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let is_harmless = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-".contains(byte);
    if let Some(given) = request.headers().get(REQUEST_ID) {
        let bytes = given.as_bytes();
        if !bytes.is_empty() && bytes.len() <= REQUEST_ID_BYTES_MAX && bytes.iter().all(is_harmless) {
            return given.clone();
        }
    }
    let start = START.get_or_init(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        format!("{:x}", since.as_micros()).into()
    });
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    HeaderValue::from_str(&format!("{start}-{count:x}")).unwrap_or(HeaderValue::from_static("none"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_clients_are_kept_when_they_are_harmless() {
        let id = |given: &'static [u8]| {
            let request = Request::builder().header(REQUEST_ID, HeaderValue::from_bytes(given).unwrap());
            request_id(&request.body(axum::body::Body::empty()).unwrap())
        };
        assert_eq!(id(b"robot-7.42"), "robot-7.42");
        assert_ne!(id(b"a b"), "a b");
        assert_ne!(id(b"\xff"), id(b"\xff"));
        assert_ne!(id(&[b'a'; 65]).len(), 65);
    }
}
