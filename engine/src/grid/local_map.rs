//! The storage of the local map: a torus that rolls with the robot.
//!
//! The world cell (x, y) lives at bit `(y · side + x) mod side²`, a helix on a torus whose side is a power of two
//! wider than the map. A cell that is `dx`, `dy` away is then one addition away, and moving the robot copies
//! nothing: cells that fall out of the radius are set back to unknown.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::bit_planes::{self, Planes};
use super::field_of_view::FieldOfView;
use super::himm::{FREE, HIT, Laser, Seen};
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
    side_log2: u32,
    words: Vec<Planes>,
    /// Half width in cells of each row of the disc, by its distance from the robot's row.
    half_widths: Vec<i32>,
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
        let num_words = 1usize << (2 * side_log2 - 6);
        Self {
            config: config.clone(),
            laser: Laser::new(geometry),
            view: FieldOfView::shared(radius, 1 << side_log2),
            robot: None,
            side_log2,
            words: vec![bit_planes::filled(config.initial); num_words],
            half_widths: half_widths(radius),
            footprint: disc(config.robot_radius_m / config.resolution_m),
        }
    }

    /// Side of a cell, metres.
    pub fn resolution_m(&self) -> f64 {
        self.config.resolution_m
    }

    /// Occupancy of a cell, 0..=15; cells beyond the radius have the initial one.
    pub fn occupancy(&self, cell: Cell) -> u8 {
        if !self.is_within_radius(cell) {
            return self.config.initial;
        }
        let index = self.index(cell);
        bit_planes::get(&self.words[index >> 6], index as u32 & 63)
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

    fn is_within_radius(&self, cell: Cell) -> bool {
        self.robot.is_some_and(|robot| {
            let row = (i64::from(cell.y) - i64::from(robot.y)).unsigned_abs() as usize;
            let column = (i64::from(cell.x) - i64::from(robot.x)).unsigned_abs();
            self.half_widths.get(row).is_some_and(|&half| column <= half as u64)
        })
    }

    /// Where a cell's bit stands on the helix.
    pub(super) fn index(&self, cell: Cell) -> usize {
        (cell.y.wrapping_shl(self.side_log2).wrapping_add(cell.x)) as usize & self.index_mask()
    }

    pub(super) fn index_mask(&self) -> usize {
        (1 << (2 * self.side_log2)) - 1
    }

    /// Rolls the map to the robot's new cell and forgets what is now beyond the radius.
    pub(super) fn move_to(&mut self, robot: Cell) {
        if let Some(old) = self.robot.filter(|&old| old != robot) {
            let initial = self.config.initial;
            for (start, len) in self.outside(old, robot) {
                for_each_word(start, len, self.index_mask(), |word, mask| {
                    bit_planes::set(&mut self.words[word], mask, initial);
                });
            }
        }
        self.robot = Some(robot);
    }

    /// Stretches (first index, length) of the disc around `center` that lie outside the disc around `kept`.
    pub(super) fn outside(&self, center: Cell, kept: Cell) -> Vec<(usize, usize)> {
        let radius = self.half_widths.len() as i32 - 1;
        let mut stretches = Vec::new();
        let mut push = |y: i32, first: i64, last: i64| {
            if first <= last {
                stretches.push((self.index(Cell::new(first as i32, y)), (last - first + 1) as usize));
            }
        };
        for dy in -radius..=radius {
            let y = center.y.wrapping_add(dy);
            let half = i64::from(self.half_widths[dy.unsigned_abs() as usize]);
            let (first, last) = (i64::from(center.x) - half, i64::from(center.x) + half);
            let kept_row = (i64::from(y) - i64::from(kept.y)).unsigned_abs() as usize;
            match self.half_widths.get(kept_row) {
                Some(&kept_half) => {
                    let (kept_half, kept_x) = (i64::from(kept_half), i64::from(kept.x));
                    push(y, first, last.min(kept_x - kept_half - 1));
                    push(y, first.max(kept_x + kept_half + 1), last);
                }
                None => push(y, first, last),
            }
        }
        stretches
    }

    /// Words of the storage, 64 cells each.
    pub(super) fn num_words(&self) -> usize {
        self.words.len()
    }

    /// Applies what a scan saw.
    pub(super) fn apply(&mut self, seen: &[Seen]) {
        for (planes, seen) in self.words.iter_mut().zip(seen) {
            if seen[FREE] != 0 {
                bit_planes::subtract(planes, seen[FREE], self.config.free_decrement);
            }
            if seen[HIT] != 0 {
                bit_planes::add(planes, seen[HIT], self.config.hit_increment);
            }
        }
    }

    /// Makes the floor around a cell free.
    pub(super) fn stamp_footprint(&mut self, center: Cell) {
        for &(dx, dy) in &self.footprint {
            let index = self.index(center.offset(dx, dy));
            bit_planes::set(&mut self.words[index >> 6], 1 << (index & 63), 0);
        }
    }
}

impl OccupancyRows for LocalMap {
    fn read_row(&self, start: Cell, free: &mut [u64], unknown: &mut [u64]) {
        let first = self.index(start);
        let (shift, num_words) = (first & 63, self.words.len());
        let word_at = |offset: usize| {
            let planes = &self.words[((first >> 6) + offset) & (num_words - 1)];
            let free = bit_planes::below(planes, self.config.free_below);
            (free, bit_planes::below(planes, self.config.occupied_above + 1) & !free)
        };
        let mut low = word_at(0);
        for (offset, (free, unknown)) in free.iter_mut().zip(unknown).enumerate() {
            let high = word_at(offset + 1);
            *free = joined(low.0, high.0, shift);
            *unknown = joined(low.1, high.1, shift);
            low = high;
        }
    }
}

/// 64 bits that begin `shift` bits into `low` and go on in `high`.
fn joined(low: u64, high: u64, shift: usize) -> u64 {
    if shift == 0 { low } else { low >> shift | high << (64 - shift) }
}

/// Calls `act(word, mask)` for the words that hold the `len` bits from `start`, round the end of the ring.
pub(super) fn for_each_word(start: usize, len: usize, index_mask: usize, mut act: impl FnMut(usize, u64)) {
    let (mut at, mut left) = (start, len);
    while left > 0 {
        let (bit, taken) = (at & 63, left.min(64 - (at & 63)));
        act(at >> 6, (u64::MAX >> (64 - taken)) << bit);
        at = (at + taken) & index_mask;
        left -= taken;
    }
}

/// Half width of each row of a disc, by its distance from the middle row.
fn half_widths(radius_cells: f64) -> Vec<i32> {
    let reach = radius_cells.floor() as i32;
    (0..=reach).map(|dy| (radius_cells.powi(2) - f64::from(dy).powi(2)).sqrt().floor() as i32).collect()
}

/// The cells within a radius of the middle.
fn disc(radius_cells: f64) -> Vec<(i32, i32)> {
    let half_widths = half_widths(radius_cells);
    let reach = half_widths.len() as i32 - 1;
    (-reach..=reach)
        .flat_map(|dy| {
            let half = half_widths[dy.unsigned_abs() as usize];
            (-half..=half).map(move |dx| (dx, dy))
        })
        .collect()
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
            let index = map.index(cell);
            bit_planes::set(&mut map.words[index >> 6], 1 << (index & 63), occupancy);
        }
        Ok(map)
    }
}

impl LocalMap {
    /// The cells within the radius, row by row; none before the first scan.
    fn disc_cells(&self) -> impl Iterator<Item = Cell> + '_ {
        let offsets = self.robot.map(|_| disc(self.config.radius_cells())).unwrap_or_default();
        let robot = self.robot.unwrap_or_default();
        offsets.into_iter().map(move |(dx, dy)| robot.offset(dx, dy))
    }
}
