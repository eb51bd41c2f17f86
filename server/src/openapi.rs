//! The OpenAPI document, built from the same list as the router.

use utoipa::OpenApi;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};

use crate::router;

/// Title and tags; paths and schemas come with the routes.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "Locution",
        description = "A query-oriented place-recognition database server: robots post scans and odometry, the \
                       server answers where they have been before and serves the merged map. Meters, radians, \
                       nanoseconds."
    ),
    tags(
        (name = "sites", description = "Buildings: namespaces in which places are matched"),
        (name = "runs", description = "Recordings, sent in batches"),
        (name = "texts", description = "What a run became: observations, words, poses"),
        (name = "jobs", description = "Long work: builds of maps"),
        (name = "maps", description = "Maps, their versions and forms, and the matches that hold them together"),
        (name = "localization", description = "Where am I, and where was this recorded"),
        (name = "operations", description = "Health, readiness, metrics"),
    )
)]
pub(crate) struct Document;

/// The whole document.
pub fn document() -> utoipa::openapi::OpenApi {
    let (_, mut document) = router::routes().split_for_parts();
    let bearer = SecurityScheme::Http(HttpBuilder::new().scheme(HttpAuthScheme::Bearer).build());
    document.components.get_or_insert_default().add_security_scheme("key", bearer);
    document.security =
        Some(vec![SecurityRequirement::default(), SecurityRequirement::new::<_, [&str; 0], &str>("key", [])]);
    document
}
