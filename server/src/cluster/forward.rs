//! A request on its way to the server that serves its site, and the answer on its way back.

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Uri, header};
use axum::response::Response;

use super::Cluster;
use crate::app::AppError;
use crate::error::ApiError;

/// Says that a request was passed on already. A second time it is not: two servers that disagree would play ball.
const FORWARDED: HeaderName = HeaderName::from_static("locution-forwarded");

/// What belongs to one connection and not to the request (RFC 9110, 7.6.1), the host, which changes, and the encoding
/// of answers, which this server chooses for its client by itself.
const OF_ONE_CONNECTION: [HeaderName; 8] = [
    header::ACCEPT_ENCODING,
    header::CONNECTION,
    header::EXPECT,
    header::HOST,
    header::TE,
    header::TRAILER,
    header::TRANSFER_ENCODING,
    header::UPGRADE,
];

/// Whether another server sent this request.
pub(super) fn was_passed_on(request: &Request) -> bool {
    request.headers().contains_key(FORWARDED)
}

/// The site is served by nobody for a moment.
pub(super) fn moving() -> ApiError {
    AppError::Elsewhere.into()
}

/// The site that a path names.
pub(super) fn site_of(uri: &Uri) -> Option<&str> {
    let rest = uri.path().strip_prefix("/v1/sites/")?;
    let site = rest.split('/').next().unwrap_or_default();
    (!site.is_empty()).then_some(site)
}

impl Cluster {
    pub(super) async fn send_on(&self, url: &str, request: Request) -> Result<Response, ApiError> {
        let _place = self.places.try_acquire().map_err(|_| ApiError::overloaded())?;
        let (parts, body) = request.into_parts();
        let path = parts.uri.path_and_query().map_or("/", |path| path.as_str());
        let body = reqwest::Body::wrap_stream(body.into_data_stream());
        let answer = self.send(url, parts.method, path, &parts.headers, body).await?;
        let (status, headers) = (answer.status(), passed_on(answer.headers()));
        let mut response = Response::new(Body::from_stream(answer.bytes_stream()));
        *response.status_mut() = status;
        *response.headers_mut() = headers;
        Ok(response)
    }

    /// Sends a request with the headers of the one that caused it, and so with its caller's key.
    pub(super) async fn send(
        &self,
        url: &str,
        method: Method,
        path: &str,
        headers: &HeaderMap,
        body: reqwest::Body,
    ) -> Result<reqwest::Response, ApiError> {
        let mut headers = passed_on(headers);
        headers.insert(FORWARDED, HeaderValue::from_static("1"));
        let request = self.client.request(method, format!("{url}{path}")).headers(headers).body(body);
        request.send().await.map_err(|error| {
            tracing::warn!(%error, url, "a request could not be passed on");
            moving()
        })
    }
}

fn passed_on(headers: &HeaderMap) -> HeaderMap {
    let mut passed = headers.clone();
    for name in OF_ONE_CONNECTION {
        passed.remove(name);
    }
    passed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_paths_below_a_site_belong_to_its_server() {
        let site = |path: &'static str| site_of(&Uri::from_static(path)).map(str::to_owned);
        assert_eq!(site("/v1/sites/office"), Some("office".into()));
        assert_eq!(site("/v1/sites/office/runs?limit=3"), Some("office".into()));
        for path in ["/v1/sites", "/v1/sites/", "/healthz", "/v1/queries/words", "/ui"] {
            assert_eq!(site(path), None, "{path}");
        }
    }
}
