//! What labelling can be told.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::rooms::RoomsConfig;
use crate::config_error::ConfigError;

/// Who decides the label of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LabelModel {
    /// Rules on passages, bends, driven ways and open discs, after the thesis' decision tree.
    Tree,
    /// Trees learned from labelled buildings, and a hidden Markov chain along the run.
    #[default]
    Learned,
}

/// How places are labelled from the map.
///
/// The lengths of forks and bends, the limits of corners and the smoothing were chosen on `aces`, `intel`, `mit-killian`
/// and three simulated floors. What they are worth on a building that had no say in them was measured by leaving one out
/// at a time: docs/evaluation.md has the figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SemanticsConfig {
    /// Who decides the label of a place: the lengths and limits of passages, bends, driven ways and halls below are the
    /// tree's.
    pub model: LabelModel,
    /// Edge of a cell, metres.
    pub resolution_m: f64,
    /// Edge of the core of a block, metres: only a matter of memory.
    pub block_m: f64,
    /// Beams are followed this far, metres.
    pub sight_m: f64,
    /// Travel between two positions whose surroundings are looked at, metres.
    pub spacing_m: f64,
    /// A cell is occupied when more than this share of the scans that saw it hit it.
    pub occupied_share: f64,
    /// Obstacles of at most this many cells are passed over.
    pub speck_cells: usize,
    /// Half the width of the strip along a driven path that counts as free, metres.
    pub driven_radius_m: f64,
    /// The clearance of a position is the largest within this distance, metres.
    pub half_width_reach_m: f64,
    /// Half the width of the narrowest opening that can be a passage, metres.
    pub door_half_width_m: f64,
    /// Passages of a fork are counted from this distance, metres,
    pub fork_near_m: f64,
    /// plus this many times the half width of the corridor,
    pub fork_near_per_half_width: f64,
    /// but not farther, metres;
    pub fork_near_max_m: f64,
    /// and must go on for this long, metres.
    pub fork_length_m: f64,
    /// Half the width of the narrowest part of a passage whose shape is judged, metres.
    pub bend_half_width_m: f64,
    /// The shape of a passage is judged from this distance, metres,
    pub bend_near_m: f64,
    /// and on for this long, metres.
    pub bend_length_m: f64,
    /// A straighter passage is no corner (see [`super::PlaceSignature::straightness`]).
    pub corner_straightness: f64,
    /// A passage that is not straighter than this is a corner even with openings beside it.
    pub sharp_straightness: f64,
    /// The way driven through a corner turns by at least this, radians,
    pub corner_turn_rad: f64,
    /// from so much travel before to so much travel after, metres.
    pub turn_reach_m: f64,
    /// A place with a straighter passage is no dead end.
    pub dead_end_straightness: f64,
    /// Driven ways are counted from this distance, metres,
    pub driven_near_m: f64,
    /// and must go on for this long, metres.
    pub driven_length_m: f64,
    /// Radius of the smallest hall, metres.
    pub hall_radius_m: f64,
    /// The part of a hall's radius that is hall; the rim belongs to what joins it.
    pub hall_core_share: f64,
    /// Labels are the majority over this much travel before and after, metres.
    pub smoothing_m: f64,
    /// Edge of the cells of ground on which the labels of all passes are counted, metres.
    pub place_cell_m: f64,
    /// A place has at least this many cells; smaller ones go over to a neighbour.
    pub place_cells_min: usize,
    /// How the floor is divided into rooms.
    pub rooms: RoomsConfig,
}

impl Default for SemanticsConfig {
    fn default() -> Self {
        Self {
            model: LabelModel::default(),
            resolution_m: 0.1,
            block_m: 64.0,
            sight_m: 12.0,
            spacing_m: 0.4,
            occupied_share: 0.2,
            speck_cells: 8,
            driven_radius_m: 0.3,
            half_width_reach_m: 1.0,
            door_half_width_m: 0.5,
            fork_near_m: 1.5,
            fork_near_per_half_width: 2.0,
            fork_near_max_m: 5.5,
            fork_length_m: 3.5,
            bend_half_width_m: 0.6,
            bend_near_m: 3.0,
            bend_length_m: 1.5,
            corner_straightness: 0.9,
            sharp_straightness: 0.75,
            corner_turn_rad: 25.0 / 180.0 * PI,
            turn_reach_m: 2.0,
            dead_end_straightness: 0.8,
            driven_near_m: 1.5,
            driven_length_m: 5.0,
            hall_radius_m: 3.0,
            hall_core_share: 0.8,
            smoothing_m: 1.6,
            place_cell_m: 0.5,
            place_cells_min: 3,
            rooms: RoomsConfig::default(),
        }
    }
}

impl SemanticsConfig {
    /// Distance from a position within which anything can matter to its label, metres.
    pub(super) fn margin_m(&self) -> f64 {
        let flood_m = (self.fork_near_max_m + self.fork_length_m)
            .max(self.bend_near_m + self.bend_length_m)
            .max(self.driven_near_m + self.driven_length_m);
        (flood_m + 2.0 * self.hall_radius_m).max(super::features::REACH_M + 2.0)
    }

    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        for (field, value, lowest, highest) in [
            ("resolution_m", self.resolution_m, 0.02, 0.5),
            ("block_m", self.block_m, 8.0, 256.0),
            ("sight_m", self.sight_m, 1.0, 60.0),
            ("spacing_m", self.spacing_m, 0.05, 5.0),
            ("occupied_share", self.occupied_share, 0.0, 1.0),
            ("speck_cells", self.speck_cells as f64, 0.0, 1000.0),
            ("driven_radius_m", self.driven_radius_m, self.resolution_m, 2.0),
            ("half_width_reach_m", self.half_width_reach_m, 0.0, 5.0),
            ("door_half_width_m", self.door_half_width_m, 0.0, 3.0),
            ("fork_near_m", self.fork_near_m, 0.1, 10.0),
            ("fork_near_per_half_width", self.fork_near_per_half_width, 0.0, 10.0),
            ("fork_near_max_m", self.fork_near_max_m, 0.1, 20.0),
            ("fork_length_m", self.fork_length_m, 0.1, 20.0),
            ("bend_half_width_m", self.bend_half_width_m, 0.0, 3.0),
            ("bend_near_m", self.bend_near_m, 0.1, 20.0),
            ("bend_length_m", self.bend_length_m, 0.1, 20.0),
            ("corner_straightness", self.corner_straightness, 0.0, 1.0),
            ("sharp_straightness", self.sharp_straightness, 0.0, 1.0),
            ("corner_turn_rad", self.corner_turn_rad, 0.0, PI),
            ("turn_reach_m", self.turn_reach_m, 0.1, 20.0),
            ("dead_end_straightness", self.dead_end_straightness, 0.0, 1.0),
            ("driven_near_m", self.driven_near_m, 0.1, 20.0),
            ("driven_length_m", self.driven_length_m, 0.1, 20.0),
            ("hall_radius_m", self.hall_radius_m, 0.5, 10.0),
            ("hall_core_share", self.hall_core_share, 0.0, 1.0),
            ("smoothing_m", self.smoothing_m, 0.0, 10.0),
            ("place_cell_m", self.place_cell_m, 0.1, 10.0),
            ("place_cells_min", self.place_cells_min as f64, 0.0, 1000.0),
        ] {
            if !(lowest..=highest).contains(&value) {
                return Err(ConfigError::new(
                    format!("{path}.{field}"),
                    format!("must lie in {lowest}..={highest}"),
                ));
            }
        }
        self.rooms.validate(&format!("{path}.rooms"))
    }
}
