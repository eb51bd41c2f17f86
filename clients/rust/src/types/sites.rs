//! Sites.

use serde::{Deserialize, Serialize};

use super::jobs::Job;

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
    /// How much of it is kept.
    pub retention: Retention,
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

/// How much of a site is kept; what is `None` is kept whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Retention {
    /// Map versions, the serving one included; as the server is configured unless said.
    pub num_versions: Option<u32>,
    /// Runs: finished ones beyond are deleted, the oldest first, when a map is built.
    pub num_runs: Option<u32>,
    /// Scans of all runs together: finished runs are deleted, the oldest first, when a map is built.
    pub num_scans: Option<u64>,
}

/// Changes a site; what is `None` stays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SiteChange {
    /// Members of the engine's configuration that change, as a JSON merge patch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub config: Option<serde_json::Value>,
    /// Instead of what stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retention: Option<Retention>,
}

/// A site after it was changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangedSite {
    /// The site.
    pub site: Site,
    /// What makes a map accordingly.
    pub job: Option<Job>,
}
