//! What the local map can be told.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;

/// The largest radius a map may have, in cells: squared distances then fit 16 bits.
const MAX_RADIUS_CELLS: f64 = 255.0;

/// The rolling HIMM grid (thesis Algorithm 2.2, SPEC 3.1 and 3.2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalMapConfig {
    /// Side of a cell, metres.
    pub resolution_m: f64,
    /// r_max: what is farther from the robot is forgotten, and readings clear no farther than this, metres.
    pub radius_m: f64,
    /// Occupancy of a cell nothing is known of, of 0..=15.
    pub initial: u8,
    /// Added to a cell around a reading.
    pub hit_increment: u8,
    /// Taken from a cell before a reading.
    pub free_decrement: u8,
    /// ε_f: occupancy below this is free.
    pub free_below: u8,
    /// ε_o: occupancy above this is occupied.
    pub occupied_above: u8,
    /// ε_d: a cell this close to a reading, in cells, counts as hit.
    pub hit_tolerance_cells: f64,
    /// The floor under the robot is free within this distance of the line from its centre to its laser, metres.
    pub robot_radius_m: f64,
}

impl Default for LocalMapConfig {
    fn default() -> Self {
        Self {
            resolution_m: 0.1,
            radius_m: 9.0,
            initial: 8,
            hit_increment: 3,
            free_decrement: 1,
            free_below: 3,
            occupied_above: 12,
            hit_tolerance_cells: 1.0,
            robot_radius_m: 0.2,
        }
    }
}

impl LocalMapConfig {
    /// r_max in cells.
    pub fn radius_cells(&self) -> f64 {
        in_cells(self.radius_m, self.resolution_m)
    }

    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let error = |field: &str, problem: &str| Err(ConfigError::new(format!("{path}.{field}"), problem));
        if !(self.resolution_m >= 0.01 && self.resolution_m <= 1.0) {
            return error("resolution_m", "must lie in 0.01..=1 m");
        }
        if !(self.radius_cells() >= 5.0 && self.radius_cells() <= MAX_RADIUS_CELLS) {
            return error("radius_m", "must be 5 to 255 cells of resolution_m");
        }
        if self.occupied_above > 14 {
            return error("occupied_above", "must lie below 15, the highest occupancy");
        }
        if self.free_below == 0 || self.free_below > self.occupied_above {
            return error("free_below", "must lie in 1..=occupied_above");
        }
        if self.initial < self.free_below || self.initial > self.occupied_above {
            return error("initial", "must be unknown: neither free nor occupied");
        }
        if self.hit_increment == 0 || self.hit_increment > 15 {
            return error("hit_increment", "must lie in 1..=15");
        }
        if self.free_decrement == 0 || self.free_decrement > 15 {
            return error("free_decrement", "must lie in 1..=15");
        }
        if !(self.hit_tolerance_cells > 0.0 && self.hit_tolerance_cells <= 10.0) {
            return error("hit_tolerance_cells", "must be positive and at most 10");
        }
        if !(self.robot_radius_m >= 0.0 && self.robot_radius_m <= self.radius_m / 2.0) {
            return error("robot_radius_m", "must lie in 0..=radius_m / 2");
        }
        Ok(())
    }
}

/// A length in cells, freed of the rounding of decimal fractions: 0.3 m of 0.1 m cells are exactly 3.
pub fn in_cells(length_m: f64, resolution_m: f64) -> f64 {
    const GRAIN: f64 = 1e9;
    (length_m / resolution_m * GRAIN).round() / GRAIN
}
