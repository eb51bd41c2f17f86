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
        let config = parse(&record.config_json, "the configuration of the site")?;
        Ok(Self { record, config: Arc::new(config), bytes })
    }

    /// How the texts of the serving generation are written.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when the stored partition cannot be read.
    pub fn text_config(&self) -> Result<TextConfig, StorageError> {
        let stored = self.record.quantizer_json.as_ref();
        let quantizer = stored.map(|json| parse(json, "the partition of densities")).transpose()?;
        Ok(TextConfig { engine: Arc::clone(&self.config), quantizer })
    }
}

/// All that decides what text a run becomes.
#[derive(Clone, Debug)]
pub struct TextConfig {
    /// The site's configuration.
    pub engine: Arc<EngineConfig>,
    /// The partition of densities that the generation is written with, when it is not the configured one.
    pub quantizer: Option<Quantizer>,
}

fn parse<T: serde::de::DeserializeOwned>(json: &str, what: &str) -> Result<T, StorageError> {
    serde_json::from_str(json).map_err(|error| StorageError::Corrupt { what: format!("{what}: {error}") })
}
