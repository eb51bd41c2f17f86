//! What quantising and word building can be told.

use serde::{Deserialize, Serialize};

use super::quantizer::Quantizer;
use crate::config_error::ConfigError;

/// How densities become classes (thesis 4.2.1, SPEC 3.5).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum QuantizerConfig {
    /// Classes of one width.
    Uniform {
        /// How many.
        num_classes: u8,
    },
    /// The modes of the site's density histogram, found by mean shift; equal classes until there is a histogram.
    MeanShift {
        /// Classes of the text before the first partition is found.
        num_initial_classes: u8,
        /// Bandwidth of the shift's Gaussian window, in density.
        bandwidth: f64,
        /// A mode that draws a smaller share of the observations joins its neighbour.
        min_share: f64,
        /// A partition that puts a larger share of the observations into other classes is materially different.
        max_moved_share: f64,
    },
}

impl Default for QuantizerConfig {
    fn default() -> Self {
        Self::Uniform { num_classes: 8 }
    }
}

impl QuantizerConfig {
    /// Mean shift with the default numbers.
    pub const fn mean_shift() -> Self {
        Self::MeanShift { num_initial_classes: 8, bandwidth: 0.03, min_share: 0.01, max_moved_share: 0.1 }
    }

    /// The partition that a site without observations begins with.
    pub fn initial(&self) -> Quantizer {
        match self {
            Self::Uniform { num_classes } => Quantizer::uniform(*num_classes),
            Self::MeanShift { num_initial_classes, .. } => Quantizer::uniform(*num_initial_classes),
        }
    }

    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let error = |field: &str, problem: &str| Err(ConfigError::new(format!("{path}.{field}"), problem));
        match *self {
            Self::Uniform { num_classes: 0 } => error("num_classes", "must be at least 1"),
            Self::Uniform { .. } => Ok(()),
            Self::MeanShift { num_initial_classes: 0, .. } => {
                error("num_initial_classes", "must be at least 1")
            }
            Self::MeanShift { bandwidth, .. } if !(0.005..=0.5).contains(&bandwidth) => {
                error("bandwidth", "must lie in 0.005..=0.5")
            }
            Self::MeanShift { min_share, .. } if !(0.0..=0.5).contains(&min_share) => {
                error("min_share", "must lie in 0..=0.5")
            }
            Self::MeanShift { max_moved_share, .. } if !(0.0..=1.0).contains(&max_moved_share) => {
                error("max_moved_share", "must lie in 0..=1")
            }
            Self::MeanShift { .. } => Ok(()),
        }
    }
}

/// How classes become words (thesis Algorithms 4.2 and 5.2, SPEC 3.6 to 3.8).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TextConfig {
    /// t_o: a region lasts at least one observation longer than this.
    pub min_region_observations: u32,
    /// A region ends at this many observations even in one class, so that memory is bounded.
    pub max_region_observations: u32,
    /// L: the highest level of alternative words; 0 writes only words as observed.
    pub num_levels: u8,
}

impl Default for TextConfig {
    fn default() -> Self {
        Self { min_region_observations: 3, max_region_observations: 1000, num_levels: 2 }
    }
}

impl TextConfig {
    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let error = |field: &str, problem: &str| Err(ConfigError::new(format!("{path}.{field}"), problem));
        if self.max_region_observations <= self.min_region_observations
            || self.max_region_observations > 100_000
        {
            return error(
                "max_region_observations",
                "must be above min_region_observations and at most 100000",
            );
        }
        if self.num_levels > 8 {
            return error("num_levels", "must be at most 8");
        }
        Ok(())
    }
}
