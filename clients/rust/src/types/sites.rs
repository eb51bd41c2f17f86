//! Sites.

use serde::{Deserialize, Serialize};

/// Whether a site can be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SiteState {
    /// It answers.
    Serving,
    /// It cannot be opened; it can be deleted, and its numbers are 0.
    Unreadable,
}

/// What a site holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteSummary {
    /// Its name.
    pub site: String,
    /// Whether it can be asked.
    pub state: SiteState,
    /// Why it is unreadable, and what can be done about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
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
