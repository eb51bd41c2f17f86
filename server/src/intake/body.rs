//! Bodies: received at a minimal rate, decompressed up to a limit.

use std::error::Error;
use std::fmt;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::header::CONTENT_ENCODING;
use axum::http::{HeaderValue, StatusCode};
use http_body::{Body as HttpBody, Frame, SizeHint};
use http_body_util::BodyExt;
use tokio::time::{Instant, Sleep};

use super::pool::{Holder, Pool, Share};
use crate::config::LimitsConfig;
use crate::error::ApiError;

/// A body whose sender stopped, or sends too slowly.
#[derive(Debug)]
struct TooSlow;

impl fmt::Display for TooSlow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the body came too slowly")
    }
}

impl Error for TooSlow {}

/// Fails when nothing comes for a while, or when the whole takes too long.
struct Paced {
    body: Body,
    stall_max: Duration,
    next: Pin<Box<Sleep>>,
    end: Instant,
    is_read: Arc<AtomicBool>,
}

impl HttpBody for Paced {
    type Data = Bytes;
    type Error = axum::BoxError;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::BoxError>>> {
        if let Poll::Ready(frame) = Pin::new(&mut self.body).poll_frame(cx) {
            let deadline = self.end.min(Instant::now() + self.stall_max);
            self.next.as_mut().reset(deadline);
            if frame.is_none() || self.body.is_end_stream() {
                self.is_read.store(true, Ordering::Relaxed);
            }
            return Poll::Ready(frame.map(|frame| frame.map_err(Into::into)));
        }
        self.next.as_mut().poll(cx).map(|()| Some(Err(TooSlow.into())))
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// Sets the pace of a request's body as it comes from the network, before it is decompressed. The flag says later whether
/// all of it was read.
pub(super) fn pace(request: Request, limits: &LimitsConfig) -> (Request, Arc<AtomicBool>) {
    let stall_max = Duration::from_secs_f64(limits.stall_max_s);
    let end = Instant::now() + Duration::from_secs_f64(limits.body_time_max_s);
    let is_read = Arc::new(AtomicBool::new(request.body().is_end_stream()));
    let flag = Arc::clone(&is_read);
    let request = request.map(|body| {
        if body.is_end_stream() {
            return body;
        }
        let next = Box::pin(tokio::time::sleep(stall_max));
        Body::new(Paced { body, stall_max, next, end, is_read: flag })
    });
    (request, is_read)
}

/// Spells the coding as the decompression knows it; codings do not depend on case, and `x-gzip` is `gzip`.
pub(super) fn normalize_coding(request: &mut Request) -> Result<(), ApiError> {
    let Some(coding) = request.headers_mut().remove(CONTENT_ENCODING) else { return Ok(()) };
    let known = match coding.to_str().unwrap_or_default().trim().to_ascii_lowercase().as_str() {
        "gzip" | "x-gzip" => "gzip",
        "zstd" => "zstd",
        "identity" | "" => return Ok(()),
        other => {
            let detail = format!("the coding `{other}` is not understood; send gzip, zstd or no coding");
            let title = "The body's coding is not understood";
            return Err(ApiError::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "coding", title, detail));
        }
    };
    request.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static(known));
    Ok(())
}

/// Reads a body of at most so many bytes, as far as there is memory for it.
pub(super) async fn read(
    mut body: Body,
    num_bytes_max: usize,
    memory: &Arc<Pool>,
    holder: &Holder,
) -> Result<(Bytes, Share), ApiError> {
    let mut share = memory.try_take(holder, 0).ok_or_else(ApiError::overloaded)?;
    let mut parts: Vec<Bytes> = Vec::new();
    let mut num_bytes = 0;
    while let Some(frame) = body.frame().await {
        let Ok(part) = frame.map_err(|error| unreadable(&error))?.into_data() else { continue };
        num_bytes += part.len();
        if num_bytes > num_bytes_max {
            return Err(too_large(num_bytes_max));
        }
        if !share.try_grow(part.len()) {
            return Err(ApiError::overloaded());
        }
        parts.push(part);
    }
    let whole = match parts.len() {
        1 => parts.swap_remove(0),
        _ => parts.concat().into(),
    };
    Ok((whole, share))
}

/// 413 with the limit.
pub(super) fn too_large(num_bytes_max: usize) -> ApiError {
    let detail = format!("the body is larger than the {num_bytes_max} bytes that the server takes here");
    ApiError::new(StatusCode::PAYLOAD_TOO_LARGE, "too-large", "The body is too large", detail)
}

fn unreadable(error: &axum::Error) -> ApiError {
    let mut cause: Option<&(dyn Error + 'static)> = Some(error);
    while let Some(inner) = cause {
        if inner.is::<TooSlow>() {
            let title = "The body came too slowly";
            let detail =
                "no byte came for the server's limits.stall_max_s, or not all within limits.body_time_max_s";
            return ApiError::new(StatusCode::REQUEST_TIMEOUT, "too-slow", title, detail);
        }
        cause = inner.source();
    }
    ApiError::malformed(error.to_string())
}
