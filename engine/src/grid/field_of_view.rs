//! Which cells a scan sees: the cells around a laser, looked up by direction, nearest first.
//!
//! Angle and squared distance of every cell around the laser's cell are computed once. Cells are grouped into narrow
//! sectors and sorted by distance within each, so that a scan visits only what lies before its readings. The first
//! quadrant serves all four: a quarter turn maps cells to cells. Maps of one radius share one table.

use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Sectors of a quarter turn.
pub(super) const SECTORS_PER_QUADRANT: usize = 32;

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
    /// Direction from the start of the sector, in 2⁻³² turns.
    pub angle_in_sector: u32,
}

impl ViewCell {
    fn new(dx: u8, dy: u8) -> Self {
        Self { dx, dy, squared: squared(dx, dy), angle_in_sector: direction(dx, dy) % SECTOR_WIDTH }
    }
}

/// Squared distance of a cell in cells; within 255 cells it fits.
fn squared(dx: u8, dy: u8) -> u16 {
    (u32::from(dx).pow(2) + u32::from(dy).pow(2)) as u16
}

/// Direction of a cell in 2⁻³² turns, below a quarter.
fn direction(dx: u8, dy: u8) -> u32 {
    to_turns(f64::from(dy).atan2(f64::from(dx)))
}

/// All cells of the first quadrant within the map's radius.
#[derive(Clone, Debug)]
pub(super) struct FieldOfView {
    /// Squared radius in cells; it decides everything else.
    limit_squared: u16,
    cells: Box<[ViewCell]>,
    sector_ends: Vec<usize>,
    /// For every sector and every whole distance up to the radius, how many of its cells are nearer.
    num_nearer: Box<[u16]>,
    /// Distances per sector.
    num_distances: usize,
}

/// The tables in use, so that a thousand open runs hold one.
static SHARED: Mutex<Vec<Weak<FieldOfView>>> = Mutex::new(Vec::new());

impl FieldOfView {
    /// The table of the cells not farther than `radius_cells`, which is at most 255; made when nobody has it yet.
    pub fn shared(radius_cells: f64) -> Arc<Self> {
        let limit_squared = (radius_cells * radius_cells).floor() as u16;
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        shared.retain(|table| table.strong_count() > 0);
        let known =
            shared.iter().filter_map(Weak::upgrade).find(|table| table.limit_squared == limit_squared);
        known.unwrap_or_else(|| {
            let table = Arc::new(Self::new(limit_squared));
            shared.push(Arc::downgrade(&table));
            table
        })
    }

    fn new(limit_squared: u16) -> Self {
        let reach = limit_squared.isqrt() as u8;
        let all = (0..=reach).flat_map(|dy| (1..=reach).map(move |dx| (dx, dy)));
        let wide = |length: u8| u32::from(length).pow(2);
        let is_within = |dx: u8, dy: u8| wide(dx) + wide(dy) <= u32::from(limit_squared);
        let mut cells: Vec<(u8, u8)> = all.filter(|&(dx, dy)| is_within(dx, dy)).collect();
        let sector_of = |dx, dy| direction(dx, dy) / SECTOR_WIDTH;
        cells.sort_by_cached_key(|&(dx, dy)| (sector_of(dx, dy), squared(dx, dy), direction(dx, dy)));
        let sector_ends = (1..=SECTORS_PER_QUADRANT as u32)
            .map(|sector| cells.partition_point(|&(dx, dy)| sector_of(dx, dy) < sector))
            .collect();
        let cells = cells.into_iter().map(|(dx, dy)| ViewCell::new(dx, dy)).collect();
        let num_distances = usize::from(reach) + 1;
        let mut view = Self { limit_squared, cells, sector_ends, num_nearer: Box::default(), num_distances };
        view.num_nearer = (0..SECTORS_PER_QUADRANT * num_distances)
            .map(|entry| {
                let distance_squared = (entry % num_distances).pow(2);
                let is_nearer = |cell: &ViewCell| usize::from(cell.squared) < distance_squared;
                view.sector(entry / num_distances).partition_point(is_nearer) as u16
            })
            .collect();
        view
    }

    /// The cells of a sector, nearest first.
    pub fn sector(&self, sector: usize) -> &[ViewCell] {
        let start = if sector == 0 { 0 } else { self.sector_ends[sector - 1] };
        &self.cells[start..self.sector_ends[sector]]
    }

    /// The cells of a sector: first those whose squared distance is surely below a limit, nearly all of them, then
    /// the others.
    pub fn split_sector(&self, sector: usize, limit: u32) -> (&[ViewCell], &[ViewCell]) {
        // A float holds squared distances exactly, and roots of squares too.
        let distance = ((limit as f32).sqrt() as usize).min(self.num_distances - 1);
        let num_nearer = self.num_nearer[sector * self.num_distances + distance];
        self.sector(sector).split_at(usize::from(num_nearer))
    }
}

/// An angle in 2⁻³² turns; the wrap of the integer is the wrap of the circle.
pub(super) fn to_turns(angle_rad: f64) -> u32 {
    ((angle_rad / TAU).rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32
}
