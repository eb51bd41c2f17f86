//! What can go wrong between a robot and its server.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// An RFC 9457 problem document.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Problem {
    /// Stable address that names the kind of problem.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind in words.
    pub title: String,
    /// HTTP status.
    pub status: u16,
    /// This very case in words.
    pub detail: String,
    /// Path of the offending field, such as `scans[3].ranges_m[17]`.
    pub field: Option<String>,
    /// On a sequence conflict: the number that the next scan must have.
    pub expected_sequence: Option<u64>,
}

/// Why a request failed.
#[derive(Debug, Error)]
pub enum ClientError {
    /// The server said no.
    #[error("{status}: {detail}", status = .0.status, detail = describe(.0))]
    Refused(Box<Problem>),
    /// No answer came, within the retries allowed.
    #[error("the server did not answer")]
    Transport(#[source] reqwest::Error),
    /// The answer is not what the API says.
    #[error("the answer to {path} is not understood: {problem}")]
    Answer {
        /// Path of the request.
        path: String,
        /// What is wrong with the answer.
        problem: String,
    },
    /// A value could not be put into a request.
    #[error("the request cannot be written: {0}")]
    Request(String),
    /// A job ended in failure.
    #[error("job {id} failed: {error}")]
    JobFailed {
        /// The job.
        id: String,
        /// Its own words.
        error: String,
    },
}

impl ClientError {
    /// The problem document, when the server said no.
    pub fn problem(&self) -> Option<&Problem> {
        match self {
            Self::Refused(problem) => Some(problem),
            _ => None,
        }
    }
}

fn describe(problem: &Problem) -> String {
    let said = if problem.detail.is_empty() { &problem.title } else { &problem.detail };
    match &problem.field {
        Some(field) => format!("{field}: {said}"),
        None => said.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_names_status_field_and_detail() {
        let text = r#"{"type":"https://locution.dev/problems/invalid-scan","title":"Invalid scan","status":422,
                       "detail":"a range is negative","field":"scans[3].ranges_m[17]"}"#;
        let problem: Problem = serde_json::from_str(text).unwrap();
        let error = ClientError::Refused(Box::new(problem));
        assert_eq!(error.to_string(), "422: scans[3].ranges_m[17]: a range is negative");
    }
}
