//! The edge: from requests to use cases and back. Nothing below knows HTTP.
//!
//! ```text
//! router ─► auth ─► extract ─► resources, forms ─► app (use cases)
//!    │                           │
//!    └─ openapi ─► routes ───────┘        one list of routes serves the router and the document
//! ```
//!
//! `resources` holds a file per resource: its parameters, its bodies, its handlers. `forms` holds the map in the
//! formats of other tools, `geojson` shapes as GeoJSON writes them, `page` the files of the page under `/ui`.

pub(crate) mod as_documented;
mod forms;
mod geojson;
pub(crate) mod nanoseconds;
pub mod openapi;
pub(crate) mod page;
mod ranges;
pub(crate) mod resources;
pub(crate) mod routes;
pub(crate) mod values;
pub(crate) mod wording;

use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};

/// The version of the program, as `Locution-Version` and in the document.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Adds the version of the program to an answer.
pub(crate) async fn with_version(mut response: Response) -> Response {
    response.headers_mut().insert("locution-version", HeaderValue::from_static(VERSION));
    response
}

/// Says in an answer where that can be found which was made or begun.
fn with_location(location: &str, answer: impl IntoResponse) -> Response {
    let mut response = answer.into_response();
    if let Ok(location) = HeaderValue::from_str(location) {
        response.headers_mut().insert(header::LOCATION, location);
    }
    response
}

/// A plain-text answer.
fn text(body: String) -> Response {
    ([(header::CONTENT_TYPE, "text/plain; charset=utf-8")], body).into_response()
}
