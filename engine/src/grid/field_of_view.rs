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

/// A cell of the first quadrant, seen from the laser's cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewCell {
    /// Columns ahead, at least 1.
    pub dx: u8,
    /// Rows to the left.
    pub dy: u8,
    /// Squared distance in cells.
    pub squared: u16,
    /// Direction in 2⁻³² turns, below a quarter.
    pub angle: u32,
}

/// All cells of the first quadrant within the map's radius.
#[derive(Clone, Debug)]
pub(super) struct FieldOfView {
    cells: Vec<ViewCell>,
    sector_ends: Vec<usize>,
}

impl FieldOfView {
    /// The cells not farther than `radius_cells`, which is at most 255.
    pub fn new(radius_cells: f64) -> Self {
        let reach = radius_cells.floor() as u8;
        let limit = (radius_cells * radius_cells).floor() as u32;
        let mut cells = Vec::new();
        for dy in 0..=reach {
            for dx in 1..=reach {
                let squared = u32::from(dx).pow(2) + u32::from(dy).pow(2);
                if squared <= limit {
                    let angle = to_turns(f64::from(dy).atan2(f64::from(dx)));
                    cells.push(ViewCell { dx, dy, squared: squared as u16, angle });
                }
            }
        }
        cells.sort_by_key(|cell| (cell.angle / SECTOR_WIDTH, cell.squared, cell.angle));
        let sector_ends = (1..=SECTORS_PER_QUADRANT as u32)
            .map(|sector| cells.partition_point(|cell| cell.angle / SECTOR_WIDTH < sector))
            .collect();
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
