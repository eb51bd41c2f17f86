//! Sites on the wire.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::app::ListedSite;
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
    /// `serving`, or `unreadable` when it cannot be opened; it can then be deleted, and the numbers are 0.
    #[schema(example = "serving")]
    pub state: String,
    /// Why it is unreadable, and what can be done about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
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

impl SiteDto {
    /// A site of a list, whether or not it can be opened.
    pub async fn of(listed: ListedSite) -> Self {
        let info = match listed.site {
            Ok(site) => site.info().await,
            Err(error) => Err(error),
        };
        info.map_or_else(|error| Self::unreadable(listed.name.to_string(), error.to_string()), Self::from)
    }

    fn unreadable(site: String, reason: String) -> Self {
        Self {
            site,
            state: "unreadable".into(),
            reason: Some(reason),
            config: serde_json::Value::Null,
            num_runs: 0,
            num_scans: 0,
            num_observations: 0,
            num_words: 0,
            bytes_on_disk: 0,
            generation: 0,
            map_version: None,
        }
    }
}

impl From<SiteInfo> for SiteDto {
    fn from(info: SiteInfo) -> Self {
        Self {
            site: info.name.to_string(),
            state: "serving".into(),
            reason: None,
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
