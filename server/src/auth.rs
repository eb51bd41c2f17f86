//! Who may do what: keys by their hashes, scopes by method and path, sites by name.
//!
//! Keys are 256 random bits, so one SHA-256 is enough; hashes are compared in constant time. Everything under `/v1`
//! and `/metrics` asks for a key once the configuration has any; health and documentation stay open.

use axum::extract::{Request, State};
use axum::http::{Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

use crate::config::{ApiKeyConfig, Scope};
use crate::error::ApiError;
use crate::state::AppState;

/// The configured keys.
#[derive(Debug, Default)]
pub struct Keys {
    keys: Vec<Key>,
}

#[derive(Clone, Debug)]
struct Key {
    hash: Vec<u8>,
    identity: Identity,
}

/// Who is asking; an extension of every request.
#[derive(Clone, Debug)]
pub struct Identity {
    scope: Scope,
    sites: Vec<String>,
}

impl Identity {
    /// Whoever asks a server without keys, which is somebody on the same machine.
    fn local() -> Self {
        Self { scope: Scope::Admin, sites: vec!["*".into()] }
    }

    /// Whether a site may be touched at all.
    pub fn may_see(&self, site: &str) -> bool {
        self.sites.iter().any(|allowed| allowed == "*" || allowed == site)
    }
}

impl Keys {
    /// The keys of a checked configuration.
    pub fn new(configs: &[ApiKeyConfig]) -> Self {
        let key = |config: &ApiKeyConfig| Key {
            hash: decode_hex(&config.sha256),
            identity: Identity { scope: config.scope, sites: config.sites.clone() },
        };
        Self { keys: configs.iter().map(key).collect() }
    }

    fn identify(&self, authorization: Option<&str>) -> Option<Identity> {
        if self.keys.is_empty() {
            return Some(Identity::local());
        }
        let token = authorization?.strip_prefix("Bearer ")?.trim();
        let hash = Sha256::digest(token.as_bytes());
        // Every key is compared, so that the time does not tell which one was near.
        let mut found = None;
        for key in &self.keys {
            if bool::from(key.hash.as_slice().ct_eq(hash.as_slice())) {
                found = Some(key.identity.clone());
            }
        }
        found
    }
}

fn decode_hex(text: &str) -> Vec<u8> {
    let digit = |byte: u8| (byte as char).to_digit(16).unwrap_or(0) as u8;
    text.as_bytes()
        .chunks(2)
        .map(|pair| digit(pair[0]) << 4 | pair.get(1).map_or(0, |low| digit(*low)))
        .collect()
}

/// Lets a request pass when its key allows it.
pub async fn authorize(State(state): State<AppState>, mut request: Request, next: Next) -> Response {
    let authorization = request.headers().get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
    let Some(identity) = state.keys.identify(authorization) else {
        let detail = "send a known key as `Authorization: Bearer …`";
        return ApiError::new(StatusCode::UNAUTHORIZED, "unauthorized", "A key is needed", detail)
            .into_response();
    };
    let segments: Vec<&str> = request.uri().path().split('/').filter(|segment| !segment.is_empty()).collect();
    let needed = needed_scope(request.method(), &segments);
    let site =
        segments.get(2).filter(|_| segments.first() == Some(&"v1") && segments.get(1) == Some(&"sites"));
    if identity.scope < needed || site.is_some_and(|site| !identity.may_see(site)) {
        let detail = format!("this needs a key of scope {needed:?} for the site").to_lowercase();
        return ApiError::new(StatusCode::FORBIDDEN, "forbidden", "The key does not allow this", detail)
            .into_response();
    }
    request.extensions_mut().insert(identity);
    next.run(request).await
}

/// Looking and asking is reading, making and deleting sites is for administrators, the rest is writing.
fn needed_scope(method: &Method, segments: &[&str]) -> Scope {
    // A backup holds the whole site, and restoring makes one.
    if segments.len() == 4 && segments[3] == "backup" {
        return Scope::Admin;
    }
    // By its place in the path: a site or a run may be called `queries`.
    let is_question =
        matches!(segments, ["v1", "queries", ..] | ["v1", "sites", _, "queries" | "localisations", ..]);
    if method == Method::GET || method == Method::HEAD || is_question {
        return Scope::Read;
    }
    if segments.len() == 3 { Scope::Admin } else { Scope::Write }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(token: &str, scope: Scope, sites: &[&str]) -> ApiKeyConfig {
        let hash = Sha256::digest(token.as_bytes());
        let sha256 = hash.iter().map(|byte| format!("{byte:02x}")).collect();
        let sites = sites.iter().map(|site| (*site).to_owned()).collect();
        ApiKeyConfig { name: token.into(), sha256, scope, sites }
    }

    #[test]
    fn keys_are_told_apart() {
        let keys = Keys::new(&[config("one", Scope::Read, &["a"]), config("two", Scope::Admin, &["*"])]);
        let one = keys.identify(Some("Bearer one")).unwrap();
        assert!(one.may_see("a") && !one.may_see("b") && one.scope == Scope::Read);
        assert!(keys.identify(Some("Bearer two")).unwrap().may_see("b"));
        for wrong in [None, Some("Bearer three"), Some("one"), Some("Bearer ")] {
            assert!(keys.identify(wrong).is_none());
        }
    }

    #[test]
    fn scopes_follow_method_and_path() {
        let needed = |method: Method, path: &str| needed_scope(&method, &path.split('/').collect::<Vec<_>>());
        assert_eq!(needed(Method::GET, "v1/sites/a"), Scope::Read);
        assert_eq!(needed(Method::POST, "v1/sites/a/queries/words"), Scope::Read);
        assert_eq!(needed(Method::DELETE, "v1/sites/a"), Scope::Admin);
        assert_eq!(needed(Method::GET, "v1/sites/a/backup"), Scope::Admin);
        assert_eq!(needed(Method::PUT, "v1/sites/a/backup"), Scope::Admin);
        assert_eq!(needed(Method::PUT, "v1/sites/a/runs/r"), Scope::Write);
        assert_eq!(needed(Method::POST, "v1/sites/a/runs/r/batches"), Scope::Write);
    }

    #[test]
    fn names_of_sites_and_runs_give_no_rights() {
        let needed = |method: Method, path: &str| needed_scope(&method, &path.split('/').collect::<Vec<_>>());
        for name in ["queries", "localisations"] {
            assert_eq!(needed(Method::PUT, &format!("v1/sites/{name}")), Scope::Admin);
            assert_eq!(needed(Method::DELETE, &format!("v1/sites/{name}")), Scope::Admin);
            assert_eq!(needed(Method::PUT, &format!("v1/sites/a/runs/{name}")), Scope::Write);
            assert_eq!(needed(Method::POST, &format!("v1/sites/{name}/runs/{name}/batches")), Scope::Write);
            assert_eq!(needed(Method::POST, &format!("v1/sites/a/runs/{name}/finish")), Scope::Write);
        }
        assert_eq!(needed(Method::POST, "v1/queries/words"), Scope::Read);
        assert_eq!(needed(Method::POST, "v1/sites/a/localisations/7/batches"), Scope::Read);
    }
}
