//! The site's record as last read or written, with what is parsed of it.

use std::sync::Arc;

use bytes::Bytes;
use locution_engine::config::EngineConfig;
use locution_engine::text::Quantizer;

use crate::records::{SiteRecord, codec};
use crate::storage::StorageError;

/// The record as it stands in storage.
#[derive(Clone, Debug)]
pub struct SiteState {
    /// The record.
    pub record: SiteRecord,
    /// The engine's configuration in it.
    pub config: Arc<EngineConfig>,
    pub(super) bytes: Bytes,
}

impl SiteState {
    pub(super) fn decode(bytes: Bytes) -> Result<Self, StorageError> {
        let record: SiteRecord = codec::decode(&bytes, "the record of the site")?;
        let config = stored_config(&record.config_json).map_err(|error| StorageError::Corrupt {
            what: format!("the configuration of the site: {error}"),
        })?;
        Ok(Self { record, config: Arc::new(config), bytes })
    }

    /// How the texts of the serving generation are written.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when the stored partition cannot be read.
    pub fn text_config(&self) -> Result<TextConfig, StorageError> {
        let parse = |json: &String| {
            serde_json::from_str(json).map_err(|error| StorageError::Corrupt {
                what: format!("the partition of densities: {error}"),
            })
        };
        let quantizer = self.record.quantizer_json.as_ref().map(parse).transpose()?;
        Ok(TextConfig { engine: Arc::clone(&self.config), quantizer })
    }
}

/// A site's configuration as it was stored; sections that configured no part of the server, and that sites of older
/// versions hold, are passed over.
fn stored_config(json: &str) -> Result<EngineConfig, serde_json::Error> {
    const RETIRED: [&str; 3] = ["density_field", "density_model", "particle_filter"];
    let mut config: serde_json::Value = serde_json::from_str(json)?;
    if let Some(localization) = config.get_mut("localization").and_then(serde_json::Value::as_object_mut) {
        localization.retain(|section, _| !RETIRED.contains(&section.as_str()));
    }
    serde_json::from_value(config)
}

/// All that decides what text a run becomes.
#[derive(Clone, Debug)]
pub struct TextConfig {
    /// The site's configuration.
    pub engine: Arc<EngineConfig>,
    /// The partition of densities that the generation is written with, when it is not the configured one.
    pub quantizer: Option<Quantizer>,
}
