//! The one way in which anything fails towards a client: RFC 9457 problem details.

use axum::Json;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::app::AppError;
use crate::storage::StorageError;

/// Where the types of problems are named; the address need not answer.
const TYPE_PREFIX: &str = "https://locution.dev/problems/";

/// What went wrong (RFC 9457).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Problem {
    /// Stable name of the kind of problem.
    #[serde(rename = "type")]
    #[schema(example = "https://locution.dev/problems/invalid-scan")]
    pub kind: String,
    /// The kind in words.
    #[schema(example = "Invalid scan")]
    pub title: String,
    /// The HTTP status.
    #[schema(example = 422)]
    pub status: u16,
    /// This very problem in words.
    pub detail: String,
    /// Path of the offending value in the request.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "scans[3].ranges_m[17]")]
    pub field: Option<String>,
    /// The sequence number that continues the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_sequence: Option<u64>,
}

/// Longest explanation, bytes: what a client sent is echoed only as far as it helps to find the fault.
const DETAIL_BYTES_MAX: usize = 300;
/// Longest path of a value, bytes.
const FIELD_BYTES_MAX: usize = 200;

/// The beginning of a text that is too long.
pub(crate) fn shortened(mut text: String, num_bytes_max: usize) -> String {
    if text.len() > num_bytes_max {
        let end = (0..=num_bytes_max).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
        text.truncate(end);
        text.push('…');
        text.shrink_to_fit();
    }
    text
}

/// The last part of a problem's type; an extension of its answer, for the log and the metrics.
#[derive(Clone, Debug)]
pub(crate) struct Slug(pub(crate) String);

/// A refusal or failure on its way to the client.
#[derive(Clone, Debug)]
pub struct ApiError {
    problem: Problem,
    retry_after_s: Option<u64>,
}

impl ApiError {
    /// A problem of a status, by the last part of its type.
    pub fn new(status: StatusCode, slug: &str, title: &str, detail: impl Into<String>) -> Self {
        let problem = Problem {
            kind: format!("{TYPE_PREFIX}{slug}"),
            title: title.to_owned(),
            status: status.as_u16(),
            detail: shortened(detail.into(), DETAIL_BYTES_MAX),
            field: None,
            expected_sequence: None,
        };
        Self { problem, retry_after_s: None }
    }

    /// Says which value of the request is meant.
    pub fn at(mut self, field: impl Into<String>) -> Self {
        self.problem.field = Some(shortened(field.into(), FIELD_BYTES_MAX));
        self
    }

    /// Says when to ask again.
    pub fn retry_after(mut self, seconds: u64) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }

    fn expecting(mut self, sequence: u64) -> Self {
        self.problem.expected_sequence = Some(sequence);
        self
    }

    /// 400: the body cannot be read.
    pub fn malformed(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, "malformed-body", "Malformed body", detail)
    }

    /// 422: a well-formed value that cannot be.
    pub fn invalid(field: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "invalid-value", "Invalid value", detail).at(field)
    }

    /// 422: a value of a scan that cannot be.
    pub fn invalid_scan(field: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "invalid-scan", "Invalid scan", detail).at(field)
    }

    /// 404: no such thing.
    pub fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, "not-found", "Not found", detail)
    }

    /// 401: nobody known asks.
    pub fn unauthorized(detail: &str) -> Self {
        Self::new(StatusCode::UNAUTHORIZED, "unauthorized", "A key is needed", detail)
    }

    /// 429: a key asks more often than it may.
    pub fn too_often(seconds: u64) -> Self {
        let detail = "the key has sent more requests than it may in a second";
        Self::new(StatusCode::TOO_MANY_REQUESTS, "too-often", "Too many requests", detail)
            .retry_after(seconds)
    }

    /// 503: too much at once.
    pub fn overloaded() -> Self {
        let detail = "more requests are being served than the server allows at once";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "overloaded", "Service unavailable", detail).retry_after(1)
    }

    /// A problem for a status that was answered without one, such as by a middleware.
    pub fn of_status(status: StatusCode) -> Self {
        let title = status.canonical_reason().unwrap_or("The request failed");
        let slug = title.to_ascii_lowercase().replace(' ', "-");
        Self::new(status, &slug, title, title)
    }
}

impl From<AppError> for ApiError {
    fn from(error: AppError) -> Self {
        let detail = error.to_string();
        match error {
            AppError::NotFound { .. } => Self::not_found(detail),
            AppError::Exists { .. } => Self::new(StatusCode::CONFLICT, "exists", "Already exists", detail),
            AppError::Sequence { expected_sequence, .. } => {
                Self::new(StatusCode::CONFLICT, "sequence", "Sequence conflict", detail)
                    .at("first_sequence")
                    .expecting(expected_sequence)
            }
            AppError::Finished { expected_sequence, .. } => {
                Self::new(StatusCode::CONFLICT, "finished", "Run finished", detail)
                    .expecting(expected_sequence)
            }
            AppError::Invalid { field, is_scan: true, .. } => Self::invalid_scan(field, detail),
            AppError::Invalid { field, .. } => Self::invalid(field, detail),
            AppError::NotReady { .. } => Self::new(StatusCode::CONFLICT, "not-ready", "Not ready", detail),
            AppError::Elsewhere => {
                Self::new(StatusCode::SERVICE_UNAVAILABLE, "moving", "Service unavailable", detail)
                    .retry_after(1)
            }
            AppError::Busy { retry_after, .. } => {
                Self::new(StatusCode::TOO_MANY_REQUESTS, "busy", "Too many requests", detail)
                    .retry_after(retry_after.as_secs().max(1))
            }
            AppError::Stopping => {
                Self::new(StatusCode::SERVICE_UNAVAILABLE, "stopping", "The server stops", detail)
                    .retry_after(5)
            }
            AppError::Storage(error) => Self::from(error),
            AppError::Internal { what } => {
                tracing::error!(what, "internal error");
                Self::new(
                    StatusCode::INTERNAL_SERVER_ERROR,
                    "internal",
                    "Internal server error",
                    "see the server's log",
                )
            }
        }
    }
}

impl From<StorageError> for ApiError {
    fn from(error: StorageError) -> Self {
        let detail = error.to_string();
        let unavailable = |seconds| {
            Self::new(StatusCode::SERVICE_UNAVAILABLE, "storage", "Storage unavailable", detail.clone())
                .retry_after(seconds)
        };
        match error {
            StorageError::Conflict | StorageError::Fenced => unavailable(1),
            StorageError::Unavailable { retry_after, .. } => unavailable(retry_after.as_secs().max(1)),
            StorageError::Held { .. } => unavailable(5),
            StorageError::Full { .. } => {
                Self::new(StatusCode::INSUFFICIENT_STORAGE, "full", "The storage is full", detail)
                    .retry_after(30)
            }
            StorageError::Corrupt { .. } | StorageError::ValueTooLarge { .. } => {
                tracing::error!(error = detail, "the storage failed");
                Self::new(StatusCode::INTERNAL_SERVER_ERROR, "corrupt", "Corrupt data", detail)
            }
        }
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.problem.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let slug = self.problem.kind.trim_start_matches(TYPE_PREFIX).to_owned();
        let mut response = (status, Json(self.problem)).into_response();
        response.extensions_mut().insert(Slug(slug));
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        if let Some(seconds) = self.retry_after_s {
            headers.insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn echoes_are_bounded_at_a_character() {
        let error = ApiError::malformed("ä".repeat(10_000_000)).at("ß".repeat(10_000));
        assert!(error.problem.detail.len() <= DETAIL_BYTES_MAX + 3 && error.problem.detail.ends_with("ä…"));
        assert!(error.problem.field.unwrap().len() <= FIELD_BYTES_MAX + 3);
        assert_eq!(ApiError::malformed("short").problem.detail, "short");
    }
}
