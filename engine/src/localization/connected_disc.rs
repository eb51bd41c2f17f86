//! Free-space density of every cell of a map: the free cells inside a disc that hang together with its centre.
//!
//! Algorithm 3.1 floods a disc per cell. Here a disc slides along a row of centres and its fill is kept up to date:
//! one arc of cells leaves on the left, one enters on the right.
//!
//! ```text
//!        leaving   ┌──────────┐   entering        A leaving run is harmless when what it touches inside the disc
//!            ░▒░   │          │  ▒                hangs together without it: the column to its right has no gap, or
//!            ▒     │    c c'  │   ▒               a gap that eight columns more can bridge. Otherwise the fill might
//!            ░▒░   │          │  ▒                fall apart, and the disc is flooded afresh.
//!                  └──────────┘
//! ```
//!
//! Entering cells join when they touch the fill, and may open the way to more. Rows are bits ([`super::bit_window`]),
//! so a flood afresh handles 64 cells a step.

use super::bit_window::{BitPlanes, Row, and, or, shifted_left, shifted_right, span, spread};
use super::kernel_rows::KernelRows;

/// Cells by which the planes of bits must reach beyond the map, on top of the disc's radius.
pub(super) const MARGIN: usize = 12;

/// Cells per side of the square in which a gap may be bridged.
const BRIDGE: usize = 8;

/// What a flood found at a centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fill {
    /// Kernel mass of the connected free cells, in [0, 1].
    pub density: f32,
    /// Unknown cells next to them, inside the disc.
    pub num_unknown: u32,
}

/// Leaving cells that lie one above the other, listed from the outside towards the disc's middle row.
#[derive(Clone, Debug)]
struct LeavingRun {
    half_chord: usize,
    rows: Vec<usize>,
    /// The row after the last, where the disc is wider; none for the run on the middle row.
    inner_row: Option<usize>,
}

/// A disc that slides along rows of centres; owns the scratch planes of one thread.
pub(super) struct DiscSweep<'a, const W: usize> {
    planes: &'a BitPlanes,
    kernel: &'a KernelRows,
    runs: Vec<LeavingRun>,
    /// Half chord of each row of the disc.
    half_chords: Vec<usize>,
    /// Free cells of the fill and unknown cells beside it, as bits of the rows that the disc covers.
    reach: Vec<u64>,
    touched: Vec<u64>,
    /// First row of the disc, counted in rows of the planes.
    bottom: usize,
    num_reached: u32,
    num_touched: u32,
    stack: Vec<(usize, usize)>,
}

impl<'a, const W: usize> DiscSweep<'a, W> {
    /// A sweep of a kernel whose disc must fit into `64 W` columns.
    pub fn new(planes: &'a BitPlanes, kernel: &'a KernelRows) -> Self {
        let radius = kernel.radius();
        let half_chord = |row: usize| kernel.half_chord(row.abs_diff(radius)).unwrap_or(0);
        let half_chords: Vec<usize> = (0..2 * radius + 1).map(half_chord).collect();
        let num_words = half_chords.len() * planes.words_per_row();
        Self {
            planes,
            kernel,
            runs: leaving_runs(&half_chords),
            half_chords,
            reach: vec![0; num_words],
            touched: vec![0; num_words],
            bottom: 0,
            num_reached: 0,
            num_touched: 0,
            stack: Vec::new(),
        }
    }

    /// Fills of the centres of a row from `column` on; None where the centre is not free.
    pub fn sweep(&mut self, column: i64, row: i64, fills: &mut [Option<Fill>]) {
        let radius = self.kernel.radius();
        self.bottom = self.planes.padded(row) - radius;
        self.clear();
        let mut was_free = false;
        for (centre, fill) in (self.planes.padded(column)..).zip(fills) {
            let is_free = self.is_free(radius, centre);
            if is_free && !(was_free && radius > 2 && self.slide_to(centre)) {
                self.flood(centre);
            }
            *fill = is_free.then(|| self.read(centre));
            was_free = is_free;
        }
    }

    fn clear(&mut self) {
        self.reach.fill(0);
        self.touched.fill(0);
        (self.num_reached, self.num_touched) = (0, 0);
    }

    /// Moves the disc from the centre on the left to `centre`; false when the fill might fall apart.
    fn slide_to(&mut self, centre: usize) -> bool {
        if !self.is_safe_to_leave(centre - 1) {
            return false;
        }
        self.leave(centre - 1);
        self.enter(centre);
        true
    }

    /// True when the fill stays in one piece without the cells that leave as the disc moves right from `centre`.
    fn is_safe_to_leave(&self, centre: usize) -> bool {
        for run in &self.runs {
            let column = centre - run.half_chord;
            // The last free cell to the right of the current stretch of leaving cells.
            let mut last_free: Option<usize> = None;
            let mut is_leaving = false;
            for &row in &run.rows {
                if !self.is_reached(row, column) {
                    (last_free, is_leaving) = (None, false);
                    continue;
                }
                is_leaving = true;
                if self.is_free(row, column + 1) {
                    if last_free
                        .is_some_and(|last| last.abs_diff(row) > 1 && !self.is_bridged(last, row, column + 1))
                    {
                        return false;
                    }
                    last_free = Some(row);
                }
            }
            if let (true, Some(inner), Some(last)) = (is_leaving, run.inner_row, last_free) {
                // The cell below (or above) the run stays; it must hang together with the cells to the right.
                let needs_bridge = self.is_reached(inner, column)
                    && !(self.is_free(inner, column + 1)
                        && (last.abs_diff(inner) == 1 || self.is_bridged(last, inner, column + 1)));
                if needs_bridge {
                    return false;
                }
            }
        }
        true
    }

    /// True when two free cells of a column hang together within the eight columns from it on and the rows between.
    fn is_bridged(&self, first: usize, second: usize, column: usize) -> bool {
        let (low, high) = (first.min(second).saturating_sub(1), first.max(second) + 1);
        let is_inside = high < self.half_chords.len()
            && high - low < BRIDGE
            && self.half_chords[low].min(self.half_chords[high]) >= BRIDGE
            && self.half_chords[low].abs_diff(self.half_chords[high]) == 0;
        if !is_inside {
            return false;
        }
        let mut board = 0u64;
        for row in low..=high {
            board |= self.planes.free_byte(self.bottom + row, column) << (BRIDGE * (row - low));
        }
        let goal = 1u64 << (BRIDGE * (second - low));
        let mut reached = 1u64 << (BRIDGE * (first - low));
        loop {
            let sideways = (reached << 1 & !FIRST_COLUMN) | (reached >> 1 & !(FIRST_COLUMN << (BRIDGE - 1)));
            let next = (reached | sideways | reached << BRIDGE | reached >> BRIDGE) & board;
            if next & goal != 0 || next == reached {
                return next & goal != 0;
            }
            reached = next;
        }
    }

    /// Takes the left arc of the disc around `centre` out of the fill.
    fn leave(&mut self, centre: usize) {
        for row in 0..self.half_chords.len() {
            let column = centre - self.half_chords[row];
            let (word, bit) = self.place(row, column);
            self.num_reached -= u32::from(self.reach[word] & bit != 0);
            self.num_touched -= u32::from(self.touched[word] & bit != 0);
            self.reach[word] &= !bit;
            self.touched[word] &= !bit;
        }
        if self.num_touched > 0 {
            self.untouch(centre);
        }
    }

    /// Unknown cells beside the left arc may have lost their last neighbour in the fill.
    fn untouch(&mut self, centre: usize) {
        for row in 0..self.half_chords.len() {
            let column = centre - self.half_chords[row];
            let beside = [(row, column + 1), (row.wrapping_sub(1), column), (row + 1, column)];
            for (row, column) in beside {
                if row < self.half_chords.len()
                    && self.is_touched(row, column)
                    && !self.touches_reach(row, column)
                {
                    let (word, bit) = self.place(row, column);
                    self.touched[word] &= !bit;
                    self.num_touched -= 1;
                }
            }
        }
    }

    /// Takes the right arc of the disc around `centre` into the fill.
    fn enter(&mut self, centre: usize) {
        let last_row = self.half_chords.len() - 1;
        for row in 0..=last_row {
            let column = centre + self.half_chords[row];
            let (word, bit) = self.place(row, column);
            if self.planes.free_word(self.bottom + row, column) & bit != 0 && self.is_reached(row, column - 1)
            {
                self.reach[word] |= bit;
                self.num_reached += 1;
            }
        }
        for row in 0..=last_row {
            let column = centre + self.half_chords[row];
            if self.is_free(row, column) {
                self.enter_free(row, column, centre);
            } else if self.planes.is_unknown(self.bottom + row, column) {
                self.touch_if_beside_reach(row, column);
            }
        }
    }

    /// Follows an entering free cell to whatever hangs on it.
    fn enter_free(&mut self, row: usize, column: usize, centre: usize) {
        let above_and_below = [row.wrapping_sub(1), row + 1];
        if !self.is_reached(row, column) {
            let hangs_on = above_and_below
                .iter()
                .any(|&other| other < self.half_chords.len() && self.is_reached(other, column));
            if !hangs_on {
                return;
            }
            self.reach_cell(row, column);
        }
        let leads_on = |sweep: &Self, row: usize, column: usize| {
            row < sweep.half_chords.len()
                && sweep.is_inside(row, column, centre)
                && !sweep.is_reached(row, column)
                && !sweep.is_touched(row, column)
                && !sweep.planes.is_occupied(sweep.bottom + row, column)
        };
        let is_open = leads_on(self, row, column - 1)
            || above_and_below.iter().any(|&other| leads_on(self, other, column));
        if is_open {
            self.stack.push((row, column));
            self.flood_on(centre);
        }
    }

    /// Spreads from the cells on the stack, cell by cell.
    fn flood_on(&mut self, centre: usize) {
        while let Some((row, column)) = self.stack.pop() {
            let around =
                [(row, column - 1), (row, column + 1), (row.wrapping_sub(1), column), (row + 1, column)];
            for (row, column) in around {
                if row >= self.half_chords.len()
                    || !self.is_inside(row, column, centre)
                    || self.is_reached(row, column)
                {
                    continue;
                }
                if self.is_free(row, column) {
                    self.reach_cell(row, column);
                    self.stack.push((row, column));
                } else if self.planes.is_unknown(self.bottom + row, column) {
                    self.touch_if_beside_reach(row, column);
                }
            }
        }
    }

    /// Floods the disc around `centre` from nothing.
    fn flood(&mut self, centre: usize) {
        let radius = self.kernel.radius();
        let left = centre - radius;
        let num_rows = self.half_chords.len();
        let mut masks = vec![[0; W]; num_rows];
        let mut reach = vec![[0; W]; num_rows];
        for (row, mask) in masks.iter_mut().enumerate() {
            *mask = and(&self.planes.free_row(self.bottom + row, left), &self.disc_row(row));
        }
        reach[radius] = span(radius as i64, radius as i64);
        settle(&mut reach, &masks, radius);
        self.clear();
        let mut before = [0; W];
        for row in 0..num_rows {
            let after = reach.get(row + 1).copied().unwrap_or([0; W]);
            let beside =
                or(&or(&before, &after), &or(&shifted_left(&reach[row]), &shifted_right(&reach[row])));
            let unknown = and(&self.planes.unknown_row(self.bottom + row, left), &self.disc_row(row));
            let touched = and(&beside, &unknown);
            let start = row * self.planes.words_per_row();
            self.num_reached += write_row(&mut self.reach[start..], left, &reach[row]);
            self.num_touched += write_row(&mut self.touched[start..], left, &touched);
            before = reach[row];
        }
    }

    fn disc_row(&self, row: usize) -> Row<W> {
        let (radius, half) = (self.kernel.radius() as i64, self.half_chords[row] as i64);
        span(radius - half, radius + half)
    }

    /// Kernel mass and unknown neighbours of the fill around `centre`.
    fn read(&self, centre: usize) -> Fill {
        let density = self.kernel.mass_of_count(self.num_reached).unwrap_or_else(|| {
            let left = centre - self.kernel.radius();
            let words = self.planes.words_per_row();
            let rows = (0..self.half_chords.len()).map(|row| read_row::<W>(&self.reach[row * words..], left));
            self.kernel.mass(rows)
        });
        Fill { density, num_unknown: self.num_touched }
    }

    fn place(&self, row: usize, column: usize) -> (usize, u64) {
        (row * self.planes.words_per_row() + column / 64, 1 << (column % 64))
    }

    fn is_inside(&self, row: usize, column: usize, centre: usize) -> bool {
        column.abs_diff(centre) <= self.half_chords[row]
    }

    fn is_free(&self, row: usize, column: usize) -> bool {
        self.planes.free_word(self.bottom + row, column) >> (column % 64) & 1 == 1
    }

    fn is_reached(&self, row: usize, column: usize) -> bool {
        let (word, bit) = self.place(row, column);
        self.reach[word] & bit != 0
    }

    fn is_touched(&self, row: usize, column: usize) -> bool {
        let (word, bit) = self.place(row, column);
        self.touched[word] & bit != 0
    }

    fn touches_reach(&self, row: usize, column: usize) -> bool {
        self.is_reached(row, column - 1)
            || self.is_reached(row, column + 1)
            || (row > 0 && self.is_reached(row - 1, column))
            || (row + 1 < self.half_chords.len() && self.is_reached(row + 1, column))
    }

    fn reach_cell(&mut self, row: usize, column: usize) {
        let (word, bit) = self.place(row, column);
        self.reach[word] |= bit;
        self.num_reached += 1;
    }

    fn touch_if_beside_reach(&mut self, row: usize, column: usize) {
        if !self.is_touched(row, column) && self.touches_reach(row, column) {
            let (word, bit) = self.place(row, column);
            self.touched[word] |= bit;
            self.num_touched += 1;
        }
    }
}

/// The leftmost column of a square of 8 × 8 cells.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;

/// The left arc as runs of equal half chord, each from the outside inwards.
fn leaving_runs(half_chords: &[usize]) -> Vec<LeavingRun> {
    let middle = half_chords.len() / 2;
    let mut runs = Vec::new();
    let mut first = 0;
    while first < half_chords.len() {
        let half_chord = half_chords[first];
        let len = half_chords[first..].iter().take_while(|&&half| half == half_chord).count();
        let rows: Vec<usize> = (first..first + len).collect();
        let run = match (rows.contains(&middle), first < middle) {
            (true, _) => LeavingRun { half_chord, rows, inner_row: None },
            (false, true) => LeavingRun { half_chord, rows, inner_row: Some(first + len) },
            (false, false) => {
                LeavingRun { half_chord, rows: rows.into_iter().rev().collect(), inner_row: Some(first - 1) }
            }
        };
        runs.push(run);
        first += len;
    }
    runs
}

/// Floods `reach` within `masks`, by alternating passes until one changes nothing; starts at the `middle` row.
fn settle<const W: usize>(reach: &mut [Row<W>], masks: &[Row<W>], middle: usize) {
    let num_rows = reach.len();
    reach[middle] = spread(&reach[middle], &masks[middle]);
    let mut passes = 0;
    loop {
        let mut has_changed = false;
        let mut before = [0; W];
        for step in 0..num_rows {
            let row = if passes % 2 == 0 { step } else { num_rows - 1 - step };
            before = grow(&before, &mut reach[row], &masks[row], &mut has_changed);
        }
        passes += 1;
        if !has_changed && passes > 1 {
            return;
        }
    }
}

/// Adds to a row what the row `before` leads to; returns the row.
fn grow<const W: usize>(
    before: &Row<W>,
    reach: &mut Row<W>,
    mask: &Row<W>,
    has_changed: &mut bool,
) -> Row<W> {
    let seed = or(reach, &and(before, mask));
    if seed != *reach {
        *reach = spread(&seed, mask);
        *has_changed = true;
    }
    *reach
}

/// Writes a window's row into a row of words from a column on; returns the number of set bits.
fn write_row<const W: usize>(words: &mut [u64], column: usize, row: &Row<W>) -> u32 {
    let (first, shift) = (column / 64, column % 64);
    let mut num_set = 0;
    for (word, &bits) in row.iter().enumerate() {
        num_set += bits.count_ones();
        words[first + word] |= bits << shift;
        if shift > 0 && bits >> (64 - shift) != 0 {
            words[first + word + 1] |= bits >> (64 - shift);
        }
    }
    num_set
}

/// `64 W` bits of a row of words from a column on.
fn read_row<const W: usize>(words: &[u64], column: usize) -> Row<W> {
    let (first, shift) = (column / 64, column % 64);
    std::array::from_fn(|word| {
        let low = words[first + word] >> shift;
        let high = words.get(first + word + 1).copied().unwrap_or(0);
        if shift == 0 { low } else { low | high << (64 - shift) }
    })
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

    fn sweep_all(map: &GridMap, planes: &BitPlanes, kernel: &KernelRows) -> Vec<Option<Fill>> {
        let mut fills = vec![None; map.width() * map.height()];
        for (row, fills) in fills.chunks_exact_mut(map.width()).enumerate() {
            if kernel.radius() < 32 {
                DiscSweep::<1>::new(planes, kernel).sweep(0, row as i64, fills);
            } else {
                DiscSweep::<2>::new(planes, kernel).sweep(0, row as i64, fills);
            }
        }
        fills
    }

    #[test]
    fn sliding_discs_agree_with_the_literal_flood() {
        let mut rng = ChaCha8Rng::seed_from_u64(31);
        let cases =
            [(1.0, 20, 9), (3.0, 40, 33), (6.5, 37, 50), (15.0, 40, 33), (30.0, 50, 34), (57.0, 40, 30)];
        for (h, width, height) in cases {
            for profile in [KernelProfile::Uniform, KernelProfile::Gaussian, KernelProfile::Inverted] {
                let map = random_building(&mut rng, width, height);
                let kernel = KernelRows::new(profile, h);
                let planes = BitPlanes::new(&map, kernel.radius() + MARGIN);
                let fills = sweep_all(&map, &planes, &kernel);
                for (cell, fast) in fills.iter().enumerate() {
                    let cell = ((cell % width) as i64, (cell / width) as i64);
                    if h > 10.0 && rng.random_range(0..8) > 0 {
                        continue;
                    }
                    match (fast, literal_fill(&map, cell, profile, h)) {
                        (Some(fast), Some(slow)) => {
                            assert_eq!(fast.num_unknown, slow.num_unknown, "h {h} at {cell:?}");
                            assert!(
                                (fast.density - slow.density).abs() < 1e-5,
                                "{fast:?} {slow:?} h {h} at {cell:?}"
                            );
                        }
                        (fast, slow) => assert_eq!(*fast, slow, "h {h} at {cell:?}"),
                    }
                }
            }
        }
    }
}
