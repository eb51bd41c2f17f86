//! From a request to checked arguments: bodies, names, pages. Every refusal names the place of the fault.

use std::collections::HashMap;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{FromRequest, FromRequestParts, Path, Query, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode, Uri, header};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::app::site::Site;
use crate::app::{AppError, Name};
use crate::error::ApiError;
use crate::http::as_documented::AsDocumented;
use crate::http::values::{PageBounds, PageParams};
use crate::http::wording::{located, of_cbor, plain};
use crate::state::AppState;

/// Bodies above this are parsed on a blocking thread.
const NUM_BYTES_PARSED_INLINE: usize = 64 << 10;

/// A JSON or CBOR body; an empty one reads as `{}`.
pub struct Body<T>(pub T);

impl<T: DeserializeOwned + Send + 'static> FromRequest<AppState> for Body<T> {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &AppState) -> Result<Self, ApiError> {
        let format = Format::of(request.headers())?;
        let bytes = Bytes::from_request(request, state)
            .await
            .map_err(|rejection| ApiError::malformed(rejection.body_text()))?;
        if bytes.len() <= NUM_BYTES_PARSED_INLINE {
            return format.parse(&bytes).map(Self);
        }
        let parsed = tokio::task::spawn_blocking(move || format.parse(&bytes)).await;
        parsed.map_err(|error| ApiError::from(AppError::internal(error)))?.map(Self)
    }
}

#[derive(Clone, Copy)]
enum Format {
    Json,
    Cbor,
}

impl Format {
    fn of(headers: &HeaderMap) -> Result<Self, ApiError> {
        let content_type =
            headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
        match content_type.split(';').next().unwrap_or("").trim().to_ascii_lowercase().as_str() {
            "" | "application/json" => Ok(Self::Json),
            "application/cbor" => Ok(Self::Cbor),
            other => {
                let detail =
                    format!("`{other}` is not understood; send application/json or application/cbor");
                let status = StatusCode::UNSUPPORTED_MEDIA_TYPE;
                Err(ApiError::new(status, "media-type", "Unsupported media type", detail))
            }
        }
    }

    fn parse<T: DeserializeOwned>(self, bytes: &[u8]) -> Result<T, ApiError> {
        match self {
            Self::Json => parse_json(if bytes.is_empty() { b"{}" } else { bytes }),
            Self::Cbor => parse_cbor(bytes),
        }
        .map(|AsDocumented(value)| value)
    }
}

/// Parses without tracking where it is; only a body that fails is read again to name the place.
fn parse_json<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, ApiError> {
    if let Ok(value) = serde_json::from_slice(bytes) {
        return Ok(value);
    }
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    match serde_path_to_error::deserialize(&mut reader) {
        Err(error) => Err(malformed(error.path().to_string(), error.inner())),
        Ok(value) => reader.end().map(|()| value).map_err(|error| malformed(".".into(), &error)),
    }
}

fn parse_cbor<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, ApiError> {
    let mut rest = bytes;
    if let Ok(value) = ciborium::from_reader(&mut rest) {
        if !rest.is_empty() {
            let position = bytes.len() - rest.len();
            return Err(ApiError::malformed(format!(
                "trailing bytes behind the document, from byte {position}"
            )));
        }
        return Ok(value);
    }
    match ciborium::from_reader::<Located<T>, _>(bytes) {
        Ok(Located(value)) => Ok(value),
        Err(ciborium::de::Error::Semantic(_, message)) => match message.split_once(LOCATION_END) {
            Some((path, problem)) => Err(malformed(path.to_owned(), &of_cbor(problem))),
            None => Err(ApiError::malformed(plain(&message))),
        },
        Err(ciborium::de::Error::Io(_)) => Err(ApiError::malformed("the body ends before its CBOR does")),
        Err(ciborium::de::Error::Syntax(offset)) => {
            Err(ApiError::malformed(format!("the body is not CBOR from byte {offset} on")))
        }
        Err(ciborium::de::Error::RecursionLimitExceeded) => {
            Err(ApiError::malformed("the body is nested too deep"))
        }
    }
}

/// Between the path and the problem in an error of [`Located`].
const LOCATION_END: char = '\0';

/// Tracks the place inside formats whose deserialiser cannot be wrapped from outside.
struct Located<T>(T);

impl<'de, T: serde::Deserialize<'de>> serde::Deserialize<'de> for Located<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        serde_path_to_error::deserialize(deserializer).map(Self).map_err(|error| {
            let (path, problem) = (error.path().to_string(), error.into_inner());
            serde::de::Error::custom(format!("{path}{LOCATION_END}{problem}"))
        })
    }
}

fn malformed(path: String, error: &dyn std::fmt::Display) -> ApiError {
    let problem = plain(&error.to_string());
    if path == "." || path.is_empty() {
        return ApiError::malformed(problem);
    }
    ApiError::malformed(format!("{path}: {problem}")).at(path)
}

/// The site named in the path.
pub struct SiteOf(pub Arc<Site>);

impl FromRequestParts<AppState> for SiteOf {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let name = path_name(parts, state, "site").await?;
        Ok(Self(state.app.site(&name).await?))
    }
}

/// The name of a site in the path, which need not exist.
pub struct SiteName(pub Name);

impl FromRequestParts<AppState> for SiteName {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        path_name(parts, state, "site").await.map(Self)
    }
}

/// The name of a run in the path, which need not exist.
pub struct RunName(pub Name);

impl FromRequestParts<AppState> for RunName {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        path_name(parts, state, "run").await.map(Self)
    }
}

/// The name of a channel in the path, which need not exist.
pub struct ChannelName(pub Name);

impl FromRequestParts<AppState> for ChannelName {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        path_name(parts, state, "channel").await.map(Self)
    }
}

/// The name of a robot in the path.
pub struct RobotName(pub Name);

impl FromRequestParts<AppState> for RobotName {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        path_name(parts, state, "robot").await.map(Self)
    }
}

/// A number in the path, such as that of a match or a job.
pub struct IdOf(pub u64);

impl FromRequestParts<AppState> for IdOf {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let text = path_param(parts, state, "id").await?;
        text.parse()
            .map(Self)
            .map_err(|_| ApiError::not_found(format!("there is nothing with the id `{text}`")))
    }
}

async fn path_name(parts: &mut Parts, state: &AppState, param: &str) -> Result<Name, ApiError> {
    Ok(Name::new(&path_param(parts, state, param).await?, param)?)
}

async fn path_param(parts: &mut Parts, state: &AppState, param: &str) -> Result<String, ApiError> {
    let params = Path::<HashMap<String, String>>::from_request_parts(parts, state).await;
    let params = params.map_err(|rejection| ApiError::invalid("path", rejection.body_text()))?;
    params.0.get(param).cloned().ok_or_else(|| ApiError::not_found("the path names no such thing"))
}

/// Query parameters; unknown or unreadable ones answer 400.
pub struct Params<T>(pub T);

impl<T: DeserializeOwned> FromRequestParts<AppState> for Params<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let query = Query::<T>::from_request_parts(parts, state).await;
        query.map(|Query(params)| Self(params)).map_err(|rejection| malformed_query(rejection.body_text()))
    }
}

/// The query parameters of a paged list: its own, and which page.
pub struct Paged<T>(pub T, pub PageBounds);

impl<T: DeserializeOwned> FromRequestParts<AppState> for Paged<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _: &AppState) -> Result<Self, ApiError> {
        let query = parts.uri.query().unwrap_or_default();
        let (page, own): (Vec<&str>, Vec<&str>) = query
            .split('&')
            .partition(|pair| ["limit", "cursor"].contains(&pair.split('=').next().unwrap_or_default()));
        let page: PageParams = parse_query(&page.join("&"))?;
        Ok(Self(parse_query(&own.join("&"))?, page.check()?))
    }
}

fn parse_query<T: DeserializeOwned>(query: &str) -> Result<T, ApiError> {
    let uri = Uri::builder().path_and_query(format!("/?{query}")).build();
    let uri = uri.map_err(|error| malformed_query(error.to_string()))?;
    let Query(params) = Query::try_from_uri(&uri).map_err(|error| malformed_query(error.body_text()))?;
    Ok(params)
}

fn malformed_query(message: String) -> ApiError {
    let detail = plain(&message);
    let error = ApiError::new(StatusCode::BAD_REQUEST, "malformed-query", "Malformed query", &*detail);
    match located(&detail) {
        (Some(field), _) => error.at(field),
        (None, _) => error,
    }
}

/// The query of a list that has no parameters of its own.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoParams {}

/// Whether the client asks for plain text rather than JSON.
pub struct WantsText(pub bool);

impl FromRequestParts<AppState> for WantsText {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _: &AppState) -> Result<Self, ApiError> {
        let accept = parts.headers.get(header::ACCEPT).and_then(|value| value.to_str().ok()).unwrap_or("");
        Ok(Self(accept.contains("text/plain") && !accept.contains("application/json")))
    }
}
