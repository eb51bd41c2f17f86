//! The storage of the local map: a torus that rolls with the robot.
//!
//! The world cell (x, y) lives at `(y · side + x) mod side²`, a helix on a torus whose side is a power of two
//! wider than the map. A cell that is `dx`, `dy` away is then one addition away, and moving the robot copies
//! nothing: cells that fall out of the radius are set back to unknown.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::bit_planes::{self, BLOCK_WORDS, Bits, Planes};
use super::disc::{Disc, cells_within};
use super::field_of_view::FieldOfView;
use super::laser::Laser;
use super::{Cell, LocalMapConfig, OccupancyRows};
use crate::scan::ScanGeometry;

/// Occupancies of the cells within `radius_m` of the robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "SavedLocalMap", into = "SavedLocalMap")]
pub struct LocalMap {
    pub(super) config: LocalMapConfig,
    pub(super) laser: Laser,
    pub(super) view: Arc<FieldOfView>,
    /// The cell the robot stands on; none before the first scan.
    pub(super) robot: Option<Cell>,
    pub(super) disc: Disc,
    /// 256 cells each.
    pub(super) blocks: Vec<Planes>,
    /// Cells under the robot, relative to it.
    footprint: Vec<(i32, i32)>,
}

impl LocalMap {
    /// A map of which nothing is known. The config and the geometry must have passed their checks.
    pub fn new(config: &LocalMapConfig, geometry: &ScanGeometry) -> Self {
        let radius = config.radius_cells();
        let laser_offset = geometry.robot_from_laser.position().distance(&Default::default());
        let span = 2.0 * radius + laser_offset / config.resolution_m + 3.0;
        let side_log2 = (span as u32).next_power_of_two().ilog2().max(6);
        let num_blocks = 1usize << (2 * side_log2 - 8);
        Self {
            config: config.clone(),
            laser: Laser::new(geometry),
            view: FieldOfView::shared(radius, 1 << side_log2),
            robot: None,
            disc: Disc::new(radius, side_log2),
            blocks: vec![bit_planes::filled(config.initial); num_blocks],
            footprint: cells_within(config.robot_radius_m / config.resolution_m),
        }
    }

    /// Side of a cell, metres.
    pub fn resolution_m(&self) -> f64 {
        self.config.resolution_m
    }

    /// Occupancy of a cell, 0..=15; cells beyond the radius have the initial one.
    pub fn occupancy(&self, cell: Cell) -> u8 {
        if !self.robot.is_some_and(|robot| self.disc.contains(robot, cell)) {
            return self.config.initial;
        }
        let index = self.disc.index(cell);
        bit_planes::get(&self.blocks[index >> 8], index & 255)
    }

    /// True when the cell's occupancy is below ε_f.
    pub fn is_free(&self, cell: Cell) -> bool {
        self.occupancy(cell) < self.config.free_below
    }

    /// True when the cell's occupancy is above ε_o.
    pub fn is_occupied(&self, cell: Cell) -> bool {
        self.occupancy(cell) > self.config.occupied_above
    }

    /// The cell the robot was on at the last scan; none before it.
    pub fn robot_cell(&self) -> Option<Cell> {
        self.robot
    }

    /// Rolls the map to the robot's new cell and forgets what is now beyond the radius.
    #[inline(always)]
    pub(super) fn move_to(&mut self, robot: Cell) {
        if let Some(old) = self.robot.filter(|&old| old != robot) {
            let (blocks, initial) = (&mut self.blocks, self.config.initial);
            self.disc.for_each_outside(old, robot, |word, mask| {
                bit_planes::set(&mut blocks[word / BLOCK_WORDS], word % BLOCK_WORDS, mask, initial);
            });
        }
        self.robot = Some(robot);
    }

    /// Makes the floor around a cell free.
    pub(super) fn stamp_footprint(&mut self, center: Cell) {
        for &(dx, dy) in &self.footprint {
            set_occupancy(&mut self.blocks, self.disc.index(center.offset(dx, dy)), 0);
        }
    }
}

/// Sets the cell at a place on the helix.
fn set_occupancy(blocks: &mut [Planes], index: usize, occupancy: u8) {
    bit_planes::set(&mut blocks[index >> 8], index >> 6 & 3, 1 << (index & 63), occupancy);
}

impl OccupancyRows for LocalMap {
    #[inline(always)]
    fn read_row(&self, start: Cell, free: &mut [u64], unknown: &mut [u64]) {
        let first = self.disc.index(start);
        let (first_word, shift) = (first >> 6, first & 63);
        let mut block = self.below(first_word);
        let mut low = (block.0[first_word % BLOCK_WORDS], block.1[first_word % BLOCK_WORDS]);
        for (offset, (free, unknown)) in free.iter_mut().zip(unknown).enumerate() {
            let word = first_word + offset + 1;
            if word % BLOCK_WORDS == 0 {
                block = self.below(word);
            }
            let high = (block.0[word % BLOCK_WORDS], block.1[word % BLOCK_WORDS]);
            *free = joined(low.0, high.0, shift);
            *unknown = joined(low.1, high.1, shift) & !*free;
            low = high;
        }
    }
}

impl LocalMap {
    /// Which cells are free, and which are not occupied, in the block that holds a word of the helix.
    #[inline(always)]
    fn below(&self, word: usize) -> (Bits, Bits) {
        let planes = &self.blocks[(word / BLOCK_WORDS) & (self.blocks.len() - 1)];
        let below = |limit| bit_planes::below(planes, limit);
        (below(self.config.free_below), below(self.config.occupied_above + 1))
    }
}

/// 64 bits that begin `shift` bits into `low` and go on in `high`.
#[inline(always)]
fn joined(low: u64, high: u64, shift: usize) -> u64 {
    low >> shift | high << 1 << (63 - shift)
}

/// A local map as it is stored: the disc row by row, equal neighbours as one byte.
#[derive(Clone, Serialize, Deserialize)]
struct SavedLocalMap {
    config: LocalMapConfig,
    geometry: ScanGeometry,
    robot: Option<Cell>,
    /// Each byte is an occupancy (high half) and how many more cells share it (low half).
    runs: Vec<u8>,
}

impl From<LocalMap> for SavedLocalMap {
    fn from(map: LocalMap) -> Self {
        let mut runs: Vec<u8> = Vec::new();
        for cell in map.disc_cells() {
            let occupancy = map.occupancy(cell);
            match runs.last_mut() {
                Some(run) if *run >> 4 == occupancy && *run & 15 < 15 => *run += 1,
                _ => runs.push(occupancy << 4),
            }
        }
        Self { config: map.config, geometry: map.laser.geometry, robot: map.robot, runs }
    }
}

impl TryFrom<SavedLocalMap> for LocalMap {
    type Error = String;

    fn try_from(saved: SavedLocalMap) -> Result<Self, String> {
        saved.config.validate("local_map").map_err(|error| error.to_string())?;
        let mut map = LocalMap::new(&saved.config, &saved.geometry);
        map.robot = saved.robot;
        let occupancies =
            saved.runs.iter().flat_map(|run| std::iter::repeat_n(run >> 4, usize::from(run & 15) + 1));
        let cells: Vec<Cell> = map.disc_cells().collect();
        if occupancies.clone().count() != cells.len() {
            return Err("the stored local map has the wrong size".to_owned());
        }
        for (cell, occupancy) in cells.into_iter().zip(occupancies) {
            set_occupancy(&mut map.blocks, map.disc.index(cell), occupancy);
        }
        Ok(map)
    }
}

impl LocalMap {
    /// The cells within the radius, row by row; none before the first scan.
    fn disc_cells(&self) -> impl Iterator<Item = Cell> + '_ {
        let offsets = self.robot.map(|_| cells_within(self.config.radius_cells())).unwrap_or_default();
        let robot = self.robot.unwrap_or_default();
        offsets.into_iter().map(move |(dx, dy)| robot.offset(dx, dy))
    }
}
