//! Everything that decides how scans become a text (SPEC section 3).

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::density::DensityConfig;
use crate::grid::LocalMapConfig;
use crate::registration::RefinerConfig;
use crate::sampling::SamplingConfig;
use crate::text::{QuantizerConfig, TextConfig};

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
