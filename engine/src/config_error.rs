//! What every room says of a setting that cannot work.

use thiserror::Error;

/// A configuration value that cannot work.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{field}: {problem}")]
pub struct ConfigError {
    /// Path of the offending field, such as `local_map.resolution_m`.
    pub field: String,
    /// What is wrong with it and what would do.
    pub problem: String,
}

impl ConfigError {
    /// An error about `field`.
    pub fn new(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { field: field.into(), problem: problem.into() }
    }
}
