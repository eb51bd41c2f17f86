//! What the density estimate can be told.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;

/// Shape of a kernel over the distance d from its centre, support d < h (thesis Eqs 2.14 to 2.16, SPEC 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KernelProfile {
    /// The same weight everywhere (Eq 2.14).
    Uniform,
    /// exp(−d² / 2h²), more weight in the middle (Eq 2.15).
    Gaussian,
    /// h (b + c) − c √(h² − d²) with b = 0.871 c, more weight at the border (Eq 2.16).
    Inverted,
}

/// One kernel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KernelConfig {
    /// Its shape.
    pub profile: KernelProfile,
    /// Bandwidth h, metres.
    pub bandwidth_m: f64,
}

impl KernelConfig {
    /// A uniform kernel of a bandwidth in metres.
    pub const fn uniform(bandwidth_m: f64) -> Self {
        Self { profile: KernelProfile::Uniform, bandwidth_m }
    }
}

/// Kernels and the sizes of openings that count (thesis Algorithms 3.1 and 6.1, SPEC 3.2 to 3.4).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DensityConfig {
    /// The kernels; words, the hard flag and the frontiers use the first.
    pub kernels: Vec<KernelConfig>,
    /// The hard density is undefined once reachable unknown cells form an opening of more cells than this share of
    /// the kernel's perimeter; 0 is the literal reading of Algorithm 3.1.
    pub opening_tolerance: f64,
    /// A frontier counts when it has more cells than this share of the kernel's perimeter.
    pub frontier_share: f64,
}

impl Default for DensityConfig {
    fn default() -> Self {
        let kernels = [2.5, 1.5, 4.0].map(KernelConfig::uniform).to_vec();
        Self { kernels, opening_tolerance: 0.05, frontier_share: 0.05 }
    }
}

impl DensityConfig {
    /// The most kernels one observation may carry.
    pub const MAX_KERNELS: usize = 8;

    /// Bandwidth of the widest kernel, metres.
    pub fn widest_m(&self) -> f64 {
        self.kernels.iter().map(|kernel| kernel.bandwidth_m).fold(0.0, f64::max)
    }

    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if self.kernels.is_empty() || self.kernels.len() > Self::MAX_KERNELS {
            return Err(ConfigError::new(format!("{path}.kernels"), "must list 1 to 8 kernels"));
        }
        for (index, kernel) in self.kernels.iter().enumerate() {
            if !(kernel.bandwidth_m > 0.0 && kernel.bandwidth_m.is_finite()) {
                return Err(ConfigError::new(
                    format!("{path}.kernels[{index}].bandwidth_m"),
                    "must be positive, in metres",
                ));
            }
        }
        for (field, share) in
            [("opening_tolerance", self.opening_tolerance), ("frontier_share", self.frontier_share)]
        {
            if !(0.0..=1.0).contains(&share) {
                return Err(ConfigError::new(
                    format!("{path}.{field}"),
                    "must lie in 0..=1 of the kernel's perimeter",
                ));
            }
        }
        Ok(())
    }
}
