//! What each route asks of a key. The rule is part of the route: there is no way to add one without the other, and
//! the document shows it.

use std::sync::Arc;

use axum::extract::{RawPathParams, Request};
use axum::http::StatusCode;
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Response};
use utoipa::openapi::path::{Operation, PathItem};
use utoipa::openapi::security::SecurityRequirement;
use utoipa_axum::router::{OpenApiRouter, UtoipaMethodRouter};

use super::{Caller, Identity};
use crate::app::AppError;
use crate::config::Scope;
use crate::error::ApiError;
use crate::intake::{self, Intake, Places};

/// Name of the security scheme in the document.
const SCHEME: &str = "key";

/// What a route asks of whoever calls it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Need {
    /// Nothing; anybody may call it.
    Nothing,
    /// A key of at least this scope that may touch the `{site}` of the path, when the path has one. A route without a
    /// site shows only what concerns the sites of the key.
    Key(Scope),
}

/// What a route asks for and takes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rule {
    need: Need,
    intake: Intake,
}

impl Rule {
    /// Open to everybody, at once.
    pub const OPEN: Self = Self { need: Need::Nothing, intake: Intake::Exempt };

    /// For keys of a scope; takes small documents.
    pub const fn of(scope: Scope) -> Self {
        Self { need: Need::Key(scope), intake: Intake::Small }
    }

    /// Takes scans in.
    pub const fn with_scans(self) -> Self {
        Self { intake: Intake::Scans, ..self }
    }

    /// Takes in a stream of any length, which its handler reads piece by piece.
    pub const fn with_stream(self) -> Self {
        Self { intake: Intake::Stream, ..self }
    }

    /// Takes nothing in and answers whatever else goes on.
    pub const fn at_once(self) -> Self {
        Self { intake: Intake::Exempt, ..self }
    }
}

/// Routes that come with their rule.
pub trait Ruled<S> {
    /// Adds routes that share a rule.
    fn ruled(self, rule: Rule, routes: UtoipaMethodRouter<S>) -> Self;
}

impl<S: Clone + Send + Sync + 'static> Ruled<S> for OpenApiRouter<S> {
    fn ruled(self, rule: Rule, (schemas, mut paths, methods): UtoipaMethodRouter<S>) -> Self {
        for operation in paths.paths.values_mut().flat_map(operations) {
            operation.security = Some(rule.need.as_security());
        }
        let check =
            move |params: RawPathParams, request: Request, next: Next| check(rule, params, request, next);
        self.routes((schemas, paths, methods.route_layer(from_fn(check))))
    }
}

impl Need {
    /// How the document says it: without configured keys nothing needs one.
    fn as_security(self) -> Vec<SecurityRequirement> {
        match self {
            Self::Nothing => Vec::new(),
            Self::Key(scope) => {
                vec![SecurityRequirement::default(), SecurityRequirement::new(SCHEME, [scope.as_str()])]
            }
        }
    }

    fn refusal(self, identity: &Identity, site: Option<&str>) -> Option<ApiError> {
        let Self::Key(scope) = self else { return None };
        let detail = if identity.scope() < scope {
            format!("this needs a key of scope {}", scope.as_str())
        } else if site.is_some_and(|site| !identity.may_see(site)) {
            "the key does not cover this site".to_owned()
        } else {
            return None;
        };
        let title = "The key does not allow this";
        Some(ApiError::new(StatusCode::FORBIDDEN, "forbidden", title, detail))
    }
}

fn operations(item: &mut PathItem) -> impl Iterator<Item = &mut Operation> {
    let PathItem { get, put, post, delete, options, head, patch, trace, .. } = item;
    [get, put, post, delete, options, head, patch, trace].into_iter().flatten()
}

/// What the route needed; an extension of its answers.
#[derive(Clone, Copy, Debug)]
pub(super) struct NeededScope(pub(super) Scope);

/// Serves a request by the rule of its route.
async fn check(rule: Rule, params: RawPathParams, request: Request, next: Next) -> Response {
    let mut response = serve(rule, params, request, next).await;
    if let Need::Key(scope) = rule.need {
        response.extensions_mut().insert(NeededScope(scope));
    }
    response
}

async fn serve(rule: Rule, params: RawPathParams, mut request: Request, next: Next) -> Response {
    let caller = request.extensions().get::<Caller>().cloned();
    let identity = match (rule.need, caller) {
        (Need::Nothing, _) => return next.run(request).await,
        (Need::Key(_), Some(Caller(Ok(identity)))) => identity,
        (Need::Key(_), Some(Caller(Err(refusal)))) => return refusal.into_response(),
        (Need::Key(_), None) => {
            return ApiError::from(AppError::internal("a request without a caller")).into_response();
        }
    };
    let site = params.iter().find_map(|(name, value)| (name == "site").then_some(value));
    if let Some(refusal) = rule.need.refusal(&identity, site) {
        return refusal.into_response();
    }
    let Some(places) = request.extensions().get::<Arc<Places>>().map(Arc::clone) else {
        return ApiError::from(AppError::internal("a request without places")).into_response();
    };
    request.extensions_mut().insert(identity.clone());
    intake::serve(&places, rule.intake, &identity, request, next).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_needs_the_scope_and_the_site() {
        let identity = Identity::new("robot", Scope::Write, &["a"]);
        let may = |scope, site| Need::Key(scope).refusal(&identity, site).is_none();
        assert!(may(Scope::Read, Some("a")) && may(Scope::Write, Some("a")) && may(Scope::Write, None));
        assert!(!may(Scope::Admin, Some("a")) && !may(Scope::Read, Some("b")));
        assert!(Need::Nothing.refusal(&identity, Some("b")).is_none());
    }
}
