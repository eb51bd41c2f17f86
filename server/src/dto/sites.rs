//! Sites on the wire.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::app::site::SiteInfo;

/// Makes a site.
#[derive(Clone, Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSiteDto {
    /// The engine's configuration; what is left out keeps its default.
    #[schema(value_type = Option<Object>)]
    pub config: Option<serde_json::Value>,
}

/// A site and what it holds.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct SiteDto {
    /// Its name.
    #[schema(example = "hospital-floor-2")]
    pub site: String,
    /// The engine's configuration in it, complete.
    #[schema(value_type = Object)]
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

impl From<SiteInfo> for SiteDto {
    fn from(info: SiteInfo) -> Self {
        Self {
            site: info.name.to_string(),
            config: serde_json::to_value(&*info.config).unwrap_or_default(),
            num_runs: info.record.num_runs,
            num_scans: info.num_scans,
            num_observations: info.num_observations,
            num_words: info.num_words,
            bytes_on_disk: info.num_bytes_on_disk,
            generation: info.record.generation,
            map_version: (info.record.map_version > 0).then_some(info.record.map_version),
        }
    }
}
