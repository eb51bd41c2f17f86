//! Who may speak to a server without keys: programs on this machine, not web pages from elsewhere.
//!
//! Any page can make a browser send requests to a loopback address (with its `Origin`), or have its own name point
//! there (with that name as `Host`). Both are told by these two headers, which pages cannot choose.

use std::net::IpAddr;

use axum::extract::Request;
use axum::http::{StatusCode, header};

use crate::config::WebConfig;
use crate::error::ApiError;

/// Names and origins that are let in beside this machine's own.
#[derive(Clone, Debug, Default)]
pub struct LocalCallers {
    config: WebConfig,
}

impl LocalCallers {
    /// Those of a checked configuration.
    pub fn new(config: &WebConfig) -> Self {
        Self { config: config.clone() }
    }

    /// Refuses requests that a page from elsewhere caused.
    pub fn check(&self, request: &Request) -> Result<(), ApiError> {
        let text =
            |name| request.headers().get(name).and_then(|value: &header::HeaderValue| value.to_str().ok());
        let authority = request.uri().authority().map(|authority| authority.as_str());
        let host = authority.or_else(|| text(header::HOST)).unwrap_or_default();
        let name = without_port(host);
        if !is_this_machine(name) && !self.config.hosts.iter().any(|known| known.eq_ignore_ascii_case(name)) {
            return Err(refusal(
                "the Host header names another machine; list it in web.hosts, or configure keys",
            ));
        }
        // A header that is there and unreadable is not taken for one that is missing.
        let Some(origin) = request.headers().get(header::ORIGIN) else { return Ok(()) };
        let origin = origin.to_str().unwrap_or_default();
        let is_own = origin.split_once("://").is_some_and(|(_, from)| from.eq_ignore_ascii_case(host));
        if !is_own && !self.config.origins.iter().any(|known| known == origin) {
            return Err(refusal("the Origin is another site; list it in web.origins, or configure keys"));
        }
        Ok(())
    }
}

fn refusal(detail: &str) -> ApiError {
    let title = "This server has no keys and serves only this machine";
    ApiError::new(StatusCode::FORBIDDEN, "foreign-origin", title, detail)
}

fn without_port(host: &str) -> &str {
    match host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((address, _)) => address,
        None => host.split(':').next().unwrap_or_default(),
    }
}

fn is_this_machine(name: &str) -> bool {
    name.eq_ignore_ascii_case("localhost")
        || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_let_in(host: &str, origin: Option<&str>) -> bool {
        let config =
            WebConfig { hosts: vec!["robot.lan".into()], origins: vec!["https://fleet.example".into()] };
        let mut request = Request::builder().uri("/v1/sites").header("host", host);
        if let Some(origin) = origin {
            request = request.header("origin", origin);
        }
        LocalCallers::new(&config).check(&request.body(axum::body::Body::empty()).unwrap()).is_ok()
    }

    #[test]
    fn names_that_point_here_from_elsewhere_are_refused() {
        for host in ["localhost", "localhost:7070", "127.0.0.1:7070", "[::1]:7070", "Robot.LAN:80"] {
            assert!(is_let_in(host, None), "{host}");
        }
        for host in ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "10.0.0.7:7070", ""]
        {
            assert!(!is_let_in(host, None), "{host}");
        }
    }

    #[test]
    fn pages_from_elsewhere_are_refused() {
        assert!(is_let_in("localhost:7070", Some("http://localhost:7070")));
        assert!(is_let_in("localhost:7070", Some("https://fleet.example")));
        for origin in ["http://localhost:8080", "https://evil.example", "null", ""] {
            assert!(!is_let_in("localhost:7070", Some(origin)), "{origin}");
        }
    }
}
