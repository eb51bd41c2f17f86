//! Nanoseconds as strings, for clients whose numbers hold 53 bits.
//!
//! `Accept: application/json; nanoseconds=string` asks for it: every member whose name ends with `_ns` becomes a string.
//! Requests may always carry strings there.

use std::fmt;

use axum::body::{Body, to_bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::de::{Unexpected, Visitor};
use serde::{Deserializer, Serializer};

use crate::app::AppError;
use crate::error::ApiError;

/// Ends the name of a member with nanoseconds; inside of a JSON string its quote would be escaped.
const END_OF_NAME: &[u8] = b"_ns\":";

/// Rewrites the JSON answers of clients that asked for strings.
pub(crate) async fn as_asked(request: Request, next: Next) -> Response {
    let asks = asks_for_strings(request.headers());
    let response = next.run(request).await;
    let is_json =
        response.headers().get(header::CONTENT_TYPE) == Some(&HeaderValue::from_static("application/json"));
    if !asks || !is_json {
        return response;
    }
    let (mut parts, body) = response.into_parts();
    match to_bytes(body, usize::MAX).await {
        Ok(bytes) => {
            parts.headers.remove(header::CONTENT_LENGTH);
            Response::from_parts(parts, Body::from(quoted(&bytes)))
        }
        Err(error) => ApiError::from(AppError::internal(error)).into_response(),
    }
}

fn asks_for_strings(headers: &HeaderMap) -> bool {
    let accept = headers.get(header::ACCEPT).and_then(|value| value.to_str().ok()).unwrap_or_default();
    accept.split(',').any(|one| {
        let mut parts = one.split(';').map(str::trim);
        parts.next() == Some("application/json") && parts.any(|parameter| parameter == "nanoseconds=string")
    })
}

/// JSON with the numbers of all `_ns` members in quotes.
fn quoted(json: &[u8]) -> Vec<u8> {
    let mut quoted = Vec::with_capacity(json.len() + json.len() / 8);
    let mut rest = json;
    while let Some(end) = rest.windows(END_OF_NAME.len()).position(|window| window == END_OF_NAME) {
        let (before, value) = rest.split_at(end + END_OF_NAME.len());
        let num_digits = value.iter().take_while(|byte| **byte == b'-' || byte.is_ascii_digit()).count();
        let (number, after) = value.split_at(num_digits);
        quoted.extend(before);
        if number.is_empty() {
            rest = after;
            continue;
        }
        quoted.push(b'"');
        quoted.extend(number);
        quoted.push(b'"');
        rest = after;
    }
    quoted.extend(rest);
    quoted
}

/// Reads nanoseconds from a number or a string.
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<i64, D::Error> {
    deserializer.deserialize_any(NanosecondsVisitor)
}

/// Writes nanoseconds as a number.
pub(crate) fn serialize<S: Serializer>(nanoseconds: &i64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_i64(*nanoseconds)
}

struct NanosecondsVisitor;

impl Visitor<'_> for NanosecondsVisitor {
    type Value = i64;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("nanoseconds, a whole number of 64 bits")
    }

    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<i64, E> {
        Ok(value)
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<i64, E> {
        i64::try_from(value).map_err(|_| E::invalid_value(Unexpected::Unsigned(value), &self))
    }

    /// Programs that know floats only write whole numbers so; up to 2^53 each has a float of its own.
    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<i64, E> {
        if value.fract() == 0.0 && value.abs() <= 9_007_199_254_740_992.0 {
            return Ok(value as i64);
        }
        Err(E::invalid_value(Unexpected::Float(value), &self))
    }

    fn visit_str<E: serde::de::Error>(self, value: &str) -> Result<i64, E> {
        value.parse().map_err(|_| E::invalid_value(Unexpected::Str(value), &self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_nanoseconds_become_strings() {
        let json =
            r#"{"timestamp_ns":1763800000000000001,"first_timestamp_ns":-5,"x_ns":null,"a":7,"t":"_ns\":8"}"#;
        let expected = r#"{"timestamp_ns":"1763800000000000001","first_timestamp_ns":"-5","x_ns":null,"a":7,"t":"_ns\":8"}"#;
        assert_eq!(String::from_utf8(quoted(json.as_bytes())).unwrap(), expected);
    }

    #[test]
    fn only_who_asks_gets_strings() {
        let asks = |accept: &'static str| {
            asks_for_strings(&HeaderMap::from_iter([(header::ACCEPT, HeaderValue::from_static(accept))]))
        };
        assert!(asks("text/html, application/json; q=0.9; nanoseconds=string"));
        assert!(!asks("application/json") && !asks("text/plain; nanoseconds=string"));
    }
}
