//! Free-space density of every cell of a map: the free cells inside a disc that hang together with its centre.
//!
//! Algorithm 3.1 floods a disc per cell. Neighbouring discs share nearly everything, so here the centres are taken in
//! square blocks, and the flood of a block starts from what all its discs have in common:
//!
//! ```text
//!   root of 16 × 16 centres: flood the intersection of their discs
//!     └─ 16 nodes of 4 × 4: that fill is connected in the larger intersection too, flood on from it
//!          └─ 16 centres each: the whole disc, flood on from there
//! ```
//!
//! What was reached in an intersection of discs is reached in each of them, so a leaf only adds the thin lune that its
//! own disc has more. Centres that do not hang together in the intersection form groups of their own. Rows are bits
//! ([`super::bit_window`]), so a step of the flood handles 64 cells.

use super::bit_window::{
    BitPlanes, Row, and, has, is_empty, or, shifted_by, shifted_left, shifted_right, span, spread,
};
use super::kernel_rows::KernelRows;

/// Sides of the blocks of centres, from the root to the single centre.
const SIDES: [usize; 3] = [BLOCK_SIDE, 4, 1];

/// Centres per side of a root block.
pub(super) const BLOCK_SIDE: usize = 16;

/// Cells by which the planes of bits must reach beyond the map, on top of the disc's radius.
pub(super) const MARGIN: usize = BLOCK_SIDE + 2;

/// What a flood found at a centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fill {
    /// Kernel mass of the connected free cells, in [0, 1].
    pub density: f32,
    /// Unknown cells next to them, inside the disc.
    pub num_unknown: u32,
}

/// What the floods found at the centres of a block, row by row.
pub(super) type Block = [[Option<Fill>; BLOCK_SIDE]; BLOCK_SIDE];

/// A flooder with rows as wide as its kernel needs.
pub(super) enum AnyFlooder<'a> {
    /// One word per row.
    Narrow(BlockFlooder<'a, 1>),
    /// Two words: up to 5.6 m at 0.1 m per cell.
    Middle(BlockFlooder<'a, 2>),
    /// Four words.
    Wide(BlockFlooder<'a, 4>),
    /// Eight words.
    Widest(BlockFlooder<'a, 8>),
}

impl<'a> AnyFlooder<'a> {
    /// The narrowest flooder whose window holds a block and the kernel around it.
    pub fn new(planes: &'a BitPlanes, kernel: &'a KernelRows) -> Self {
        match 2 * kernel.radius() + BLOCK_SIDE {
            0..=64 => Self::Narrow(BlockFlooder::new(planes, kernel)),
            65..=128 => Self::Middle(BlockFlooder::new(planes, kernel)),
            129..=256 => Self::Wide(BlockFlooder::new(planes, kernel)),
            _ => Self::Widest(BlockFlooder::new(planes, kernel)),
        }
    }

    /// Fills of the `side × side` centres from (column, row) on, row by row; None where the centre is not free.
    pub fn flood_block(&mut self, column: i64, row: i64, side: usize) -> Block {
        match self {
            Self::Narrow(flooder) => flooder.flood_block(column, row, side),
            Self::Middle(flooder) => flooder.flood_block(column, row, side),
            Self::Wide(flooder) => flooder.flood_block(column, row, side),
            Self::Widest(flooder) => flooder.flood_block(column, row, side),
        }
    }
}

/// Floods blocks of centres; owns the scratch rows of one thread.
pub(super) struct BlockFlooder<'a, const W: usize> {
    planes: &'a BitPlanes,
    kernel: &'a KernelRows,
    /// Per level: the intersection of the discs of a block whose lower left centre has column 0, from its first row.
    intersections: [Vec<Row<W>>; SIDES.len()],
    free: Vec<Row<W>>,
    unknown: Vec<Row<W>>,
    /// Free cells inside the intersection of each level.
    masks: [Vec<Row<W>>; SIDES.len()],
    reaches: [Vec<Row<W>>; SIDES.len()],
}

impl<'a, const W: usize> BlockFlooder<'a, W> {
    /// A flooder for discs of a kernel; the window of a block must fit: `2 radius + 16 ≤ 64 W`.
    fn new(planes: &'a BitPlanes, kernel: &'a KernelRows) -> Self {
        let num_rows = 2 * kernel.radius() + BLOCK_SIDE;
        let empty = || vec![[0; W]; num_rows];
        Self {
            planes,
            kernel,
            intersections: SIDES.map(|side| intersection_of_discs(kernel, side)),
            free: empty(),
            unknown: empty(),
            masks: SIDES.map(|_| empty()),
            reaches: SIDES.map(|_| empty()),
        }
    }

    /// Fills of the `side × side` centres from (column, row) on, row by row; None where the centre is not free.
    fn flood_block(&mut self, column: i64, row: i64, side: usize) -> Block {
        let mut fills = [[None; BLOCK_SIDE]; BLOCK_SIDE];
        let radius = self.kernel.radius();
        let (left, bottom) = (column - radius as i64, row - radius as i64);
        for window_row in 0..self.free.len() {
            self.free[window_row] = self.planes.free_row(left, bottom + window_row as i64);
            self.unknown[window_row] = self.planes.unknown_row(left, bottom + window_row as i64);
        }
        let mut centres = [0u16; BLOCK_SIDE];
        for (y, bits) in centres.iter_mut().enumerate().take(side) {
            for x in 0..side {
                *bits |= u16::from(has(&self.free[y + radius], x + radius)) << x;
            }
        }
        self.flood_node(0, (0, 0), &centres, false, &mut fills);
        fills
    }

    /// Floods the wanted `centres` of a node; `from_parent` says that they all hang together with the parent's reach.
    fn flood_node(
        &mut self,
        level: usize,
        corner: (usize, usize),
        centres: &[u16; BLOCK_SIDE],
        from_parent: bool,
        fills: &mut Block,
    ) {
        let mut remaining = wanted_within(centres, corner, SIDES[level]);
        if remaining.iter().all(|&bits| bits == 0) {
            return;
        }
        let rows = self.mask_node(level, corner);
        if from_parent {
            let group = std::mem::replace(&mut remaining, [0; BLOCK_SIDE]);
            let parent_side = SIDES[level - 1];
            let parent_rows = self.rows_of(parent_side, corner.1 / parent_side * parent_side);
            let (before, after) = self.reaches.split_at_mut(level);
            for row in rows.clone() {
                let is_shared = parent_rows.contains(&row);
                after[0][row] =
                    if is_shared { and(&before[level - 1][row], &self.masks[level][row]) } else { [0; W] };
            }
            self.settle(level, rows.clone());
            self.descend(level, corner, &group, fills);
        }
        let radius = self.kernel.radius();
        while let Some((x, y)) = first_set(&remaining) {
            self.reaches[level][rows.clone()].fill([0; W]);
            let mut group = [0; BLOCK_SIDE];
            let is_inside = rows.contains(&(y + radius)) && has(&self.masks[level][y + radius], x + radius);
            if is_inside {
                self.reaches[level][y + radius] = span((x + radius) as i64, (x + radius) as i64);
                self.settle(level, rows.clone());
                group = self.reached_of(level, &remaining);
                for (left, taken) in remaining.iter_mut().zip(&group) {
                    *left &= !taken;
                }
                self.descend(level, corner, &group, fills);
            } else {
                // The intersection of a small kernel's discs may not even hold its own centres.
                group[y] = 1 << x;
                remaining[y] &= !(1 << x);
                self.descend_alone(level, corner, &group, fills);
            }
        }
    }

    /// Hands a settled group to the children, or reads the result at a leaf.
    fn descend(
        &mut self,
        level: usize,
        corner: (usize, usize),
        group: &[u16; BLOCK_SIDE],
        fills: &mut Block,
    ) {
        if level + 1 == SIDES.len() {
            fills[corner.1][corner.0] = Some(self.read(level, corner));
            return;
        }
        for child in children(level, corner) {
            self.flood_node(level + 1, child, group, true, fills);
        }
    }

    /// Hands a centre outside the intersection to its child, which starts afresh.
    fn descend_alone(
        &mut self,
        level: usize,
        corner: (usize, usize),
        group: &[u16; BLOCK_SIDE],
        fills: &mut Block,
    ) {
        for child in children(level, corner) {
            self.flood_node(level + 1, child, group, false, fills);
        }
    }

    /// Rows of the window that the intersection of a node's discs may cover; `y` is its first row of centres.
    fn rows_of(&self, side: usize, y: usize) -> std::ops::Range<usize> {
        let first = y + side - 1;
        first..(y + 2 * self.kernel.radius() + 1).max(first)
    }

    /// Writes the free cells of a node's intersection into its mask; returns the rows it covers.
    fn mask_node(&mut self, level: usize, (x, y): (usize, usize)) -> std::ops::Range<usize> {
        let rows = self.rows_of(SIDES[level], y);
        for row in rows.clone() {
            let disc = shifted_by(&self.intersections[level][row - y], x);
            self.masks[level][row] = and(&self.free[row], &disc);
        }
        rows
    }

    /// Floods the reach of a level within its mask, by alternating passes until one changes nothing.
    fn settle(&mut self, level: usize, rows: std::ops::Range<usize>) {
        let (reach, mask) = (&mut self.reaches[level][rows.clone()], &self.masks[level][rows]);
        let num_rows = reach.len();
        let mut passes = 0;
        loop {
            let mut has_changed = false;
            let mut before = [0; W];
            for step in 0..num_rows {
                let row = if passes % 2 == 0 { step } else { num_rows - 1 - step };
                before = grow(&before, &mut reach[row], &mask[row], &mut has_changed);
            }
            passes += 1;
            if !has_changed && passes > 1 {
                return;
            }
        }
    }

    fn reached_of(&self, level: usize, centres: &[u16; BLOCK_SIDE]) -> [u16; BLOCK_SIDE] {
        let radius = self.kernel.radius();
        std::array::from_fn(|y| {
            let row = &self.reaches[level][y + radius];
            (0..BLOCK_SIDE).fold(0, |bits, x| {
                let is_reached = centres[y] >> x & 1 == 1 && has(row, x + radius);
                bits | u16::from(is_reached) << x
            })
        })
    }

    /// Kernel mass and unknown neighbours of a settled leaf.
    fn read(&self, level: usize, (x, y): (usize, usize)) -> Fill {
        let num_rows = 2 * self.kernel.radius() + 1;
        let reach = &self.reaches[level][y..y + num_rows];
        let mut num_unknown = 0;
        let mut before = [0; W];
        for row in 0..num_rows {
            let after = if row + 1 < num_rows { reach[row + 1] } else { [0; W] };
            let beside = or(&shifted_left(&reach[row]), &shifted_right(&reach[row]));
            let touched = and(&or(&or(&before, &after), &beside), &self.unknown[y + row]);
            if !is_empty(&touched) {
                let disc = shifted_by(&self.intersections[level][row], x);
                num_unknown += and(&touched, &disc).iter().map(|word| word.count_ones()).sum::<u32>();
            }
            before = reach[row];
        }
        Fill { density: self.kernel.mass(reach, x), num_unknown }
    }
}

/// Adds to a row what the row `before` and its own cells lead to; returns the row.
fn grow<const W: usize>(
    before: &Row<W>,
    reach: &mut Row<W>,
    mask: &Row<W>,
    has_changed: &mut bool,
) -> Row<W> {
    let seed = or(reach, &and(before, mask));
    let beside = or(&shifted_left(&seed), &shifted_right(&seed));
    let has_more = (0..W).fold(0, |more, word| more | (beside[word] & mask[word] & !seed[word])) != 0;
    let grown = if has_more { spread(&seed, mask) } else { seed };
    *has_changed |= grown != *reach;
    *reach = grown;
    grown
}

fn wanted_within(centres: &[u16; BLOCK_SIDE], (x, y): (usize, usize), side: usize) -> [u16; BLOCK_SIDE] {
    let columns = ((1u32 << side) - 1) << x;
    std::array::from_fn(|row| if (y..y + side).contains(&row) { centres[row] & columns as u16 } else { 0 })
}

fn first_set(centres: &[u16; BLOCK_SIDE]) -> Option<(usize, usize)> {
    let y = centres.iter().position(|&bits| bits != 0)?;
    Some((centres[y].trailing_zeros() as usize, y))
}

fn children(level: usize, (x, y): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    let (side, child) = (SIDES[level], SIDES[level + 1]);
    (0..side / child)
        .flat_map(move |row| (0..side / child).map(move |column| (x + column * child, y + row * child)))
}

/// Rows of the intersection of the discs of `side × side` centres, the lower left of which has column `radius`.
fn intersection_of_discs<const W: usize>(kernel: &KernelRows, side: usize) -> Vec<Row<W>> {
    let radius = kernel.radius() as i64;
    (0..2 * radius + side as i64)
        .map(|row| {
            let y = row - radius;
            let farthest = y.abs().max((y - (side as i64 - 1)).abs());
            match kernel.half_chord(farthest as usize) {
                Some(half) => span(side as i64 - 1 - half as i64 + radius, half as i64 + radius),
                None => [0; W],
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::collections::{HashSet, VecDeque};

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::geometry::Point2;
    use crate::localization::grid_map::{CellState, GridMap};
    use crate::localization::kernel_rows::KernelProfile;

    /// Algorithm 3.1, cell by cell.
    fn literal_fill(map: &GridMap, centre: (i64, i64), profile: KernelProfile, h: f64) -> Option<Fill> {
        if map.state(centre.0, centre.1) != CellState::Free {
            return None;
        }
        let (mut mass, mut whole) = (0.0, 0.0);
        let reach = h.ceil() as i64;
        for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
            let d = (dx as f64).hypot(dy as f64);
            whole += if d < h { profile.height(d, h) } else { 0.0 };
        }
        let mut num_unknown = 0;
        let mut seen = HashSet::from([centre]);
        let mut queue = VecDeque::from([centre]);
        while let Some((x, y)) = queue.pop_front() {
            let d = ((x - centre.0) as f64).hypot((y - centre.1) as f64);
            if d >= h {
                continue;
            }
            match map.state(x, y) {
                CellState::Free => mass += profile.height(d, h),
                CellState::Unknown => num_unknown += 1,
                CellState::Occupied => {}
            }
            if map.state(x, y) == CellState::Free {
                queue.extend(
                    [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
                        .iter()
                        .filter(|&&cell| seen.insert(cell)),
                );
            }
        }
        Some(Fill { density: (mass / whole) as f32, num_unknown })
    }

    /// Rooms with doors and clutter, and a part nobody has seen.
    fn random_building(rng: &mut ChaCha8Rng, width: usize, height: usize) -> GridMap {
        let mut map = GridMap::unknown(width, height, 0.1, Point2::default());
        for (column, row) in (0..width as i64).flat_map(|x| (0..height as i64).map(move |y| (x, y))) {
            map.set(column, row, CellState::Free);
        }
        for _ in 0..8 {
            let (at, is_row) = (rng.random_range(0..width.min(height) as i64), rng.random::<bool>());
            for along in 0..width.max(height) as i64 {
                if rng.random_range(0..12) > 0 {
                    let (column, row) = if is_row { (along, at) } else { (at, along) };
                    map.set(column, row, CellState::Occupied);
                }
            }
        }
        for _ in 0..width * height / 12 {
            let state = if rng.random::<bool>() { CellState::Occupied } else { CellState::Unknown };
            map.set(rng.random_range(0..width as i64), rng.random_range(0..height as i64), state);
        }
        map
    }

    #[test]
    fn blocks_agree_with_the_literal_flood() {
        let mut rng = ChaCha8Rng::seed_from_u64(31);
        let cases =
            [(1.0, 20, 9), (3.0, 40, 33), (6.5, 37, 50), (15.0, 40, 33), (30.0, 50, 34), (57.0, 40, 30)];
        for (h, width, height) in cases {
            for profile in [KernelProfile::Uniform, KernelProfile::Gaussian, KernelProfile::Inverted] {
                let map = random_building(&mut rng, width, height);
                let kernel = KernelRows::new(profile, h);
                let planes = BitPlanes::new(&map, kernel.radius() + MARGIN);
                let mut flooder = AnyFlooder::new(&planes, &kernel);
                for (left, bottom) in
                    (0..width).step_by(16).flat_map(|x| (0..height).step_by(16).map(move |y| (x, y)))
                {
                    let block = flooder.flood_block(left as i64, bottom as i64, 16);
                    for (x, y) in (0..16).flat_map(|x| (0..16).map(move |y| (x, y))) {
                        let cell = ((left + x) as i64, (bottom + y) as i64);
                        if h > 10.0 && rng.random_range(0..8) > 0 {
                            continue;
                        }
                        match (block[y][x], literal_fill(&map, cell, profile, h)) {
                            (Some(fast), Some(slow)) => {
                                assert_eq!(fast.num_unknown, slow.num_unknown, "h {h} at {cell:?}");
                                assert!(
                                    (fast.density - slow.density).abs() < 1e-5,
                                    "{fast:?} {slow:?} h {h} at {cell:?}"
                                );
                            }
                            (fast, slow) => assert_eq!(fast, slow, "h {h} at {cell:?}"),
                        }
                    }
                }
            }
        }
    }
}
