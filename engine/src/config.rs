//! The one nested configuration: every room defines its own part with defaults and units, this file nests them.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::density::DensityConfig;
use crate::grid::LocalMapConfig;
use crate::localization::LocalizationConfig;
use crate::mapping::MappingConfig;
use crate::matching::MatchingConfig;
use crate::recall::RecallConfig;
use crate::registration::RefinerConfig;
use crate::sampling::SamplingConfig;
use crate::semantics::SemanticsConfig;
use crate::text::{QuantizerConfig, TextConfig};

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

/// Where the poses of scans come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OdometrySource {
    /// Odometry refined by registering scans against the recent ones (SPEC section 4).
    #[default]
    Refined,
    /// Odometry as sent, as the thesis uses it.
    Raw,
}

/// All that decides how scans become a text (SPEC section 3).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TranslatorConfig {
    /// Where the poses of scans come from.
    pub odometry: OdometrySource,
    /// How odometry is refined.
    pub refiner: RefinerConfig,
    /// The rolling occupancy grid.
    pub local_map: LocalMapConfig,
    /// Kernels of the density.
    pub density: DensityConfig,
    /// When observations and keyframes are taken.
    pub sampling: SamplingConfig,
    /// How densities become classes.
    pub quantizer: QuantizerConfig,
    /// How classes become words.
    pub text: TextConfig,
}

impl TranslatorConfig {
    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.refiner.validate(&format!("{path}.refiner"))?;
        self.local_map.validate(&format!("{path}.local_map"))?;
        self.density.validate(&format!("{path}.density"))?;
        self.sampling.validate(&format!("{path}.sampling"))?;
        self.quantizer.validate(&format!("{path}.quantizer"))?;
        self.text.validate(&format!("{path}.text"))?;
        // A delayed observation looks back over the delay; its widest kernel must still lie within the map.
        if self.sampling.delay_m + self.density.widest_m() > self.local_map.radius_m {
            let problem = "plus the widest kernel's bandwidth must not exceed local_map.radius_m";
            return Err(ConfigError::new(format!("{path}.sampling.delay_m"), problem));
        }
        Ok(())
    }
}
