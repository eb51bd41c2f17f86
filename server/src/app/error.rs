//! What can go wrong in a use case, sorted by who has to act.

use std::time::Duration;

use locution_engine::config_error::ConfigError;
use thiserror::Error;

use crate::storage::StorageError;

/// Why a use case was refused or failed.
#[derive(Debug, Error)]
pub enum AppError {
    /// There is no such thing.
    #[error("there is no {kind} `{name}`")]
    NotFound {
        /// What was looked for.
        kind: &'static str,
        name: String,
    },
    /// A thing of this name exists and is different.
    #[error("{detail}")]
    Exists {
        /// What stands in the way.
        detail: String,
    },
    /// The batch does not continue the run.
    #[error("{detail}; the run expects sequence number {expected_sequence} next")]
    Sequence {
        /// The number that continues the run.
        expected_sequence: u64,
        /// How the batch misses it.
        detail: String,
    },
    /// The run takes no more scans.
    #[error("the run `{run}` is finished")]
    Finished {
        run: String,
        /// Number of its scans.
        expected_sequence: u64,
    },
    /// A value of the request is well formed but impossible.
    #[error("{problem}")]
    Invalid {
        /// Path of the value in the request.
        field: String,
        /// What is wrong with it.
        problem: String,
        /// Whether the value belongs to a scan.
        is_scan: bool,
    },
    /// The request needs something that has not been made yet.
    #[error("{detail}")]
    NotReady {
        /// What is missing and how to get it.
        detail: String,
    },
    /// The site is served by another server, or on its way from one to another.
    #[error("the site is moving between servers")]
    Elsewhere,
    /// A bounded queue is full.
    #[error("{queue} is full")]
    Busy {
        queue: &'static str,
        /// When to ask again.
        retry_after: Duration,
    },
    /// The work was ended before it was done: the server stops, its site is deleted, or somebody cancelled it.
    #[error("this was ended before it was done, since the server stops or the site is deleted")]
    Stopping,
    #[error(transparent)]
    Storage(#[from] StorageError),
    /// A bug of ours.
    #[error("internal error: {what}")]
    Internal {
        /// What happened, for the log.
        what: String,
    },
}

impl AppError {
    /// A value of the request that cannot be.
    pub fn invalid(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Invalid { field: field.into(), problem: problem.into(), is_scan: false }
    }

    /// A value of a scan that cannot be.
    pub fn invalid_scan(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Invalid { field: field.into(), problem: problem.into(), is_scan: true }
    }

    /// Something that does not exist.
    pub fn not_found(kind: &'static str, name: impl ToString) -> Self {
        Self::NotFound { kind, name: name.to_string() }
    }

    /// A bug of ours.
    pub fn internal(what: impl ToString) -> Self {
        Self::Internal { what: what.to_string() }
    }
}

impl From<ConfigError> for AppError {
    fn from(error: ConfigError) -> Self {
        Self::invalid(format!("config.{}", error.field), error.problem)
    }
}
