//! The arcs of a sliding disc as words: bit `row` of word `k` is the cell where the disc's edge stands in that row when
//! the disc is centred on column `k`.
//!
//! A row of the map, moved by the half chord of the disc there and turned on its side, gives one bit of every word; 64
//! rows and 64 columns are turned at once.

use super::bit_window::{BitPlanes, Row, and, or, shifted_left, shifted_right, span};
use super::kernel_rows::KernelRows;

/// Cells by which planes of bits must reach beyond the map for the arcs of a kernel.
pub(super) const fn margin(kernel: &KernelRows) -> usize {
    3 * kernel.radius() + 80
}

/// What does not change as a disc moves.
#[derive(Clone, Debug)]
pub(super) struct DiscShape<const W: usize> {
    /// Half chord of each row, from the lowest.
    pub half_chords: Vec<usize>,
    /// Columns of each row, the first bit being the disc's leftmost column.
    pub disc: Vec<Row<W>>,
    /// Rows whose upper neighbour has the same half chord.
    pub links: Row<W>,
    /// Rows of each length of half chord.
    by_chord: Vec<(usize, Row<W>)>,
    /// Rows of the lower and of the upper half by how much longer the half chord of their inner neighbour is.
    by_growth: Vec<(usize, Row<W>, Row<W>)>,
    /// The next row towards the middle, for rows whose half chord is shorter than that row's.
    inner_rows: Vec<Option<usize>>,
}

impl<const W: usize> DiscShape<W> {
    /// The disc of a kernel.
    pub fn new(kernel: &KernelRows) -> Self {
        let radius = kernel.radius();
        let num_rows = 2 * radius + 1;
        let half_chords: Vec<usize> =
            (0..num_rows).map(|row| kernel.half_chord(row.abs_diff(radius)).unwrap_or(0)).collect();
        let rows_where = |is_one: &dyn Fn(usize) -> bool| {
            (0..num_rows)
                .filter(|&row| is_one(row))
                .fold([0; W], |rows, row| or(&rows, &span(row as i64, row as i64)))
        };
        let inner_row = |row: usize| match row.cmp(&radius) {
            std::cmp::Ordering::Less => row + 1,
            std::cmp::Ordering::Equal => row,
            std::cmp::Ordering::Greater => row - 1,
        };
        let growth = |row: usize| half_chords[inner_row(row)] - half_chords[row];
        let by_chord = (0..=radius)
            .filter(|half| half_chords.contains(half))
            .map(|half| (half, rows_where(&|row| half_chords[row] == half)))
            .collect();
        let by_growth = (1..=radius)
            .filter(|&by| (0..num_rows).any(|row| growth(row) == by))
            .map(|by| {
                let lower = rows_where(&|row| row < radius && growth(row) == by);
                (by, lower, rows_where(&|row| row > radius && growth(row) == by))
            })
            .collect();
        let (reach, half) = (radius as i64, |row: usize| half_chords[row] as i64);
        Self {
            disc: (0..num_rows).map(|row| span(reach - half(row), reach + half(row))).collect(),
            links: rows_where(&|row| row + 1 < num_rows && half_chords[row] == half_chords[row + 1]),
            by_chord,
            by_growth,
            inner_rows: (0..num_rows).map(|row| (growth(row) > 0).then(|| inner_row(row))).collect(),
            half_chords,
        }
    }

    /// Rows of the disc.
    pub fn num_rows(&self) -> usize {
        self.half_chords.len()
    }

    /// Which cells of the left arc around `arc` belong to a fill that is kept by entered arcs.
    #[inline(always)]
    pub fn leaving(&self, reach: &[Row<W>], arc: usize) -> Row<W> {
        let mut leaving = [0; W];
        for (half, rows) in &self.by_chord {
            leaving = or(&leaving, &and(&reach[arc - 2 * half], rows));
        }
        leaving
    }

    /// For the cells of the right arc around `arc` whose inner neighbour lies deeper in the disc: whether that
    /// neighbour is reached, and whether it is free.
    #[inline(always)]
    pub fn inner(&self, reach: &[Row<W>], free: &[Row<W>], arc: usize) -> (Row<W>, Row<W>) {
        let (mut is_reached, mut is_free) = ([0; W], [0; W]);
        for (by, lower, upper) in &self.by_growth {
            let seen_from =
                |cells: &Row<W>| or(&and(&shifted_left(cells), lower), &and(&shifted_right(cells), upper));
            is_reached = or(&is_reached, &seen_from(&reach[arc - by]));
            is_free = or(&is_free, &seen_from(&free[arc - by]));
        }
        (is_reached, is_free)
    }

    /// Turns a fill given row by row into the arcs through which its cells entered, of which there are as many as
    /// rows, the last being the one around the fill's centre.
    #[inline(always)]
    pub fn by_arcs(&self, rows: &[Row<W>], reach: &mut [Row<W>]) {
        let radius = self.half_chords.len() / 2;
        for (group, (rows, half_chords)) in rows.chunks(64).zip(self.half_chords.chunks(64)).enumerate() {
            let mut squares = [[0u64; 64]; W];
            for (row, (bits, half)) in rows.iter().zip(half_chords).enumerate() {
                // Bit b of the row is column b − radius; it entered half a chord earlier.
                for (square, word) in squares.iter_mut().zip(moved_right(bits, radius - half)) {
                    square[row] = word;
                }
            }
            for (square, reach) in squares.iter_mut().zip(reach.chunks_mut(64)) {
                turn(square);
                for (arc, &bits) in reach.iter_mut().zip(&*square) {
                    arc[group] = bits;
                }
            }
        }
    }
}

/// Every cell of a row moved to higher bits.
#[inline(always)]
fn moved_right<const W: usize>(row: &Row<W>, by: usize) -> Row<W> {
    let (words, bits) = (by / 64, by % 64);
    std::array::from_fn(|word| {
        let high = if word >= words { row[word - words] << bits } else { 0 };
        // Two shifts, as none moves by a whole word.
        let low = if word > words { row[word - words - 1] >> 1 >> (63 - bits) } else { 0 };
        high | low
    })
}

/// The arcs of all centres of a row.
#[derive(Clone, Debug, Default)]
pub(super) struct ArcPlanes<const W: usize> {
    /// Free cells of the left arc.
    pub leaving_free: Vec<Row<W>>,
    /// Cells of the left arc with an unknown neighbour.
    pub leaving_open: Vec<Row<W>>,
    /// Free inner neighbours of the cells of the left arc that stay in the disc.
    pub leaving_inner: Vec<Row<W>>,
    /// Free cells of the right arc.
    pub entering_free: Vec<Row<W>>,
    /// Cells of the right arc with an unknown neighbour.
    pub entering_open: Vec<Row<W>>,
}

impl<const W: usize> ArcPlanes<W> {
    /// Cuts the arcs of `num_arcs` centres, and one more, out of the planes; `corner` is the padded column of the
    /// first centre and the padded row of the disc's lowest row.
    #[inline(always)]
    pub fn cut(&mut self, planes: &BitPlanes, shape: &DiscShape<W>, corner: (usize, usize), num_arcs: usize) {
        let half = |row: usize| shape.half_chords[row] as i64;
        let free = |row: usize, column: usize| planes.free_row::<1>(row, column)[0];
        let open = |row: usize, column: usize| planes.open_row::<1>(row, column)[0];
        let num_rows = shape.num_rows();
        let cut = |into: &mut Vec<Row<W>>, word: &dyn Fn(usize, usize) -> u64| {
            turn_rows(into, num_rows, num_arcs + 1, corner.0, word);
        };
        let at = |column: usize, off: i64| (column as i64 + off) as usize;
        cut(&mut self.leaving_free, &|row, column| free(corner.1 + row, at(column, -half(row))));
        cut(&mut self.leaving_open, &|row, column| open(corner.1 + row, at(column, -half(row))));
        cut(&mut self.entering_free, &|row, column| free(corner.1 + row, at(column, half(row))));
        cut(&mut self.entering_open, &|row, column| open(corner.1 + row, at(column, half(row))));
        cut(&mut self.leaving_inner, &|row, column| match shape.inner_rows[row] {
            Some(inner) => free(corner.1 + inner, at(column, -half(row))),
            None => 0,
        });
    }
}

/// Turns rows of bits, given 64 at a time by `word(row, column)`, into `num_columns` words of a bit per row.
#[inline(always)]
fn turn_rows<const W: usize>(
    into: &mut Vec<Row<W>>,
    num_rows: usize,
    num_columns: usize,
    first_column: usize,
    word: &dyn Fn(usize, usize) -> u64,
) {
    into.clear();
    into.resize(num_columns, [0; W]);
    for start in (0..num_columns).step_by(64) {
        for group in 0..W {
            let mut square = [0u64; 64];
            for (bits, row) in square.iter_mut().zip(group * 64..num_rows) {
                *bits = word(row, first_column + start);
            }
            // Most of a map is far from the unknown: what is empty need not be turned.
            if square.iter().fold(0, |all, bits| all | bits) == 0 {
                continue;
            }
            turn(&mut square);
            for (arc, &bits) in into[start..].iter_mut().zip(&square) {
                arc[group] = bits;
            }
        }
    }
}

/// Transposes 64 × 64 bits in place, by swapping ever smaller blocks (Hacker's Delight, section 7-3).
#[inline(always)]
fn turn(square: &mut [u64; 64]) {
    swap_blocks::<32>(square, 0x0000_0000_ffff_ffff);
    swap_blocks::<16>(square, 0x0000_ffff_0000_ffff);
    swap_blocks::<8>(square, 0x00ff_00ff_00ff_00ff);
    swap_blocks::<4>(square, 0x0f0f_0f0f_0f0f_0f0f);
    swap_blocks::<2>(square, 0x3333_3333_3333_3333);
    swap_blocks::<1>(square, 0x5555_5555_5555_5555);
}

/// Swaps the off-diagonal blocks of `SIDE` × `SIDE` bits; the sides are known to the compiler, so that it can take
/// several rows at once.
#[inline(always)]
fn swap_blocks<const SIDE: usize>(square: &mut [u64; 64], mask: u64) {
    for pair in square.chunks_exact_mut(2 * SIDE) {
        let (low, high) = pair.split_at_mut(SIDE);
        for (low, high) in low.iter_mut().zip(high) {
            let swapped = (*low >> SIDE ^ *high) & mask;
            *high ^= swapped;
            *low ^= swapped << SIDE;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn turning_swaps_rows_and_columns(words in prop::collection::vec(any::<u64>(), 64)) {
            let mut square: [u64; 64] = std::array::from_fn(|row| words[row]);
            turn(&mut square);
            for (row, word) in words.iter().enumerate() {
                for (column, turned) in square.iter().enumerate() {
                    prop_assert_eq!(word >> column & 1, turned >> row & 1);
                }
            }
        }
    }
}
