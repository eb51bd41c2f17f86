//! Which cells a scan sees: the cells around a laser, looked up by direction, nearest first.
//!
//! Angle and squared distance of every cell around the laser's cell are computed once. Cells are grouped into narrow
//! sectors and sorted by distance within each, so that a scan visits only what lies before its readings. The first
//! quadrant serves all four: a quarter turn maps cells to cells.

use std::f64::consts::TAU;

/// Sectors of a quarter turn.
pub(super) const SECTORS_PER_QUADRANT: usize = 64;

/// Sectors of a full turn.
pub(super) const NUM_SECTORS: usize = 4 * SECTORS_PER_QUADRANT;

/// Angle between the edges of a sector, in 2⁻³² turns.
pub(super) const SECTOR_WIDTH: u32 = 1 << (30 - SECTORS_PER_QUADRANT.ilog2());

/// A cell of the first quadrant, seen from the laser's cell; five bytes, as every open run keeps thousands.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewCell {
    /// Columns ahead, at least 1.
    pub dx: u8,
    /// Rows to the left.
    pub dy: u8,
    /// Direction from the start of the sector, in 2⁻³² turns: below [`SECTOR_WIDTH`], so three bytes hold it.
    angle: [u8; 3],
}

impl ViewCell {
    fn new(dx: u8, dy: u8) -> Self {
        let [a, b, c, _] = (direction(dx, dy) % SECTOR_WIDTH).to_le_bytes();
        Self { dx, dy, angle: [a, b, c] }
    }

    /// Squared distance in cells.
    pub fn squared(&self) -> u32 {
        squared(self.dx, self.dy)
    }

    /// Direction from the start of the cell's sector, in 2⁻³² turns.
    pub fn angle_in_sector(&self) -> u32 {
        let [a, b, c] = self.angle;
        u32::from_le_bytes([a, b, c, 0])
    }
}

fn squared(dx: u8, dy: u8) -> u32 {
    u32::from(dx).pow(2) + u32::from(dy).pow(2)
}

/// Direction of a cell in 2⁻³² turns, below a quarter.
fn direction(dx: u8, dy: u8) -> u32 {
    to_turns(f64::from(dy).atan2(f64::from(dx)))
}

/// All cells of the first quadrant within the map's radius.
#[derive(Clone, Debug)]
pub(super) struct FieldOfView {
    cells: Box<[ViewCell]>,
    sector_ends: Vec<usize>,
}

impl FieldOfView {
    /// The cells not farther than `radius_cells`, which is at most 255.
    pub fn new(radius_cells: f64) -> Self {
        let reach = radius_cells.floor() as u8;
        let limit = (radius_cells * radius_cells).floor() as u32;
        let all = (0..=reach).flat_map(|dy| (1..=reach).map(move |dx| (dx, dy)));
        let mut cells: Vec<(u8, u8)> = all.filter(|&(dx, dy)| squared(dx, dy) <= limit).collect();
        let sector_of = |dx, dy| direction(dx, dy) / SECTOR_WIDTH;
        cells.sort_by_cached_key(|&(dx, dy)| (sector_of(dx, dy), squared(dx, dy), direction(dx, dy)));
        let sector_ends = (1..=SECTORS_PER_QUADRANT as u32)
            .map(|sector| cells.partition_point(|&(dx, dy)| sector_of(dx, dy) < sector))
            .collect();
        let cells = cells.into_iter().map(|(dx, dy)| ViewCell::new(dx, dy)).collect();
        Self { cells, sector_ends }
    }

    /// The cells of a sector, nearest first.
    pub fn sector(&self, sector: usize) -> &[ViewCell] {
        let start = if sector == 0 { 0 } else { self.sector_ends[sector - 1] };
        &self.cells[start..self.sector_ends[sector]]
    }
}

/// An angle in 2⁻³² turns; the wrap of the integer is the wrap of the circle.
pub(super) fn to_turns(angle_rad: f64) -> u32 {
    ((angle_rad / TAU).rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32
}
