//! What the cluster does for requests: those for sites of other servers are passed on, and questions about all sites
//! are put to the servers of those that are not here.

use std::time::Duration;

use async_trait::async_trait;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, Method, header};
use axum::response::IntoResponse;
use bytes::Bytes;
use futures::{StreamExt, stream};

use super::Cluster;
use super::forward::{moving, site_of, was_passed_on};
use super::members::Owner;
use crate::app::Name;
use crate::elsewhere::{Answer, Elsewhere, Passed};

/// Sites of other servers that one question is put to at once.
const NUM_ASKED_AT_ONCE: usize = 16;
/// A site that has not answered by then counts as one that did not.
const ANSWER_MAX: Duration = Duration::from_secs(20);

#[async_trait]
impl Elsewhere for Cluster {
    async fn pass_on(&self, request: Request) -> Passed {
        let Some(site) = site_of(request.uri()) else { return Passed::Here(request) };
        match self.members.owner(site) {
            Owner::Me => Passed::Here(request),
            Owner::Other(url) if !was_passed_on(&request) => {
                let outcome = self.send_on(&url, request).await;
                Passed::Answered(outcome.unwrap_or_else(|error| error.into_response()))
            }
            Owner::Other(_) | Owner::Nobody => Passed::Answered(moving().into_response()),
        }
    }

    fn serves(&self, site: &str) -> bool {
        self.members.owner(site) == Owner::Me
    }

    async fn ask(
        &self,
        sites: Vec<Name>,
        path: &str,
        headers: &HeaderMap,
        body: Option<Bytes>,
    ) -> Vec<(Name, Answer)> {
        let deadline = tokio::time::Instant::now() + ANSWER_MAX;
        let asked = stream::iter(sites).map(|site| {
            let body = body.clone();
            async move {
                let asking = self.ask_site(site.as_str(), path, headers, body);
                let answer = tokio::time::timeout_at(deadline, asking).await;
                (site, answer.unwrap_or(Answer::None))
            }
        });
        asked.buffered(NUM_ASKED_AT_ONCE).collect().await
    }
}

impl Cluster {
    async fn ask_site(&self, site: &str, path: &str, headers: &HeaderMap, body: Option<Bytes>) -> Answer {
        let Owner::Other(url) = self.members.owner(site) else { return Answer::None };
        let method = if body.is_some() { Method::POST } else { Method::GET };
        let mut headers = headers.clone();
        headers.remove(header::CONTENT_LENGTH);
        headers.remove(header::CONTENT_ENCODING);
        if body.is_some() {
            headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
        }
        let path = format!("/v1/sites/{site}{path}");
        let Ok(answer) = self.send(&url, method, &path, &headers, body.unwrap_or_default().into()).await
        else {
            return Answer::None;
        };
        let status = answer.status();
        match answer.bytes().await {
            Ok(bytes) if status.is_success() => Answer::Found(bytes),
            Ok(_) if status.is_client_error() => Answer::Refused,
            _ => Answer::None,
        }
    }
}
