//! The one nested configuration: every room defines its own part with defaults and units, this file nests them.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::matching::MatchingConfig;
use crate::retrieval::RetrievalConfig;

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

/// Everything the engine can be told, per site; stored with every text it produced.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EngineConfig {
    /// When stretches of text match.
    pub matching: MatchingConfig,
    /// How places are retrieved by their density profiles.
    pub retrieval: RetrievalConfig,
}

impl EngineConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first field that cannot work, by its path.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.matching.validate("matching")?;
        self.retrieval.validate("retrieval")
    }
}
