//! The service: routes, documentation, and the layers around them.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::{DefaultBodyLimit, Request};
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;
use axum::{Router, middleware};
use tower::util::option_layer;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::cors::{AllowOrigin, CorsLayer};
use tower_http::decompression::RequestDecompressionLayer;
use tower_http::timeout::TimeoutLayer;
use utoipa_swagger_ui::SwaggerUi;

use crate::auth;
use crate::config::WebConfig;
use crate::elsewhere;
use crate::error::ApiError;
use crate::http::routes::routes;
use crate::http::{nanoseconds, openapi, page, with_version};
use crate::intake;
use crate::observe::{REQUEST_ID, observe};
use crate::state::AppState;

/// The service: routes, documentation, limits, keys.
pub fn build_router(state: AppState) -> Router {
    let limits = state.app.config().limits.clone();
    let web = state.app.config().web.clone();
    let places = Arc::clone(&state.places);
    let (routes, _) = routes().split_for_parts();
    routes
        .method_not_allowed_fallback(async || ApiError::of_status(StatusCode::METHOD_NOT_ALLOWED))
        .layer(middleware::from_fn_with_state(state.elsewhere.clone(), elsewhere::forward))
        .layer(middleware::from_fn_with_state(Arc::clone(&state.gate), auth::identify))
        .with_state(state)
        .route("/", get(async || Redirect::temporary("/ui")))
        .route("/ui/{file}", get(page::file))
        .route("/openapi.json", get(document))
        .merge(SwaggerUi::new("/docs").config(utoipa_swagger_ui::Config::from("/openapi.json")))
        .fallback(async || ApiError::not_found("there is no such path; see /docs"))
        // Bodies are read by the rules of the routes, each up to its own limit.
        .layer(DefaultBodyLimit::disable())
        .layer(RequestDecompressionLayer::new())
        .layer(middleware::from_fn(nanoseconds::as_asked))
        .layer(CompressionLayer::new())
        .layer(middleware::from_fn_with_state(places, intake::prepare))
        .layer(CatchPanicLayer::custom(|_| {
            ApiError::of_status(StatusCode::INTERNAL_SERVER_ERROR).into_response()
        }))
        .layer(TimeoutLayer::with_status_code(
            StatusCode::REQUEST_TIMEOUT,
            Duration::from_secs(limits.request_timeout_s),
        ))
        .layer(middleware::from_fn(problems_only))
        .layer(middleware::map_response(with_version))
        .layer(middleware::from_fn(observe))
        .layer(option_layer((!web.origins.is_empty()).then(|| cross_origin(&web))))
}

/// What browsers are told about pages from elsewhere.
fn cross_origin(web: &WebConfig) -> CorsLayer {
    let origins = web.origins.iter().filter_map(|origin| HeaderValue::from_str(origin).ok());
    CorsLayer::new()
        .allow_origin(AllowOrigin::list(origins))
        .allow_methods([Method::GET, Method::POST, Method::PUT, Method::PATCH, Method::DELETE])
        .allow_headers([
            header::AUTHORIZATION,
            header::CONTENT_TYPE,
            header::CONTENT_ENCODING,
            header::IF_NONE_MATCH,
            HeaderName::from_static("last-event-id"),
            REQUEST_ID,
        ])
        .expose_headers([header::ETAG, header::LOCATION, header::RETRY_AFTER, REQUEST_ID])
}

/// The document of this API.
async fn document() -> Response {
    ([(header::CONTENT_TYPE, "application/json")], openapi::document_json()).into_response()
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
