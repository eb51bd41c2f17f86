//! What finding changes can be told.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::occupancy::OccupancyConfig;

/// Settings of the comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChangesConfig {
    /// How the runs are drawn.
    pub occupancy: OccupancyConfig,
    /// An obstacle within this distance of one in the other set has not changed: poses and walls are not sharper,
    /// metres.
    pub tolerance_m: f64,
    /// Scans that must agree on a cell: that saw a return in it in the one set, and judged it in the other. A person who
    /// walks by leaves fewer returns.
    pub num_scans_min: u16,
    /// A cell is surely free when at most this share of its scans saw a return in it.
    pub free_share_max: f64,
    /// Changed cells closer than this belong to one area, metres.
    pub join_m: f64,
    /// Areas with less than this surface of changed cells are noise, m².
    pub area_min_m2: f64,
    /// Densities sampled within this distance of an area speak for or against it, metres.
    pub profile_radius_m: f64,
}

impl Default for ChangesConfig {
    fn default() -> Self {
        Self {
            occupancy: OccupancyConfig { range_limit_m: 9.0, ..OccupancyConfig::default() },
            tolerance_m: 0.25,
            num_scans_min: 3,
            free_share_max: 0.05,
            join_m: 0.35,
            area_min_m2: 0.05,
            profile_radius_m: 1.5,
        }
    }
}

impl ChangesConfig {
    /// Checks every value; `path` is prefixed to the name of the offending field.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.occupancy.validate(&format!("{path}.occupancy"))?;
        let values = [
            ("tolerance_m", self.tolerance_m, 0.0, 2.0),
            ("free_share_max", self.free_share_max, 0.0, 0.5),
            ("join_m", self.join_m, 0.0, 5.0),
            ("area_min_m2", self.area_min_m2, 0.0, 100.0),
            ("profile_radius_m", self.profile_radius_m, 0.0, 20.0),
        ];
        for (name, value, low, high) in values {
            if !(low..=high).contains(&value) {
                return Err(ConfigError::new(
                    format!("{path}.{name}"),
                    format!("must be in [{low}, {high}]"),
                ));
            }
        }
        if self.num_scans_min == 0 {
            return Err(ConfigError::new(format!("{path}.num_scans_min"), "must be at least 1"));
        }
        Ok(())
    }
}
