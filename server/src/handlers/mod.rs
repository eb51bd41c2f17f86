//! One file per resource; a handler extracts, calls one use case and wraps the answer.

pub mod backups;
pub mod batches;
pub mod changes;
pub mod encodings;
pub mod jobs;
pub mod labels;
pub mod localizations;
pub mod maps;
pub mod matches;
pub mod operations;
pub mod places;
pub mod queries;
pub mod runs;
pub mod sites;
pub mod texts;

use axum::http::header;
use axum::response::{IntoResponse, Response};

/// A plain-text answer.
pub(crate) fn text(body: String) -> Response {
    ([(header::CONTENT_TYPE, "text/plain; charset=utf-8")], body).into_response()
}
