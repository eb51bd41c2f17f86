//! The page for people: files that `clients/page` is built into, served from the binary.
//!
//! It loads nothing from elsewhere, and its content policy holds the browser to that.

use axum::extract::Path;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::forms::is_known;
use crate::error::ApiError;

/// Scripts, styles and requests of this server only; pictures that the page itself makes may be shown.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; \
                      connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Name, media type and content of every file.
const FILES: [(&str, &str, &[u8]); 4] = [
    ("index.html", "text/html; charset=utf-8", include_bytes!("../../assets/ui/index.html")),
    ("page.js", "text/javascript; charset=utf-8", include_bytes!("../../assets/ui/page.js")),
    ("page.css", "text/css; charset=utf-8", include_bytes!("../../assets/ui/page.css")),
    ("icon.svg", "image/svg+xml", include_bytes!("../../assets/ui/icon.svg")),
];

/// A page to look at sites, send recordings, ask and decide; nothing is loaded from elsewhere.
#[utoipa::path(get, path = "/ui", operation_id = "get_ui", tag = "operations",
    responses((status = 200, description = "The page", body = String, content_type = "text/html")))]
pub async fn ui(headers: HeaderMap) -> Result<Response, ApiError> {
    answer("index.html", &headers)
}

/// A file that the page loads.
pub async fn file(Path(name): Path<String>, headers: HeaderMap) -> Result<Response, ApiError> {
    answer(&name, &headers)
}

fn answer(name: &str, headers: &HeaderMap) -> Result<Response, ApiError> {
    let (_, content_type, content) = FILES
        .iter()
        .find(|(file, _, _)| *file == name)
        .ok_or_else(|| ApiError::not_found("the page has no such file"))?;
    let tag = format!("\"{:08x}\"", crc32fast::hash(content));
    let mut response = if is_known(headers, &tag) {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        ([(header::CONTENT_TYPE, *content_type)], *content).into_response()
    };
    let added = response.headers_mut();
    // Asked for anew each time, so that page and server are of one version; an unchanged file is not sent again.
    added.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    added.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    added.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    added.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        added.insert(header::ETAG, tag);
    }
    Ok(response)
}
