//! Sites that other servers serve, as the handlers of questions about all sites see them.

use std::collections::BTreeSet;
use std::sync::Arc;

use async_trait::async_trait;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::Response;
use bytes::Bytes;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::app::{AppError, Name};
use crate::auth::{self, Identity};
use crate::error::ApiError;
use crate::state::AppState;

/// Names the sites that did not answer a question about all sites, parted by commas.
pub const UNANSWERED: HeaderName = HeaderName::from_static("locution-unanswered");

/// What a site that is served elsewhere said.
#[derive(Clone, Debug)]
pub enum Answer {
    /// The body of an answer with 2xx.
    Found(Bytes),
    /// It has nothing to say to this question, as a site without a map has not.
    Refused,
    /// It did not answer in time.
    None,
}

/// A request after the other servers had a look at it.
#[derive(Debug)]
pub enum Passed {
    /// It is to be served here.
    Here(Request),
    /// Another server has answered it, or nobody can.
    Answered(Response),
}

/// The other servers.
#[async_trait]
pub trait Elsewhere: Send + Sync {
    /// Passes a request on when another server serves its site.
    async fn pass_on(&self, request: Request) -> Passed;

    /// Whether this server serves a site.
    fn serves(&self, site: &str) -> bool;

    /// Puts a question to sites that are served elsewhere: to `path` below each site, with the headers, and so the key,
    /// of who asked. Takes bounded time.
    async fn ask(
        &self,
        sites: Vec<Name>,
        path: &str,
        headers: &HeaderMap,
        body: Option<Bytes>,
    ) -> Vec<(Name, Answer)>;
}

/// Passes requests for sites of other servers on; everything else, and whoever is not known, is answered here.
pub async fn forward(
    State(elsewhere): State<Option<Arc<dyn Elsewhere>>>,
    request: Request,
    next: Next,
) -> Response {
    let Some(elsewhere) = elsewhere.filter(|_| auth::is_identified(&request)) else {
        return next.run(request).await;
    };
    match elsewhere.pass_on(request).await {
        Passed::Here(request) => next.run(request).await,
        Passed::Answered(answer) => answer,
    }
}

/// What the sites of other servers answered to a question.
#[derive(Debug)]
pub struct Answers<T> {
    /// What was found, site by site.
    pub found: Vec<T>,
    /// The sites that did not answer.
    pub unanswered: BTreeSet<Name>,
}

impl<T: DeserializeOwned> Answers<T> {
    /// Puts a question to all sites that a key may see and other servers serve; none when there is one server.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn to(
        state: &AppState,
        identity: &Identity,
        path: &str,
        headers: &HeaderMap,
        question: &(impl Serialize + Sync),
    ) -> Result<Self, ApiError> {
        let Some(elsewhere) = &state.elsewhere else {
            return Ok(Self { found: Vec::new(), unanswered: BTreeSet::new() });
        };
        let mut sites = state.app.site_names().await?;
        sites.retain(|site| identity.may_see(site.as_str()) && !elsewhere.serves(site.as_str()));
        let body = serde_json::to_vec(question).map_err(AppError::internal)?;
        Ok(Self::read(elsewhere.ask(sites, path, headers, Some(body.into())).await))
    }

    /// Reads what sites answered.
    pub fn read(answers: Vec<(Name, Answer)>) -> Self {
        let (mut found, mut unanswered) = (Vec::new(), BTreeSet::new());
        for (site, answer) in answers {
            match answer {
                Answer::Found(bytes) => match serde_json::from_slice(&bytes) {
                    Ok(answer) => found.push(answer),
                    Err(error) => {
                        tracing::warn!(%site, %error, "the answer of another server cannot be read");
                        unanswered.insert(site);
                    }
                },
                Answer::Refused => {}
                Answer::None => {
                    unanswered.insert(site);
                }
            }
        }
        Self { found, unanswered }
    }

    /// The header that names the sites that did not answer, when there are any.
    pub fn as_header(&self) -> Option<[(HeaderName, HeaderValue); 1]> {
        if self.unanswered.is_empty() {
            return None;
        }
        let names = self.unanswered.iter().map(Name::as_str).collect::<Vec<_>>().join(",");
        HeaderValue::try_from(names).ok().map(|names| [(UNANSWERED, names)])
    }
}
