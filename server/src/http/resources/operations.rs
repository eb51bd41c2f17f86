//! For those who run the server: health, readiness, metrics.

use axum::extract::State;
use axum::response::{Html, Response};

use crate::error::ApiError;
use crate::http::text;
use crate::state::AppState;
use crate::telemetry;

/// The process is alive.
#[utoipa::path(get, path = "/healthz", operation_id = "get_health", tag = "operations",
    responses((status = 200, description = "The process is alive", body = String, content_type = "text/plain")))]
pub async fn healthz() -> Response {
    text("ok\n".into())
}

/// The storage answers, so requests will be served.
#[utoipa::path(get, path = "/readyz", operation_id = "get_readiness", tag = "operations",
    responses((status = 200, description = "Requests will be served", body = String, content_type = "text/plain")))]
pub async fn readyz(State(state): State<AppState>) -> Result<Response, ApiError> {
    state.app.check_ready().await?;
    Ok(text("ready\n".into()))
}

/// A page to look at sites, runs and maps; one file, nothing is loaded from elsewhere.
#[utoipa::path(get, path = "/ui", operation_id = "get_ui", tag = "operations",
    responses((status = 200, description = "The page", body = String, content_type = "text/html")))]
pub async fn ui() -> Html<&'static str> {
    Html(include_str!("../../../assets/ui.html"))
}

/// Counters and histograms in Prometheus' text format.
#[utoipa::path(get, path = "/metrics", operation_id = "get_metrics", tag = "operations",
    responses((status = 200, description = "The metrics", body = String, content_type = "text/plain")))]
pub async fn metrics(State(state): State<AppState>) -> Response {
    text(telemetry::render(&state).await)
}
