//! The OpenAPI document, built from the same list as the router.
//!
//! What a handler alone knows stands at the handler: its answers, its own refusals. What holds for all of them is
//! added here by rule, so that no route can forget it: see `rules` and `names`.

mod names;
mod node;
mod rules;

use std::sync::LazyLock;

use utoipa::OpenApi;

use super::routes::routes;
use crate::error::Problem;
use node::Node;

/// Title and tags; paths and schemas come with the routes.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "Locution",
        description = "A query-oriented place-recognition database server: robots post scans and odometry, the \
                       server answers where they have been before and serves the merged map.\n\n\
                       Meters, radians, nanoseconds. Integers of format `int64` may be larger than JavaScript's \
                       numbers hold, which matters for nanoseconds: see `docs/api-design.md`. Answers may gain \
                       members in later versions; requests with unknown members are refused."
    ),
    servers((url = "http://127.0.0.1:7070", description = "The server's address unless configured otherwise")),
    components(schemas(Problem)),
    tags(
        (name = "sites", description = "Buildings: namespaces in which places are matched"),
        (name = "runs", description = "Recordings, sent in batches"),
        (name = "texts", description = "What a run became: observations, words, poses"),
        (name = "jobs", description = "Long work: builds of maps"),
        (name = "maps", description = "Maps, their versions and forms, and the matches that hold them together"),
        (name = "localization", description = "Where am I, and where was this recorded"),
        (name = "keys", description = "Who may do what; for administrators"),
        (name = "operations", description = "Health, readiness, metrics"),
    )
)]
struct Document;

/// The whole document as JSON, as it is served and checked in.
pub fn document_json() -> &'static str {
    static JSON: LazyLock<String> = LazyLock::new(|| {
        serde_json::to_string_pretty(&document()).expect("a document of strings and numbers is JSON") + "\n"
    });
    &JSON
}

fn document() -> Node {
    let mut document = Document::openapi();
    document.merge(routes().split_for_parts().1);
    let json = document.to_json().expect("a document of strings and numbers is JSON");
    let mut document: Node = serde_json::from_str(&json).expect("the document was just written as JSON");
    names::plain(&mut document);
    rules::apply(&mut document);
    document
}
