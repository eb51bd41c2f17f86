//! The site's record as last read or written, with what is parsed of it.

use std::sync::Arc;

use bytes::Bytes;
use locution_engine::config::EngineConfig;
use locution_engine::text::Quantizer;

use crate::records::SiteRecord;
use crate::storage::StorageError;

/// The record as it stands in storage.
#[derive(Clone, Debug)]
pub struct SiteState {
    pub record: SiteRecord,
    /// The engine's configuration in it.
    pub config: Arc<EngineConfig>,
    pub(super) bytes: Bytes,
}

impl SiteState {
    /// A record of the first layout is given a birth.
    pub(super) fn decode(bytes: Bytes, birth_if_none: u64) -> Result<Self, StorageError> {
        let record = SiteRecord::decode(&bytes, birth_if_none)?;
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

/// A site's configuration as it was stored. Members that sites of earlier versions hold and that this one no longer has,
/// or has in another form, are passed over: what they set is gone. How texts are written must not change that way, so
/// there a value in another form is an error.
fn stored_config(json: &str) -> Result<EngineConfig, serde_json::Error> {
    let mut config: serde_json::Value = serde_json::from_str(json)?;
    loop {
        let error = match serde_path_to_error::deserialize(&config) {
            Ok(config) => return Ok(config),
            Err(error) => error,
        };
        let is_unknown = error.inner().to_string().starts_with("unknown field");
        let is_of_texts = error.path().to_string().starts_with("translator");
        if (is_of_texts && !is_unknown) || !remove_member(&mut config, error.path()) {
            return Err(error.into_inner());
        }
    }
}

/// Takes the member at a path out; false when there is none.
fn remove_member(value: &mut serde_json::Value, path: &serde_path_to_error::Path) -> bool {
    use serde_path_to_error::Segment;
    let names: Vec<&str> = path
        .iter()
        .filter_map(|segment| match segment {
            Segment::Map { key } => Some(key.as_str()),
            Segment::Enum { variant } => Some(variant.as_str()),
            Segment::Seq { .. } | Segment::Unknown => None,
        })
        .collect();
    let Some((last, above)) = names.split_last() else { return false };
    let holder = above.iter().try_fold(value, |value, name| value.get_mut(*name));
    holder.and_then(serde_json::Value::as_object_mut).is_some_and(|members| members.remove(*last).is_some())
}

/// All that decides what text a run becomes.
#[derive(Clone, Debug)]
pub struct TextConfig {
    pub engine: Arc<EngineConfig>,
    /// The partition of densities that the generation is written with, when it is not the configured one.
    pub quantizer: Option<Quantizer>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_of_earlier_versions_are_passed_over_and_nothing_else_is() {
        let json = r#"{"localization": {"agreement_sure": 0.9, "particle_filter": {"a": 1},
            "localizer": {"history_m": 12.0, "max_points": [1, 2]}}, "mapping": {"gone": [1, 2]}}"#;
        let (config, default) = (stored_config(json).unwrap(), EngineConfig::default());
        assert_eq!(config.localization.localizer.history_m, 12.0);
        assert_eq!(config.localization.localizer.max_points, default.localization.localizer.max_points);
        assert_eq!(config.mapping, default.mapping);
        for wrong in [r#"{"translator": {"local_map": 3}}"#, "3", "{"] {
            assert!(stored_config(wrong).is_err(), "{wrong}");
        }
    }
}
