//! The one nested configuration: every room defines its own part with defaults and units, this file nests them.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::locate::{LocalizationConfig, SessionConfig};
use crate::mapping::MappingConfig;
use crate::matching::MatchingConfig;
use crate::recall::RecallConfig;
use crate::semantics::SemanticsConfig;
use crate::translator::TranslatorConfig;

/// Everything the engine can be told, per site; stored with every text it produced.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EngineConfig {
    /// From scans to words; another value here is another text.
    pub translator: TranslatorConfig,
    /// When stretches of text match.
    pub matching: MatchingConfig,
    /// How runs become one map.
    pub mapping: MappingConfig,
    /// How robots are found in the map.
    pub localization: LocalizationConfig,
    /// How short recordings are looked for.
    pub recall: RecallConfig,
    /// How places are labelled.
    pub semantics: SemanticsConfig,
}

impl EngineConfig {
    /// What a localisation session needs of it.
    pub fn session(&self) -> SessionConfig {
        SessionConfig {
            localizer: self.localization.localizer.clone(),
            recall: self.recall.clone(),
            translator: self.translator.clone(),
        }
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first field that cannot work, by its path.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.translator.validate("translator")?;
        self.matching.validate("matching")?;
        self.mapping.validate("mapping")?;
        self.localization.validate("localization")?;
        self.recall.validate("recall")?;
        self.semantics.validate("semantics")?;
        Ok(())
    }
}
