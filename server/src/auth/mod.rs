//! Who may do what. A request is identified once, by its key; what it may do follows from the route that it meets.
//!
//! ```text
//! identify (whose key is this?) ─► router ─► the route's own rule (scope, site of the path) ─► handler
//! ```

mod issued;
mod keys;
mod origin;
mod rules;

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::Response;

pub use issued::IssuedKey;
pub(crate) use keys::now_s;
pub use keys::{Identity, Keys, NotIdentified};
pub use origin::LocalCallers;
pub use rules::{Rule, Ruled};

use crate::config::Scope;
use crate::error::ApiError;
use rules::NeededScope;

/// What identifies requests.
pub struct Gate {
    /// The known keys.
    pub keys: Keys,
    /// Who may speak to a server that has none.
    pub callers: LocalCallers,
}

/// What is known of a request's sender; an extension of every request, read by the rules of the routes.
#[derive(Clone, Debug)]
struct Caller(Result<Identity, ApiError>);

/// Who asked for what; an extension of every answer, for the log.
#[derive(Clone, Debug)]
pub struct Asked {
    /// The name of the key.
    pub key: Option<Arc<str>>,
    /// The scope that the route needs.
    pub scope: Option<Scope>,
}

/// Finds out who asks, without refusing anybody yet: routes that need nothing stay open to all.
pub async fn identify(State(gate): State<Arc<Gate>>, mut request: Request, next: Next) -> Response {
    let caller = gate.identify(&request);
    let key = caller.as_ref().ok().map(|identity| Arc::clone(identity.name()));
    request.extensions_mut().insert(Caller(caller));
    let mut response = next.run(request).await;
    let scope = response.extensions().get::<NeededScope>().map(|needed| needed.0);
    response.extensions_mut().insert(Asked { key, scope });
    response
}

/// Whether a request's sender is known; what it may do is another question.
pub(crate) fn is_identified(request: &Request) -> bool {
    request.extensions().get::<Caller>().is_some_and(|caller| caller.0.is_ok())
}

impl Gate {
    fn identify(&self, request: &Request) -> Result<Identity, ApiError> {
        if self.keys.is_empty() {
            self.callers.check(request)?;
            return Ok(Identity::local());
        }
        let authorization =
            request.headers().get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
        self.keys.identify(authorization).map_err(|reason| match reason {
            NotIdentified::Unknown => ApiError::unauthorized("send a known key as `Authorization: Bearer …`"),
            NotIdentified::Expired => ApiError::unauthorized("the key has expired"),
            NotIdentified::TooOften(seconds) => ApiError::too_often(seconds),
        })
    }
}
