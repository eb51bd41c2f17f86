//! Requests with patience: busy servers are asked again when they said to.

use std::time::Duration;

use reqwest::header::{ACCEPT, AUTHORIZATION, CONTENT_TYPE, RETRY_AFTER};
use reqwest::{Method, Response, StatusCode};
use rustls::crypto::CryptoProvider;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::time::{Instant, sleep};

use crate::error::{ClientError, Problem};
use crate::routes::{self, Query, Route};

/// When to ask again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RetryPolicy {
    /// No request is repeated after this long.
    pub patience: Duration,
    /// First pause where the server names none; doubled every time.
    pub first_pause: Duration,
    /// Longest pause where the server names none.
    pub longest_pause: Duration,
}

impl Default for RetryPolicy {
    fn default() -> Self {
        Self {
            patience: Duration::from_secs(60),
            first_pause: Duration::from_millis(100),
            longest_pause: Duration::from_secs(5),
        }
    }
}

/// A connection to one server. Cheap to clone; clones share their connections.
#[derive(Clone, Debug)]
pub struct Client {
    http: reqwest::Client,
    base_url: String,
    api_key: Option<String>,
    retry: RetryPolicy,
}

/// What a request carries.
pub(crate) enum Body {
    Empty,
    Json(Vec<u8>),
    Cbor(Vec<u8>),
    Octets(Vec<u8>),
}

impl Body {
    pub(crate) fn json<T: Serialize>(value: &T) -> Result<Self, ClientError> {
        serde_json::to_vec(value).map(Self::Json).map_err(|error| ClientError::Request(error.to_string()))
    }

    pub(crate) fn cbor<T: Serialize>(value: &T) -> Result<Self, ClientError> {
        let mut bytes = Vec::new();
        ciborium::into_writer(value, &mut bytes).map_err(|error| ClientError::Request(error.to_string()))?;
        Ok(Self::Cbor(bytes))
    }
}

/// Chooses the ciphers of TLS for this process, unless somebody has; `reqwest` makes no client before that.
/// [`Client::new`] does it by itself.
pub fn choose_ciphers() {
    if CryptoProvider::get_default().is_none() {
        // Another thread may have been faster, which is as good.
        let _ = rustls::crypto::ring::default_provider().install_default();
    }
}

impl Client {
    /// A client of the server at `base_url`, such as `http://127.0.0.1:7070`.
    ///
    /// # Errors
    /// The HTTP library cannot start.
    pub fn new(base_url: &str) -> Result<Self, ClientError> {
        choose_ciphers();
        let http = reqwest::Client::builder()
            .connect_timeout(Duration::from_secs(10))
            .build()
            .map_err(ClientError::Transport)?;
        let base_url = base_url.trim_end_matches('/').to_owned();
        Ok(Self { http, base_url, api_key: None, retry: RetryPolicy::default() })
    }

    /// The same client with an API key.
    #[must_use]
    pub fn with_api_key(self, api_key: impl Into<String>) -> Self {
        Self { api_key: Some(api_key.into()), ..self }
    }

    /// The same client with another patience.
    #[must_use]
    pub fn with_retry(self, retry: RetryPolicy) -> Self {
        Self { retry, ..self }
    }

    /// Address of the server, without a slash at its end.
    pub fn base_url(&self) -> &str {
        &self.base_url
    }

    /// Sends a request and repeats it while the server is busy or does not answer. Every request of this API may
    /// be repeated: batches are idempotent by their sequence number.
    pub(crate) async fn send(
        &self,
        method: Method,
        path: &str,
        accept: &str,
        body: Body,
    ) -> Result<Response, ClientError> {
        let deadline = Instant::now() + self.retry.patience;
        let mut pause = self.retry.first_pause;
        let (content_type, bytes) = match body {
            Body::Empty => (None, Vec::new()),
            Body::Json(bytes) => (Some("application/json"), bytes),
            Body::Cbor(bytes) => (Some("application/cbor"), bytes),
            Body::Octets(bytes) => (Some("application/octet-stream"), bytes),
        };
        // Shared, so that a repetition does not copy it.
        let bytes = bytes::Bytes::from(bytes);
        loop {
            let mut request =
                self.http.request(method.clone(), format!("{}{path}", self.base_url)).header(ACCEPT, accept);
            if let Some(api_key) = &self.api_key {
                request = request.header(AUTHORIZATION, format!("Bearer {api_key}"));
            }
            if let Some(content_type) = content_type {
                request = request.header(CONTENT_TYPE, content_type).body(bytes.clone());
            }
            let (failure, wait) = match request.send().await {
                Ok(response) if response.status().is_success() => return Ok(response),
                Ok(response) => {
                    let is_busy = matches!(
                        response.status(),
                        StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE
                    );
                    let wait = retry_after(&response).unwrap_or(pause);
                    let refusal = refusal(response).await;
                    if !is_busy {
                        return Err(refusal);
                    }
                    (refusal, wait)
                }
                Err(error) if error.is_builder() => return Err(ClientError::Request(error.to_string())),
                Err(error) => (ClientError::Transport(error), pause),
            };
            if Instant::now() + wait > deadline {
                return Err(failure);
            }
            sleep(wait).await;
            pause = (2 * pause).min(self.retry.longest_pause);
        }
    }

    /// The JSON answer of an operation.
    pub(crate) async fn answer<T: DeserializeOwned>(
        &self,
        route: &Route,
        names: &[&str],
        query: &Query,
        body: Body,
    ) -> Result<T, ClientError> {
        let path = query.after(route.with(names));
        let response = self.send(route.method.clone(), &path, "application/json", body).await?;
        let bytes = response.bytes().await.map_err(ClientError::Transport)?;
        serde_json::from_slice(&bytes)
            .map_err(|error| ClientError::Answer { path: path.clone(), problem: error.to_string() })
    }

    /// The JSON answer of an operation that may have nothing to say.
    pub(crate) async fn answer_if_any<T: DeserializeOwned>(
        &self,
        route: &Route,
        names: &[&str],
    ) -> Result<Option<T>, ClientError> {
        let path = route.with(names);
        let response = self.send(route.method.clone(), &path, "application/json", Body::Empty).await?;
        let bytes = response.bytes().await.map_err(ClientError::Transport)?;
        if bytes.is_empty() {
            return Ok(None);
        }
        serde_json::from_slice(&bytes)
            .map(Some)
            .map_err(|error| ClientError::Answer { path, problem: error.to_string() })
    }

    /// The JSON answer of an operation that only looks.
    pub(crate) async fn get<T: DeserializeOwned>(
        &self,
        route: &Route,
        names: &[&str],
        query: &Query,
    ) -> Result<T, ClientError> {
        self.answer(route, names, query, Body::Empty).await
    }

    /// An operation whose answer says nothing more.
    pub(crate) async fn done(&self, route: &Route, names: &[&str], body: Body) -> Result<(), ClientError> {
        self.send(route.method.clone(), &route.with(names), "application/json", body).await.map(drop)
    }

    /// The answer of an operation as it is.
    pub(crate) async fn bytes(
        &self,
        route: &Route,
        names: &[&str],
        query: &Query,
    ) -> Result<Vec<u8>, ClientError> {
        self.download(&query.after(route.with(names)), "*/*").await
    }

    /// Any document of the API as it is, such as `/v1/sites/office/map/picture.png`.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn download(&self, path: &str, accept: &str) -> Result<Vec<u8>, ClientError> {
        let response = self.send(Method::GET, path, accept, Body::Empty).await?;
        Ok(response.bytes().await.map_err(ClientError::Transport)?.to_vec())
    }

    /// Whether the server is ready to work; asked once, without patience.
    pub async fn is_ready(&self) -> bool {
        self.answers(&routes::GET_READINESS).await
    }

    /// Whether the process lives; asked once, without patience.
    pub async fn is_alive(&self) -> bool {
        self.answers(&routes::GET_HEALTH).await
    }

    async fn answers(&self, route: &Route) -> bool {
        let answer = self.http.get(format!("{}{}", self.base_url, route.with(&[]))).send().await;
        answer.is_ok_and(|response| response.status().is_success())
    }

    /// Counters and histograms of the server in Prometheus' text format.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn metrics(&self) -> Result<Vec<u8>, ClientError> {
        self.bytes(&routes::GET_METRICS, &[], &Query::default()).await
    }

    /// Where a person looks at sites, runs and maps.
    pub fn page_url(&self) -> String {
        format!("{}{}", self.base_url, routes::GET_UI.with(&[]))
    }
}

fn retry_after(response: &Response) -> Option<Duration> {
    let seconds = response.headers().get(RETRY_AFTER)?.to_str().ok()?.parse().ok()?;
    Some(Duration::from_secs(seconds))
}

async fn refusal(response: Response) -> ClientError {
    let status = response.status().as_u16();
    let text = response.text().await.unwrap_or_default();
    let mut problem = serde_json::from_str::<Problem>(&text)
        .unwrap_or_else(|_| Problem { detail: text.chars().take(300).collect(), ..Problem::default() });
    problem.status = status;
    ClientError::Refused(Box::new(problem))
}
