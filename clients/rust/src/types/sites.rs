//! Sites.

use serde::{Deserialize, Serialize};

/// What a site holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteSummary {
    /// Its name.
    pub site: String,
    /// Runs.
    pub num_runs: u32,
    /// Scans of all runs.
    pub num_scans: u64,
    /// Observations of all runs.
    pub num_observations: u64,
    /// Words of all levels of all runs.
    pub num_words: u64,
    /// Bytes on disk.
    pub bytes_on_disk: u64,
    /// The text generation that serves.
    pub generation: u32,
    /// The map version that serves; null before the first build.
    pub map_version: Option<u64>,
}

/// A site, how it is configured and what it holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Its name.
    pub site: String,
    /// The engine's configuration in it, complete.
    pub config: serde_json::Value,
    /// Runs.
    pub num_runs: u32,
    /// Scans of all runs.
    pub num_scans: u64,
    /// Observations of all runs.
    pub num_observations: u64,
    /// Words of all levels of all runs.
    pub num_words: u64,
    /// Bytes on disk.
    pub bytes_on_disk: u64,
    /// The text generation that serves.
    pub generation: u32,
    /// The map version that serves; null before the first build.
    pub map_version: Option<u64>,
}
