//! Everything about localisation in a map.

use serde::{Deserialize, Serialize};

use super::likelihood_field::LikelihoodFieldConfig;
use super::localizer_config::LocalizerConfig;
use crate::config_error::ConfigError;

/// Settings of localisation sessions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalizationConfig {
    /// Likelihood of beam ends.
    pub likelihood_field: LikelihoodFieldConfig,
    /// The session itself.
    pub localizer: LocalizerConfig,
}

impl LocalizationConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.likelihood_field.validate(&format!("{path}.likelihood_field"))?;
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
        config.likelihood_field.sigma_m = -1.0;
        let error = config.validate("localization").expect_err("a deviation is positive");
        assert_eq!(error.field, "localization.likelihood_field.sigma_m");
    }
}
