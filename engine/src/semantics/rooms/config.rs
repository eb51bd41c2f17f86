//! What finding rooms can be told.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;

/// How the floor is divided into rooms. docs/evaluation.md says on which plans the shares were chosen, and what they are
/// worth on a plan left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoomsConfig {
    /// Obstacles that touch no wall and extend less than this along both axes are passed over, metres: people, legs of
    /// tables, plants.
    pub obstacle_size_m: f64,
    /// An opening is a door when it is narrower than this share of the space on either side.
    pub door_share: f64,
    /// Wider openings are no doors, metres.
    pub door_width_max_m: f64,
    /// Openings through which no disc of this diameter passes are gaps, not doors, metres.
    pub door_width_min_m: f64,
    /// The space beside an opening is judged this far, metres.
    pub door_reach_m: f64,
    /// A part narrower than this share of the widest part of its room may be a room of its own,
    pub mouth_share: f64,
    /// if it goes on for this long, metres.
    pub mouth_depth_m: f64,
    /// Smaller pieces go over to the neighbor that they touch most, square metres.
    pub room_area_min_m2: f64,
    /// A corridor is at least this many times as long as wide.
    pub corridor_elongation: f64,
    /// Half the width of the narrowest hall, metres.
    pub hall_radius_m: f64,
}

impl Default for RoomsConfig {
    fn default() -> Self {
        Self {
            obstacle_size_m: 0.8,
            door_share: 0.9,
            door_width_max_m: 2.5,
            door_width_min_m: 0.4,
            door_reach_m: 2.0,
            mouth_share: 0.4,
            mouth_depth_m: 1.5,
            room_area_min_m2: 1.5,
            corridor_elongation: 3.0,
            hall_radius_m: 3.0,
        }
    }
}

impl RoomsConfig {
    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        for (field, value, lowest, highest) in [
            ("obstacle_size_m", self.obstacle_size_m, 0.0, 10.0),
            ("door_share", self.door_share, 0.0, 1.0),
            ("door_width_max_m", self.door_width_max_m, 0.1, 20.0),
            ("door_width_min_m", self.door_width_min_m, 0.0, 5.0),
            ("door_reach_m", self.door_reach_m, 0.2, 10.0),
            ("mouth_share", self.mouth_share, 0.0, 1.0),
            ("mouth_depth_m", self.mouth_depth_m, 0.1, 20.0),
            ("room_area_min_m2", self.room_area_min_m2, 0.0, 100.0),
            ("corridor_elongation", self.corridor_elongation, 1.0, 100.0),
            ("hall_radius_m", self.hall_radius_m, 0.5, 20.0),
        ] {
            if !(lowest..=highest).contains(&value) {
                return Err(ConfigError::new(
                    format!("{path}.{field}"),
                    format!("must lie in {lowest}..={highest}"),
                ));
            }
        }
        Ok(())
    }
}
