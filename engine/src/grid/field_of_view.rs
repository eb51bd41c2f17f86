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

/// Low bits of a direction that a cell's entry does not keep.
const ANGLE_SHIFT: u32 = SECTOR_WIDTH.ilog2() - 16;

/// A cell as the beam that meets it is looked up.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewCell {
    /// Squared distance in cells; within 255 cells it fits.
    pub squared: u16,
    /// Direction from the start of the sector, in 2⁻¹⁶ sectors.
    angle: u16,
}

impl ViewCell {
    /// Direction from the start of the sector, in 2⁻³² turns.
    pub fn angle_in_sector(self) -> u32 {
        u32::from(self.angle) << ANGLE_SHIFT
    }
}

/// All cells of the first quadrant within the map's radius.
#[derive(Clone, Debug)]
pub(super) struct FieldOfView {
    /// Squared radius in cells and the side of the helix decide everything else.
    limit_squared: u16,
    side: i32,
    cells: Box<[ViewCell]>,
    /// Where the cells lie on the helix, counted from the laser's: seen ahead of it, and turned left by a quarter.
    offsets: [Box<[i32]>; 2],
    sector_ends: Vec<usize>,
    /// For every sector and every whole distance up to the radius, how many of its cells are nearer.
    num_nearer: Box<[u16]>,
    /// Distances per sector.
    num_distances: usize,
}

/// The tables in use, so that a thousand open runs hold one.
static SHARED: Mutex<Vec<Weak<FieldOfView>>> = Mutex::new(Vec::new());

impl FieldOfView {
    /// The table of the cells not farther than `radius_cells`, which is at most 255, on a helix of a side; made when
    /// nobody has it yet.
    pub fn shared(radius_cells: f64, side: i32) -> Arc<Self> {
        let limit_squared = (radius_cells * radius_cells).floor() as u16;
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        shared.retain(|table| table.strong_count() > 0);
        let known = shared
            .iter()
            .filter_map(Weak::upgrade)
            .find(|table| (table.limit_squared, table.side) == (limit_squared, side));
        known.unwrap_or_else(|| {
            let table = Arc::new(Self::new(limit_squared, side));
            shared.push(Arc::downgrade(&table));
            table
        })
    }

    fn new(limit_squared: u16, side: i32) -> Self {
        let reach = limit_squared.isqrt() as i32;
        let all = (0..=reach).flat_map(|dy| (1..=reach).map(move |dx| (dx, dy)));
        let squared = |dx: i32, dy: i32| dx * dx + dy * dy;
        let mut cells: Vec<(i32, i32)> =
            all.filter(|&(dx, dy)| squared(dx, dy) <= i32::from(limit_squared)).collect();
        let sector_of = |dx, dy| direction(dx, dy) / SECTOR_WIDTH;
        cells.sort_by_cached_key(|&(dx, dy)| (sector_of(dx, dy), squared(dx, dy), direction(dx, dy)));
        let sector_ends = (1..=SECTORS_PER_QUADRANT as u32)
            .map(|sector| cells.partition_point(|&(dx, dy)| sector_of(dx, dy) < sector))
            .collect();
        // A quarter turn maps (dx, dy) to (−dy, dx).
        let offsets = [
            cells.iter().map(|&(dx, dy)| dx + dy * side).collect(),
            cells.iter().map(|&(dx, dy)| dx * side - dy).collect(),
        ];
        let cells = cells
            .into_iter()
            .map(|(dx, dy)| ViewCell {
                squared: squared(dx, dy) as u16,
                angle: ((direction(dx, dy) % SECTOR_WIDTH) >> ANGLE_SHIFT) as u16,
            })
            .collect();
        let num_distances = reach as usize + 1;
        let num_nearer = Box::default();
        let mut view = Self { limit_squared, side, cells, offsets, sector_ends, num_nearer, num_distances };
        view.num_nearer = (0..SECTORS_PER_QUADRANT * num_distances)
            .map(|entry| {
                let distance_squared = (entry % num_distances).pow(2);
                let is_nearer = |cell: &ViewCell| usize::from(cell.squared) < distance_squared;
                view.sector(entry / num_distances).0.partition_point(is_nearer) as u16
            })
            .collect();
        view
    }

    /// The cells of a sector, nearest first, with where they lie on the helix from the laser's cell; the last is the
    /// sign of these offsets, as half a turn only reverses them.
    pub fn sector(&self, sector: usize) -> (&[ViewCell], &[i32], i32) {
        let (quadrant, sector) = (sector / SECTORS_PER_QUADRANT, sector % SECTORS_PER_QUADRANT);
        let start = if sector == 0 { 0 } else { self.sector_ends[sector - 1] };
        let cells = start..self.sector_ends[sector];
        let sign = if quadrant < 2 { 1 } else { -1 };
        (&self.cells[cells.clone()], &self.offsets[quadrant % 2][cells], sign)
    }

    /// How many cells of a sector have a squared distance surely below a limit: nearly all that have.
    pub fn num_nearer(&self, sector: usize, limit: u32) -> usize {
        // A float holds squared distances exactly, and roots of squares too.
        let distance = ((limit as f32).sqrt() as usize).min(self.num_distances - 1);
        let sector = sector % SECTORS_PER_QUADRANT;
        usize::from(self.num_nearer[sector * self.num_distances + distance])
    }
}

/// Direction of a cell in 2⁻³² turns, below a quarter.
fn direction(dx: i32, dy: i32) -> u32 {
    to_turns(f64::from(dy).atan2(f64::from(dx)))
}

/// An angle in 2⁻³² turns; the wrap of the integer is the wrap of the circle.
pub(super) fn to_turns(angle_rad: f64) -> u32 {
    ((angle_rad / TAU).rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32
}
