//! The cells within the map's radius, and where a cell stands in the storage.

use super::Cell;

/// Farther apart than any two discs that share a cell, in cells.
const FAR_CELLS: i64 = 1024;

/// A disc of cells on a torus that is laid out as a helix: the cell (x, y) stands at `(y · side + x) mod side²`.
#[derive(Clone, Debug)]
pub(super) struct Disc {
    side_log2: u32,
    /// Half width in cells of each row, by its distance from the middle row.
    half_widths: Vec<i32>,
}

impl Disc {
    /// A disc of a radius, at most 255 cells, on a torus of `1 << side_log2` cells a side.
    pub fn new(radius_cells: f64, side_log2: u32) -> Self {
        Self { side_log2, half_widths: half_widths(radius_cells) }
    }

    /// Where a cell stands on the helix.
    pub fn index(&self, cell: Cell) -> usize {
        (cell.y.wrapping_shl(self.side_log2).wrapping_add(cell.x)) as usize & self.index_mask()
    }

    pub fn index_mask(&self) -> usize {
        (1 << (2 * self.side_log2)) - 1
    }

    /// Whether a cell lies within the disc around another.
    pub fn contains(&self, center: Cell, cell: Cell) -> bool {
        let (dx, dy) = difference(cell, center);
        self.half_widths.get(dy.unsigned_abs() as usize).is_some_and(|&half| dx.abs() <= half)
    }

    /// Calls `act(word, mask)` for the cells, 64 to a word of the helix, of the disc around `center` that lie outside
    /// the disc around `kept`.
    #[inline(always)]
    pub fn for_each_outside(&self, center: Cell, kept: Cell, mut act: impl FnMut(usize, u64)) {
        let (dx, dy) = difference(kept, center);
        let radius = self.half_widths.len() as i32 - 1;
        for row in -radius..=radius {
            let half = self.half_widths[row.unsigned_abs() as usize];
            let width = 2 * half + 1;
            // How many cells at either end of the row the kept disc leaves.
            let (left, right) = match self.half_widths.get((row - dy).unsigned_abs() as usize) {
                Some(&kept_half) => {
                    let left = (half + dx - kept_half).clamp(0, width);
                    (left, (half - dx - kept_half).clamp(0, width - left))
                }
                None => (width, 0),
            };
            if left | right != 0 {
                let first = self.index(center.offset(-half, row));
                for_each_word(first, left, self.index_mask(), &mut act);
                let end = first.wrapping_add(width as usize);
                for_each_word(end.wrapping_sub(right as usize), right, self.index_mask(), &mut act);
            }
        }
    }
}

/// Calls `act(word, mask)` for the words that hold the `len` bits from `start`, round the end of the ring.
#[inline(always)]
fn for_each_word(start: usize, len: i32, index_mask: usize, act: &mut impl FnMut(usize, u64)) {
    if len == 0 {
        return;
    }
    let (start, last) = (start & index_mask, start.wrapping_add(len as usize - 1));
    let (first_word, last_word) = (start >> 6, (last & index_mask) >> 6);
    let (from_start, to_last) = (u64::MAX << (start & 63), u64::MAX >> (63 - (last & 63)));
    if first_word == last_word {
        return act(first_word, from_start & to_last);
    }
    act(first_word, from_start);
    let mut word = (first_word + 1) & (index_mask >> 6);
    while word != last_word {
        act(word, u64::MAX);
        word = (word + 1) & (index_mask >> 6);
    }
    act(last_word, to_last);
}

/// Columns and rows from one cell to another; far is far enough.
fn difference(to: Cell, from: Cell) -> (i32, i32) {
    let apart = |to: i32, from: i32| (i64::from(to) - i64::from(from)).clamp(-FAR_CELLS, FAR_CELLS) as i32;
    (apart(to.x, from.x), apart(to.y, from.y))
}

/// Half width of each row of a disc, by its distance from the middle row.
fn half_widths(radius_cells: f64) -> Vec<i32> {
    let reach = radius_cells.floor() as i32;
    (0..=reach).map(|dy| (radius_cells.powi(2) - f64::from(dy).powi(2)).sqrt().floor() as i32).collect()
}

/// The cells within a radius of the middle, row by row.
pub(super) fn cells_within(radius_cells: f64) -> Vec<(i32, i32)> {
    let half_widths = half_widths(radius_cells);
    let reach = half_widths.len() as i32 - 1;
    (-reach..=reach)
        .flat_map(|dy| {
            let half = half_widths[dy.unsigned_abs() as usize];
            (-half..=half).map(move |dx| (dx, dy))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_one_disc_has_beyond_another_is_found_cell_by_cell(
            radius in 5.0..30.0f64, x in any::<i32>(), y in any::<i32>(),
            (dx, dy) in prop_oneof![(-3..4, -3..4), (-70..70, -70..70), (any::<i32>(), any::<i32>())],
        ) {
            let (disc, center) = (Disc::new(radius, 6), Cell::new(x, y));
            let kept = center.offset(dx, dy);
            let mut found = vec![0u64; 64];
            disc.for_each_outside(center, kept, |word, mask| {
                assert_eq!(found[word] & mask, 0, "a cell was named twice");
                found[word] |= mask;
            });
            let mut expected = vec![0u64; 64];
            for (dx, dy) in cells_within(radius) {
                let cell = center.offset(dx, dy);
                // Cells beyond the end of the numbers come back at the other.
                if !disc.contains(kept, cell) {
                    expected[disc.index(cell) >> 6] |= 1 << (disc.index(cell) & 63);
                }
            }
            prop_assert_eq!(found, expected);
        }
    }
}
