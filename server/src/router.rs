//! The whole API on one screen, and the layers around it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::{DefaultBodyLimit, MatchedPath, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;
use tokio::sync::Semaphore;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::decompression::RequestDecompressionLayer;
use tower_http::timeout::TimeoutLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::SwaggerUi;

use crate::auth;
use crate::error::ApiError;
use crate::handlers::{
    backups, batches, changes, jobs, labels, localizations, maps, matches, operations, places, queries, runs,
    sites, texts,
};
use crate::openapi::{self, Document};
use crate::state::AppState;

/// Every route, with its documentation.
pub(crate) fn routes() -> OpenApiRouter<AppState> {
    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(operations::healthz))
        .routes(routes!(operations::readyz))
        .routes(routes!(operations::metrics))
        .routes(routes!(operations::ui))
        .routes(routes!(sites::list_sites))
        .routes(routes!(sites::make_site, sites::get_site, sites::delete_site))
        .routes(routes!(backups::backup_site, backups::restore_site))
        .routes(routes!(runs::list_runs))
        .routes(routes!(runs::make_run, runs::get_run))
        .routes(routes!(runs::finish_run))
        .routes(routes!(batches::append_batch))
        .routes(routes!(batches::list_scans))
        .routes(routes!(texts::list_observations))
        .routes(routes!(texts::list_words))
        .routes(routes!(texts::get_trajectory))
        .routes(routes!(texts::get_trajectory_tum))
        .routes(routes!(jobs::build_map))
        .routes(routes!(jobs::list_jobs))
        .routes(routes!(jobs::get_job))
        .routes(routes!(matches::list_matches))
        .routes(routes!(matches::get_match))
        .routes(routes!(matches::decide_match, matches::undecide_match))
        .routes(routes!(maps::get_map))
        .routes(routes!(maps::get_grid))
        .routes(routes!(maps::get_grid_pgm))
        .routes(routes!(maps::get_grid_png))
        .routes(routes!(maps::get_grid_yaml))
        .routes(routes!(maps::get_graph_g2o))
        .routes(routes!(maps::get_map_tum))
        .routes(routes!(maps::get_picture_png))
        .routes(routes!(maps::get_picture_svg))
        .routes(routes!(localizations::open_localization))
        .routes(routes!(localizations::get_localization, localizations::close_localization))
        .routes(routes!(localizations::localize))
        .routes(routes!(localizations::query_example))
        .routes(routes!(queries::query_words))
        .routes(routes!(queries::query_words_everywhere))
        .routes(routes!(labels::list_labels))
        .routes(routes!(labels::query_labels))
        .routes(routes!(places::list_places))
        .routes(routes!(places::get_route))
        .routes(routes!(changes::list_changes))
        .routes(routes!(localizations::query_example_everywhere))
}

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
        .merge(SwaggerUi::new("/docs").url("/openapi.json", openapi::document()))
        .fallback(async || ApiError::not_found("there is no such path; see /docs"))
        .layer(DefaultBodyLimit::max(limits.body_bytes_max))
        .layer(RequestDecompressionLayer::new())
        .layer(CompressionLayer::new())
        .layer(CatchPanicLayer::custom(|_| {
            ApiError::of_status(StatusCode::INTERNAL_SERVER_ERROR).into_response()
        }))
        .layer(TimeoutLayer::with_status_code(
            StatusCode::REQUEST_TIMEOUT,
            Duration::from_secs(limits.request_timeout_s),
        ))
        .layer(middleware::from_fn(problems_only))
        .layer(middleware::from_fn_with_state(slots, bound))
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
