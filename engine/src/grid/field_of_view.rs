//! Which cells a scan sees: the cells around a laser, looked up by direction, nearest first.
//!
//! Angle and squared distance of every cell around the laser's cell are computed once. Cells are grouped into narrow
//! sectors and sorted by distance within each, so that a scan visits only what lies before its readings. What lies
//! well before them is also kept as words of bits, by rings a few cells deep. Maps of one radius share one table.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::Cell;

/// Sectors of a quarter turn.
pub(super) const SECTORS_PER_QUADRANT: usize = 32;

/// Sectors of a full turn.
pub(super) const NUM_SECTORS: usize = 4 * SECTORS_PER_QUADRANT;

/// Angle between the edges of a sector, in 2⁻³² turns.
pub(super) const SECTOR_WIDTH: u32 = 1 << (30 - SECTORS_PER_QUADRANT.ilog2());

/// Depth of a ring, of which a sector is freed as a whole, in cells.
const RING_CELLS: usize = 4;

/// Low bits of a direction that are left out where cells are told apart.
const ANGLE_SHIFT: u32 = 9;

/// Cells of a sector that are judged at once.
pub(super) const CHUNK: usize = 8;

/// Cells of one word of the view's helix, all of one ring of one sector.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewWord {
    pub cells: u64,
    pub word: usize,
}

/// All cells within the map's radius around a laser.
#[derive(Clone, Debug, Default)]
pub(super) struct FieldOfView {
    /// Squared radius in cells and the side of the helix decide everything else.
    limit_squared: u16,
    side: i32,
    /// Squared distances of the cells of the first quadrant, which serves all four, by sector and then distance, in
    /// cells; behind each sector a chunk of nothing.
    squared: Box<[u32]>,
    /// Directions of these cells from the start of their sector, in 2⁻³² turns.
    angles: Box<[u32]>,
    /// Where these cells lie on the view's helix, for each quadrant.
    indices: [Box<[u32]>; 4],
    /// For every sector of a quadrant, where its rings begin among the cells, and where the last ends.
    rings: Box<[u32]>,
    /// The cells of all quadrants by sector and ring, those of one word together, around the view's centre.
    words: Box<[ViewWord]>,
    /// For every sector of a turn, where its rings begin among the words, and where the last ends.
    word_rings: Box<[u32]>,
    /// Rings of a sector.
    num_rings: usize,
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
        let squared = |(dx, dy): (i32, i32)| dx * dx + dy * dy;
        let mut cells: Vec<(i32, i32)> =
            all.filter(|&cell| squared(cell) <= i32::from(limit_squared)).collect();
        let sector_of = |(dx, dy)| direction(dx, dy) / SECTOR_WIDTH;
        cells.sort_by_cached_key(|&cell| (sector_of(cell), squared(cell), direction(cell.0, cell.1)));
        let num_rings = reach as usize / RING_CELLS + 1;
        let ring_of = |cell| squared(cell).isqrt() as usize / RING_CELLS;
        let mut view = Self { limit_squared, side, num_rings, ..Self::default() };
        let (mut kept, mut rings) = (Vec::new(), Vec::new());
        for sector in 0..SECTORS_PER_QUADRANT as u32 {
            let first = cells.partition_point(|&cell| sector_of(cell) < sector);
            let cells = &cells[first..cells.partition_point(|&cell| sector_of(cell) <= sector)];
            let ring_start = |ring| kept.len() + cells.partition_point(|&cell| ring_of(cell) < ring);
            rings.extend((0..=num_rings).map(|ring| ring_start(ring) as u32));
            kept.extend(cells.iter().map(|&cell| Some(cell)).chain([None; CHUNK]));
        }
        view.rings = rings.into();
        view.squared = kept.iter().map(|cell| cell.map_or(NOWHERE, |cell| squared(cell) as u32)).collect();
        let angle_in_sector = |(dx, dy)| ((direction(dx, dy) % SECTOR_WIDTH) >> ANGLE_SHIFT) << ANGLE_SHIFT;
        view.angles = kept.iter().map(|cell| cell.map_or(0, angle_in_sector)).collect();
        // A quarter turn maps (dx, dy) to (−dy, dx).
        let turned =
            |quadrant: usize, (dx, dy): (i32, i32)| [(dx, dy), (-dy, dx), (-dx, -dy), (dy, -dx)][quadrant];
        let index = |(dx, dy)| (view.center() + dx + dy * side) as u32;
        view.indices = std::array::from_fn(|quadrant| {
            kept.iter().map(|cell| index(turned(quadrant, cell.unwrap_or_default()))).collect()
        });
        let (mut words, mut word_rings) = (Vec::new(), Vec::new());
        for sector in 0..NUM_SECTORS {
            for ring in 0..num_rings {
                word_rings.push(words.len() as u32);
                let (indices, cells) =
                    (&view.indices[sector / SECTORS_PER_QUADRANT], view.cells(sector, ring, ring + 1));
                words.extend(words_of(indices[cells].iter().map(|&index| index as usize)));
            }
            word_rings.push(words.len() as u32);
        }
        (view.words, view.word_rings) = (words.into(), word_rings.into());
        view
    }

    /// Where the cells of some rings of a sector stand among those of the quadrant.
    #[inline(always)]
    fn cells(&self, sector: usize, first_ring: usize, end_ring: usize) -> Range<usize> {
        let first = sector % SECTORS_PER_QUADRANT * (self.num_rings + 1);
        self.rings[first + first_ring] as usize..self.rings[first + end_ring] as usize
    }

    /// Where the laser's cell stands on the view's helix, which is as long as the map's: no cell in view then lies
    /// across its end.
    pub fn center(&self) -> i32 {
        (self.side + 1) * self.side / 2
    }

    /// The laser's cell on a map that were laid out as the view.
    pub fn center_cell(&self) -> Cell {
        Cell::new(self.side / 2, self.side / 2)
    }

    /// Words of the view's helix.
    pub fn num_words(&self) -> usize {
        (self.side * self.side) as usize >> 6
    }

    /// How many rings of a sector lie below a squared distance.
    #[inline(always)]
    pub fn num_rings_within(&self, limit: u32) -> usize {
        // A float holds squared distances exactly, and roots of squares too.
        ((limit as f32).sqrt() as usize / RING_CELLS).min(self.num_rings)
    }

    /// All cells of the first rings of a sector.
    #[inline(always)]
    pub fn words_of_rings(&self, sector: usize, num_rings: usize) -> &[ViewWord] {
        let first = sector * (self.num_rings + 1);
        &self.words[self.word_rings[first] as usize..self.word_rings[first + num_rings] as usize]
    }

    /// The cells of a sector beyond its first rings and below a squared distance, nearest first, and some more or
    /// cells that are nowhere to fill the last chunk.
    #[inline(always)]
    pub fn chunks_beyond_rings(
        &self,
        sector: usize,
        num_rings: usize,
        reach: u32,
    ) -> impl Iterator<Item = ViewChunk<'_>> {
        let cells = self.cells(sector, num_rings, self.num_rings);
        let cells = cells.start..cells.end + CHUNK;
        let squared = self.squared[cells.clone()].as_chunks().0.iter();
        let angles = self.angles[cells.clone()].as_chunks().0;
        let indices = self.indices[sector / SECTORS_PER_QUADRANT][cells].as_chunks().0;
        squared
            .zip(angles)
            .zip(indices)
            .take_while(move |((squared, _), _)| squared[0] < reach)
            .map(|((squared, angles), indices)| ViewChunk { squared, angles, indices })
    }
}

/// Neighbouring cells of a sector.
pub(super) struct ViewChunk<'a> {
    /// Squared distances in cells.
    pub squared: &'a [u32; CHUNK],
    /// Directions from the start of the sector, in 2⁻³² turns.
    pub angles: &'a [u32; CHUNK],
    /// Where they stand on the view's helix.
    pub indices: &'a [u32; CHUNK],
}

/// Squared distance of a cell that fills a chunk: beyond all readings.
const NOWHERE: u32 = u32::MAX;

/// Places on a helix as words that hold them.
fn words_of(indices: impl Iterator<Item = usize>) -> impl Iterator<Item = ViewWord> {
    let mut words = BTreeMap::new();
    for index in indices {
        *words.entry(index >> 6).or_insert(0) |= 1 << (index & 63);
    }
    words.into_iter().map(|(word, cells)| ViewWord { cells, word })
}

/// Direction of a cell in 2⁻³² turns.
fn direction(dx: i32, dy: i32) -> u32 {
    to_turns(f64::from(dy).atan2(f64::from(dx)))
}

/// An angle in 2⁻³² turns; the wrap of the integer is the wrap of the circle.
pub(super) fn to_turns(angle_rad: f64) -> u32 {
    ((angle_rad / TAU).rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_and_chunks_hold_every_cell_of_their_sector_once() {
        let view = FieldOfView::new(30 * 30, 128);
        for sector in 0..NUM_SECTORS {
            for num_rings in 0..=view.num_rings {
                let mut found: Vec<usize> = Vec::new();
                for entry in view.words_of_rings(sector, num_rings) {
                    let bits = (0..64).filter(|bit| entry.cells >> bit & 1 == 1);
                    found.extend(bits.map(|bit| entry.word * 64 + bit));
                }
                for chunk in view.chunks_beyond_rings(sector, num_rings, 901) {
                    let cells = chunk.squared.iter().zip(chunk.indices);
                    found.extend(cells.filter(|cell| *cell.0 != NOWHERE).map(|cell| *cell.1 as usize));
                }
                found.sort_unstable();
                let expected: Vec<usize> = (-30i32..=30)
                    .flat_map(|dy| (-30i32..=30).map(move |dx| (dx, dy)))
                    .filter(|&(dx, dy)| (dx, dy) != (0, 0) && dx * dx + dy * dy <= 900)
                    .filter(|&(dx, dy)| direction(dx, dy) / SECTOR_WIDTH == sector as u32)
                    .map(|(dx, dy)| (view.center() + dx + dy * 128) as usize)
                    .collect();
                assert_eq!(found, expected);
            }
        }
    }
}
