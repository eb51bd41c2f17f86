//! What the map around a place looks like: the few numbers that its label is decided by.

use serde::{Deserialize, Serialize};

use super::block::Block;
use super::config::SemanticsConfig;
use super::flood::{Flood, Passage};

/// The surroundings of a position of the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaceSignature {
    /// Largest clearance near the position: half the width of a corridor, metres.
    pub half_width_m: f64,
    /// Passages that leave the place, as wide as a door at least, and go on.
    pub num_passages: u32,
    /// Openings that leave the place where the shape of its passage is judged, as wide as a door at least, whether they
    /// go on or not: the passage itself counts twice, a room beside it once more.
    pub num_openings: u32,
    /// Distance between the ends of the two passages that are most opposite, over the way between them: 1 is
    /// straight, 0.71 a right angle. None with fewer than two passages.
    pub straightness: Option<f64>,
    /// Ways driven by any robot that leave the place and go on.
    pub num_driven: u32,
    /// How much the driven way turns here, radians.
    pub turn_rad: f64,
    /// Radius of the largest open disc that holds the position well inside, metres; 0 when none is as large as a hall.
    pub hall_radius_m: f64,
}

/// Computes signatures at positions of one block.
pub(super) struct SignatureReader<'a> {
    config: &'a SemanticsConfig,
    block: &'a Block,
    flood: Flood,
}

impl<'a> SignatureReader<'a> {
    pub(super) fn new(config: &'a SemanticsConfig, block: &'a Block) -> Self {
        Self { config, block, flood: Flood::new(block.side * block.side) }
    }

    /// The signature of a driven cell, where the way turns by `turn_rad`.
    pub(super) fn read(&mut self, at: usize, turn_rad: f64) -> PlaceSignature {
        let (config, block) = (self.config, self.block);
        let half_width_m = self.half_width_m(at);
        let clearance = |meters: f64| meters as f32;

        // Openings of doors are passages here, if they go on behind the door.
        let (door, wide) = (clearance(config.door_half_width_m), clearance(config.bend_half_width_m));
        let near_m =
            (config.fork_near_m + config.fork_near_per_half_width * half_width_m).min(config.fork_near_max_m);
        let far_m = near_m + config.fork_length_m;
        let bend_m = config.bend_near_m + config.bend_length_m;
        self.flood.pour(block, at, far_m.max(bend_m), |index| {
            block.clearance_m[index] >= door || block.is_driven[index]
        });
        let forks = self.flood.passages(block, near_m, far_m);
        let openings = self.flood.passages(block, config.bend_near_m, bend_m);

        // The shape of the passage itself is clearer without doors.
        self.flood
            .pour(block, at, bend_m, |index| block.clearance_m[index] >= wide || block.is_driven[index]);
        let arms = self.flood.passages(block, config.bend_near_m, bend_m);

        let driven_m = config.driven_near_m + config.driven_length_m;
        self.flood.pour(block, at, driven_m, |index| block.is_driven[index]);
        let driven = self.flood.passages(block, config.driven_near_m, driven_m);
        PlaceSignature {
            half_width_m,
            num_passages: forks.len() as u32,
            num_openings: openings.len() as u32,
            straightness: straightness(&arms, bend_m),
            num_driven: driven.len() as u32,
            turn_rad,
            hall_radius_m: self.hall_radius_m(at),
        }
    }

    fn half_width_m(&self, at: usize) -> f64 {
        let reach = (self.config.half_width_reach_m / self.block.resolution_m) as usize;
        self.block.square(at, reach).map(|index| f64::from(self.block.clearance_m[index])).fold(0.0, f64::max)
    }

    /// A disc holds a position well inside when its centre is nearer than this share of its radius.
    fn hall_radius_m(&self, at: usize) -> f64 {
        let config = self.config;
        let reach = (config.hall_radius_m * 2.0 * config.hall_core_share / self.block.resolution_m) as usize;
        let mut largest = 0.0f64;
        for center in self.block.square(at, reach).step_by(2) {
            let radius_m = f64::from(self.block.clearance_m[center]);
            if radius_m >= config.hall_radius_m
                && radius_m > largest
                && self.block.distance_m(at, center) <= config.hall_core_share * radius_m
            {
                largest = radius_m;
            }
        }
        largest
    }
}

/// Distance between the far ends of the two most opposite passages, over the way between them.
fn straightness(passages: &[Passage], reach_m: f64) -> Option<f64> {
    let mut widest: Option<f64> = None;
    for (position, a) in passages.iter().enumerate() {
        for b in &passages[..position] {
            let share = a.far_end.distance(&b.far_end) / (2.0 * reach_m);
            widest = Some(widest.map_or(share, |widest: f64| widest.max(share)));
        }
    }
    widest
}
