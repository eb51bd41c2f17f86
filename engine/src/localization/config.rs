//! Everything about localisation in a map.

use serde::{Deserialize, Serialize};

use super::density_field::DensityFieldConfig;
use super::density_model::DensityModelConfig;
use super::likelihood_field::LikelihoodFieldConfig;
use super::localizer::LocalizerConfig;
use super::particle_filter::ParticleFilterConfig;
use crate::config::ConfigError;

/// Settings of the localisation room.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalizationConfig {
    /// Density fields of a map.
    pub density_field: DensityFieldConfig,
    /// Weights by density.
    pub density_model: DensityModelConfig,
    /// Likelihood of beam ends.
    pub likelihood_field: LikelihoodFieldConfig,
    /// The particle filter.
    pub particle_filter: ParticleFilterConfig,
    /// Sessions over HTTP.
    pub localizer: LocalizerConfig,
}

impl LocalizationConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.density_field.validate(&format!("{path}.density_field"))?;
        self.density_model.validate(&format!("{path}.density_model"))?;
        self.likelihood_field.validate(&format!("{path}.likelihood_field"))?;
        self.particle_filter.validate(&format!("{path}.particle_filter"))?;
        self.localizer.validate(&format!("{path}.localizer"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_work_and_a_bad_value_is_named() {
        let mut config = LocalizationConfig::default();
        assert_eq!(config.validate("localization"), Ok(()));
        config.particle_filter.motion.alpha3 = -1.0;
        let error = config.validate("localization").expect_err("a variance is not negative");
        assert_eq!(error.field, "localization.particle_filter.motion.alpha3");
    }
}
