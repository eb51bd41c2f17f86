//! Rows of cells as bits: the arithmetic that makes flood fills fast.
//!
//! A row of a window is `W` words; bit 0 of word 0 is the leftmost cell. Spreading a seed to the right along a run of
//! set bits is one addition: in `mask + seed` the carry starts at the seed, clears the run up to its end and falls
//! into the gap behind it. To the left no carry runs, so six doublings per word do it.

use locution_engine::occupancy::{CellState, GridMap};

/// A row of a window.
pub(super) type Row<const W: usize> = [u64; W];

/// `a & b`.
#[inline(always)]
pub(super) fn and<const W: usize>(a: &Row<W>, b: &Row<W>) -> Row<W> {
    std::array::from_fn(|word| a[word] & b[word])
}

/// `a | b`.
#[inline(always)]
pub(super) fn or<const W: usize>(a: &Row<W>, b: &Row<W>) -> Row<W> {
    std::array::from_fn(|word| a[word] | b[word])
}

/// `a & !b`.
#[inline(always)]
pub(super) fn and_not<const W: usize>(a: &Row<W>, b: &Row<W>) -> Row<W> {
    std::array::from_fn(|word| a[word] & !b[word])
}

/// True when no bit is set.
#[inline(always)]
pub(super) fn is_empty<const W: usize>(a: &Row<W>) -> bool {
    a.iter().fold(0, |all, word| all | word) == 0
}

/// Number of set bits.
#[inline(always)]
pub(super) fn count<const W: usize>(a: &Row<W>) -> u32 {
    a.iter().map(|word| word.count_ones()).sum()
}

/// The same, quicker where there are rarely any.
#[inline(always)]
pub(super) fn count_few<const W: usize>(a: &Row<W>) -> u32 {
    if is_empty(a) { 0 } else { count(a) }
}

/// True when a bit is set.
#[inline(always)]
pub(super) fn has<const W: usize>(a: &Row<W>, bit: usize) -> bool {
    a[bit / 64] >> (bit % 64) & 1 == 1
}

/// Positions of the set bits, ascending.
#[inline(always)]
pub(super) fn set_bits<const W: usize>(a: &Row<W>) -> impl Iterator<Item = usize> + use<W> {
    (*a).into_iter().enumerate().flat_map(|(word, mut bits)| {
        std::iter::from_fn(move || {
            let bit = (bits != 0).then(|| word * 64 + bits.trailing_zeros() as usize)?;
            bits &= bits - 1;
            Some(bit)
        })
    })
}

/// Every cell moved one to the right (towards higher bits).
#[inline(always)]
pub(super) fn shifted_right<const W: usize>(a: &Row<W>) -> Row<W> {
    std::array::from_fn(|word| (a[word] << 1) | if word > 0 { a[word - 1] >> 63 } else { 0 })
}

/// Every cell moved one to the left.
#[inline(always)]
pub(super) fn shifted_left<const W: usize>(a: &Row<W>) -> Row<W> {
    std::array::from_fn(|word| (a[word] >> 1) | if word + 1 < W { a[word + 1] << 63 } else { 0 })
}

/// The row whose bits `first..=last` are set; none when `last < first`.
#[inline(always)]
pub(super) fn span<const W: usize>(first: i64, last: i64) -> Row<W> {
    std::array::from_fn(|word| {
        let base = word as i64 * 64;
        let (low, high) = ((first - base).max(0), (last - base).min(63));
        if low > high { 0 } else { (u64::MAX >> (63 - high + low)) << low }
    })
}

/// All cells of `mask` that hang together with a cell of `seed` along the row; `seed` must lie within `mask`.
#[inline(always)]
pub(super) fn spread<const W: usize>(seed: &Row<W>, mask: &Row<W>) -> Row<W> {
    let mut reach = [0; W];
    let mut carry = false;
    for ((reach, &seed), &mask) in reach.iter_mut().zip(seed).zip(mask) {
        let (sum, first_carry) = mask.overflowing_add(seed);
        let (sum, second_carry) = sum.overflowing_add(u64::from(carry));
        carry = first_carry | second_carry;
        *reach = (mask & !sum) | seed;
    }
    let mut from_right = 0;
    for word in (0..W).rev() {
        reach[word] = spread_left(reach[word] | (from_right & mask[word]), mask[word]);
        from_right = reach[word] << 63;
    }
    reach
}

/// Spreads the bits of `seed` to lower bits along the runs of `mask`, by doubling (Kogge and Stone's prefix scheme).
#[inline(always)]
fn spread_left(seed: u64, mask: u64) -> u64 {
    let mut reach = seed;
    let mut passable = mask;
    let mut step = 1;
    while step < 64 && (reach >> 1) & mask & !reach != 0 {
        reach |= passable & (reach >> step);
        passable &= passable >> step;
        step *= 2;
    }
    reach
}

/// A map as two planes of bits with a margin all round, so that windows may hang over its edge.
#[derive(Clone, Debug)]
pub(super) struct BitPlanes {
    words_per_row: usize,
    margin: usize,
    free: Vec<u64>,
    /// Free cells with an unknown neighbour.
    open: Vec<u64>,
}

impl BitPlanes {
    /// The planes of a map with `margin` unknown cells on every side.
    pub fn new(map: &GridMap, margin: usize) -> Self {
        let words_per_row = (map.width() + 2 * margin).div_ceil(64) + 5;
        let num_rows = map.height() + 2 * margin;
        let mut free = vec![0; words_per_row * num_rows];
        let mut unknown = vec![u64::MAX; words_per_row * num_rows];
        for (row, states) in map.cells().chunks_exact(map.width()).enumerate() {
            let start = (row + margin) * words_per_row;
            for (column, state) in states.iter().enumerate() {
                let (word, bit) = (start + (column + margin) / 64, 1u64 << ((column + margin) % 64));
                if *state != CellState::Unknown {
                    unknown[word] &= !bit;
                }
                if *state == CellState::Free {
                    free[word] |= bit;
                }
            }
        }
        let open =
            beside(&unknown, words_per_row).iter().zip(&free).map(|(beside, free)| beside & free).collect();
        Self { words_per_row, margin, free, open }
    }

    /// A column or row of the map, counted from the margin's edge.
    pub const fn padded(&self, cell: i64) -> usize {
        (cell + self.margin as i64) as usize
    }

    /// `64 W` free bits from a padded cell on to the right.
    #[inline(always)]
    pub fn free_row<const W: usize>(&self, row: usize, column: usize) -> Row<W> {
        self.row(&self.free, row, column)
    }

    /// The same for free cells with an unknown neighbour.
    #[inline(always)]
    pub fn open_row<const W: usize>(&self, row: usize, column: usize) -> Row<W> {
        self.row(&self.open, row, column)
    }

    /// True when a padded cell is free.
    #[inline(always)]
    pub fn is_free(&self, row: usize, column: usize) -> bool {
        self.free[row * self.words_per_row + column / 64] >> (column % 64) & 1 == 1
    }

    /// Eight free bits from a padded cell on to the right.
    #[inline(always)]
    pub fn free_byte(&self, row: usize, column: usize) -> u64 {
        self.row::<1>(&self.free, row, column)[0] & 0xff
    }

    #[inline(always)]
    fn row<const W: usize>(&self, plane: &[u64], row: usize, column: usize) -> Row<W> {
        let start = row * self.words_per_row + column / 64;
        let (words, shift) = (&plane[start..=start + W], column % 64);
        std::array::from_fn(|word| match shift {
            0 => words[word],
            _ => (words[word] >> shift) | (words[word + 1] << (64 - shift)),
        })
    }
}

/// Cells with a set neighbour above, below, left or right.
fn beside(plane: &[u64], words_per_row: usize) -> Vec<u64> {
    let word_at = |word: Option<usize>| word.and_then(|word| plane.get(word)).copied().unwrap_or(0);
    (0..plane.len())
        .map(|word| {
            let sideways = plane[word] << 1
                | plane[word] >> 1
                | word_at(word.checked_sub(1)) >> 63
                | word_at(word.checked_add(1)) << 63;
            sideways | word_at(word.checked_sub(words_per_row)) | word_at(word.checked_add(words_per_row))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn spread_by_steps(seed: &Row<3>, mask: &Row<3>) -> Row<3> {
        let mut reach = *seed;
        loop {
            let next = or(&reach, &and(&or(&shifted_left(&reach), &shifted_right(&reach)), mask));
            if next == reach {
                return reach;
            }
            reach = next;
        }
    }

    proptest! {
        #[test]
        fn spreading_equals_stepping(seed: [u64; 3], holes: [u64; 3], more_holes: [u64; 3]) {
            let mask: Row<3> = std::array::from_fn(|word| !(holes[word] & more_holes[word]));
            let seed = and(&std::array::from_fn(|word| seed[word] & holes[word]), &mask);
            prop_assert_eq!(spread(&seed, &mask), spread_by_steps(&seed, &mask));
            let sparse = [mask[0], u64::MAX, mask[2]];
            let seed = and(&seed, &sparse);
            prop_assert_eq!(spread(&seed, &sparse), spread_by_steps(&seed, &sparse));
        }

        #[test]
        fn spans_hold_their_columns(first in -5i64..140, last in -5i64..140) {
            let row: Row<2> = span(first, last);
            for column in 0..128 {
                prop_assert_eq!(has(&row, column as usize), column >= first && column <= last);
            }
        }
    }
}
