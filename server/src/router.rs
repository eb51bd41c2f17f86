//! The service: routes, documentation, and the layers around them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{DefaultBodyLimit, MatchedPath, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;
use axum::{Router, middleware};
use tokio::sync::Semaphore;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::decompression::RequestDecompressionLayer;
use tower_http::timeout::TimeoutLayer;
use utoipa_swagger_ui::SwaggerUi;

use crate::auth;
use crate::error::ApiError;
use crate::http::routes::routes;
use crate::http::{nanoseconds, openapi, page, with_version};
use crate::state::AppState;

/// The service: routes, documentation, limits, keys.
pub fn build_router(state: AppState) -> Router {
    let limits = state.app.config().limits.clone();
    let slots = Arc::new(Semaphore::new(limits.num_requests_max));
    let (routes, _) = routes().split_for_parts();
    routes
        .layer(middleware::from_fn(measure))
        .method_not_allowed_fallback(async || ApiError::of_status(StatusCode::METHOD_NOT_ALLOWED))
        .layer(middleware::from_fn_with_state(state.clone(), guard))
        .with_state(state)
        .route("/", get(async || Redirect::temporary("/ui")))
        .route("/ui/{file}", get(page::file))
        .route("/openapi.json", get(document))
        .merge(SwaggerUi::new("/docs").config(utoipa_swagger_ui::Config::from("/openapi.json")))
        .fallback(async || ApiError::not_found("there is no such path; see /docs"))
        .layer(DefaultBodyLimit::max(limits.body_bytes_max))
        .layer(RequestDecompressionLayer::new())
        .layer(middleware::from_fn(nanoseconds::as_asked))
        .layer(CompressionLayer::new())
        .layer(CatchPanicLayer::custom(|_| {
            ApiError::of_status(StatusCode::INTERNAL_SERVER_ERROR).into_response()
        }))
        .layer(TimeoutLayer::with_status_code(
            StatusCode::REQUEST_TIMEOUT,
            Duration::from_secs(limits.request_timeout_s),
        ))
        .layer(middleware::from_fn(problems_only))
        .layer(middleware::map_response(with_version))
        .layer(middleware::from_fn_with_state(slots, bound))
}

/// The document of this API.
async fn document() -> Response {
    ([(header::CONTENT_TYPE, "application/json")], openapi::document_json()).into_response()
}

/// Asks for a key where one is needed.
async fn guard(state: State<AppState>, request: Request, next: Next) -> Response {
    if request.uri().path().starts_with("/v1/") || request.uri().path() == "/metrics" {
        return auth::authorize(state, request, next).await;
    }
    next.run(request).await
}

/// Refuses what is more than the server serves at once.
async fn bound(State(slots): State<Arc<Semaphore>>, request: Request, next: Next) -> Response {
    match slots.try_acquire() {
        Ok(_slot) => next.run(request).await,
        Err(_) => ApiError::overloaded().into_response(),
    }
}

/// Gives problem details to failures that a layer answered without them.
async fn problems_only(request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    let status = response.status();
    let is_problem = response.headers().get(header::CONTENT_TYPE)
        == Some(&HeaderValue::from_static("application/problem+json"));
    if (status.is_client_error() || status.is_server_error()) && !is_problem {
        return ApiError::of_status(status).into_response();
    }
    response
}

/// Counts requests by route and status.
async fn measure(request: Request, next: Next) -> Response {
    let started = Instant::now();
    let route = request.extensions().get::<MatchedPath>().map_or("", |path| path.as_str()).to_owned();
    let method = request.method().to_string();
    let response = next.run(request).await;
    let status = response.status().as_u16().to_string();
    metrics::counter!("locution_http_requests_total", "method" => method, "route" => route.clone(), "status" => status)
        .increment(1);
    metrics::histogram!("locution_http_request_seconds", "route" => route)
        .record(started.elapsed().as_secs_f64());
    response
}
