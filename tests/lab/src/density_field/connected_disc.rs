//! Free-space density of every cell of a map: the free cells inside a disc that hang together with its centre.
//!
//! Algorithm 3.1 floods a disc per cell. Here a disc slides along a row of centres and its fill is kept up to date:
//! one arc of cells leaves on the left, one enters on the right ([`super::arc_planes`] has them as words, a bit per row
//! of the disc).
//!
//! ```text
//!        leaving   ┌──────────┐   entering        What leaves is harmless when what it touches inside the disc hangs
//!            ░▒░   │          │  ▒                together without it: the cells to its right have no gap, or a gap
//!            ▒     │    c c'  │   ▒               that a square of 8 × 8 cells can bridge. Otherwise the fill might
//!            ░▒░   │          │  ▒                fall apart, and the disc is flooded afresh.
//!                  └──────────┘
//! ```
//!
//! The fill itself is kept as the arcs through which its cells entered: cell (x, row) is bit `row` of `reach[x − half
//! chord of the row]`. So what enters is one word, and what leaves is gathered from one word per length of chord.

use pulp::{Arch, Simd, WithSimd};

use super::arc_planes::{ArcPlanes, DiscShape};
use super::bit_window::{
    BitPlanes, Row, and, and_not, count, count_few, has, is_empty, or, set_bits, shifted_left, shifted_right,
    span, spread,
};
use super::kernel_rows::KernelRows;
use super::openings::Openings;

/// Cells per side of the square in which a gap may be bridged.
const BRIDGE: usize = 8;

/// The leftmost column of that square.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;

/// What a flood found at a centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fill {
    /// Kernel mass of the connected free cells, in [0, 1].
    pub density: f32,
    /// More of them than allowed have an unknown neighbour and hang together: an opening into the unknown.
    pub has_opening: bool,
}

/// A disc that slides along rows of centres; owns the scratch words of one thread.
pub(super) struct DiscSweep<'a, const W: usize> {
    planes: &'a BitPlanes,
    kernel: &'a KernelRows,
    shape: DiscShape<W>,
    arcs: ArcPlanes<W>,
    /// The fill, by the arcs through which its cells entered.
    reach: Vec<Row<W>>,
    /// The fill of the last flood afresh, row by row.
    rows: Vec<Row<W>>,
    /// The free cells that it could reach.
    masks: Vec<Row<W>>,
    /// First row of the disc and first column of the arcs, counted in padded cells.
    bottom: usize,
    left: usize,
    num_reached: u32,
    num_open: u32,
    /// Open cells that may hang together without being an opening.
    most_open: u32,
    /// Open cells in groups, while an opening is looked for.
    openings: Openings,
    /// Reached cells, and cells of runs perhaps not reached yet, from which a flood goes on.
    stack: Vec<(usize, usize)>,
    runs: Vec<(usize, usize)>,
}

impl<'a, const W: usize> DiscSweep<'a, W> {
    /// A sweep of a kernel whose disc must fit into `64 W` rows and columns; at most `most_open` open cells that hang
    /// together are no opening.
    pub fn new(planes: &'a BitPlanes, kernel: &'a KernelRows, most_open: u32) -> Self {
        let shape = DiscShape::new(kernel);
        Self {
            planes,
            kernel,
            rows: vec![[0; W]; shape.num_rows()],
            masks: vec![[0; W]; shape.num_rows()],
            shape,
            arcs: ArcPlanes::default(),
            reach: Vec::new(),
            bottom: 0,
            left: 0,
            num_reached: 0,
            num_open: 0,
            most_open,
            openings: Openings::default(),
            stack: Vec::new(),
            runs: Vec::new(),
        }
    }

    /// Fills of the centres of a row from `column` on; None where the centre is not free.
    pub fn sweep(&mut self, column: i64, row: i64, fills: &mut [Option<Fill>]) {
        Arch::new().dispatch(RowOfCenters { disc: self, column, row, fills });
    }

    #[inline(always)]
    fn fill_row(&mut self, column: i64, row: i64, fills: &mut [Option<Fill>]) {
        let radius = self.kernel.radius();
        let can_slide = self.kernel.is_uniform() && radius > 2;
        self.bottom = self.planes.padded(row) - radius;
        self.left = self.planes.padded(column) - 2 * radius;
        let num_arcs = fills.len() + 2 * radius + 1;
        self.reach.clear();
        self.reach.resize(num_arcs, [0; W]);
        if can_slide {
            self.arcs.cut(self.planes, &self.shape, (self.left, self.bottom), num_arcs);
        }
        let mut was_free = false;
        for (arc, fill) in (2 * radius..).zip(fills) {
            let is_free = self.is_free(radius, self.left + arc);
            if is_free && !(was_free && can_slide && self.slide_to(arc)) {
                self.flood(arc, can_slide);
            }
            *fill = is_free.then(|| self.read(arc, can_slide));
            was_free = is_free;
        }
    }

    /// Moves the disc to the centre `arc` from the one on its left; false when the fill might fall apart.
    #[inline(always)]
    fn slide_to(&mut self, arc: usize) -> bool {
        let leaving = self.shape.leaving(&self.reach, arc - 1);
        if !self.is_safe(&leaving, arc - 1) {
            return false;
        }
        self.num_reached -= count(&leaving);
        self.num_open -= count_few(&and(&leaving, &self.arcs.leaving_open[arc - 1]));
        self.enter(arc);
        true
    }

    /// True when the fill stays in one piece as the reached cells `leaving` leave the disc around `arc`.
    #[inline(always)]
    fn is_safe(&self, leaving: &Row<W>, arc: usize) -> bool {
        let beside = and(&self.arcs.leaving_free[arc + 1], leaving);
        let links = &self.shape.links;
        // Free cells on the right that have a leaving cell below them but no free one beside that: the end of a gap.
        let starts = and_not(&beside, &shifted_right(&and(&beside, links)));
        let gap_ends = and(&starts, &shifted_right(&and(leaving, links)));
        // Inner neighbours that stay, where the step over their corner is blocked.
        let corner = and(&beside, &self.arcs.leaving_inner[arc + 1]);
        let blocked = and_not(&and(leaving, &self.arcs.leaving_inner[arc]), &corner);
        if is_empty(&gap_ends) && is_empty(&blocked) {
            return true;
        }
        set_bits(&gap_ends).all(|row| self.is_gap_harmless(leaving, &beside, row, arc))
            && set_bits(&blocked).all(|row| self.is_corner_harmless(leaving, &beside, row, arc))
    }

    /// True when the gap below a free cell is the run's end or can be bridged.
    fn is_gap_harmless(&self, leaving: &Row<W>, beside: &Row<W>, row: usize, arc: usize) -> bool {
        let mut lower = row;
        while lower > 0 && has(&self.shape.links, lower - 1) && has(leaving, lower - 1) {
            lower -= 1;
            if has(beside, lower) {
                return self.is_bridged(lower, row, self.left + arc + 1 - self.shape.half_chords[row]);
            }
        }
        true
    }

    /// True when the inner neighbour of a leaving run touches the cells beside the run some other way.
    fn is_corner_harmless(&self, leaving: &Row<W>, beside: &Row<W>, row: usize, arc: usize) -> bool {
        let is_lower_half = row < self.kernel.radius();
        let inner = if is_lower_half { row + 1 } else { row - 1 };
        let column = self.left + arc - self.shape.half_chords[row];
        let mut nearest = row;
        loop {
            if has(beside, nearest) {
                return self.is_free(inner, column + 1) && self.is_bridged(nearest, inner, column + 1);
            }
            let outer = if is_lower_half { nearest.wrapping_sub(1) } else { nearest + 1 };
            let is_linked = outer < self.shape.num_rows() && has(&self.shape.links, outer.min(nearest));
            if !is_linked || !has(leaving, outer) {
                return true;
            }
            nearest = outer;
        }
    }

    /// True when two free cells of a column hang together within the eight columns from it on and the rows between
    /// them and one beside, all of which the disc must hold.
    fn is_bridged(&self, first: usize, second: usize, column: usize) -> bool {
        let (low, high) = (first.min(second).saturating_sub(1), first.max(second) + 1);
        if high >= self.shape.num_rows() || high - low >= BRIDGE {
            return false;
        }
        let mut board = 0u64;
        let own = self.shape.half_chords[first].min(self.shape.half_chords[second]);
        for row in low..=high {
            let half = self.shape.half_chords[row];
            if half >= own && half >= BRIDGE {
                board |= self.planes.free_byte(self.bottom + row, column) << (BRIDGE * (row - low));
            }
        }
        let goal = 1u64 << (BRIDGE * (second - low));
        let mut reached = 1u64 << (BRIDGE * (first - low)) & board;
        loop {
            let sideways = (reached << 1 & !FIRST_COLUMN) | (reached >> 1 & !(FIRST_COLUMN << (BRIDGE - 1)));
            let next = (reached | sideways | reached << BRIDGE | reached >> BRIDGE) & board;
            if next & goal != 0 || next == reached {
                return next & goal != 0;
            }
            reached = next;
        }
    }

    /// Takes the right arc of the disc around `arc` into the fill, and whatever hangs on it.
    #[inline(always)]
    fn enter(&mut self, arc: usize) {
        let free = self.arcs.entering_free[arc];
        let (reached_inside, free_inside) = self.shape.inner(&self.reach, &self.arcs.entering_free, arc);
        let on_left = self.reach[arc - 1];
        let mut joined = and(&free, &or(&on_left, &reached_inside));
        loop {
            let links = &self.shape.links;
            let beside = or(&shifted_right(&and(&joined, links)), &and(&shifted_left(&joined), links));
            let more = and_not(&and(&free, &beside), &joined);
            if is_empty(&more) {
                break;
            }
            joined = or(&joined, &more);
        }
        self.reach[arc] = joined;
        self.num_reached += count(&joined);
        self.num_open += count_few(&and(&joined, &self.arcs.entering_open[arc]));
        let missed_left = and_not(&self.arcs.entering_free[arc - 1], &on_left);
        let missed = or(&missed_left, &and_not(&free_inside, &reached_inside));
        for row in set_bits(&and(&joined, &missed)) {
            self.stack.push((row, self.left + arc + self.shape.half_chords[row]));
        }
        self.flood_on(arc);
    }

    /// Spreads from the reached cells on the stack to whatever hangs on them.
    fn flood_on(&mut self, arc: usize) {
        let center = self.left + arc;
        for _ in 0..self.stack.len() {
            let Some((row, column)) = self.stack.pop() else { break };
            for (row, column) in
                [(row, column - 1), (row, column + 1), (row.wrapping_sub(1), column), (row + 1, column)]
            {
                if row < self.shape.num_rows() && column.abs_diff(center) <= self.shape.half_chords[row] {
                    self.runs.push((row, column));
                }
            }
        }
        while let Some((row, column)) = self.runs.pop() {
            let entered = column - self.shape.half_chords[row] - self.left;
            if self.is_free(row, column) && !has(&self.reach[entered], row) {
                self.take_run(row, column, center - self.kernel.radius());
            }
        }
    }

    /// Takes the run of free cells around a cell that is not reached into the fill and notes where it goes on; `left`
    /// is the disc's leftmost column.
    ///
    /// Cells of a run are reached together, except that the cell which has just entered may be ahead of the others.
    fn take_run(&mut self, row: usize, column: usize, left: usize) {
        let bit = (column - left) as i64;
        let free = |row: usize| and(&self.planes.free_row(self.bottom + row, left), &self.shape.disc[row]);
        let run = spread(&span(bit, bit), &free(row));
        for beside in [row.wrapping_sub(1), row + 1] {
            if beside < self.shape.num_rows() {
                let touched = and(&run, &free(beside));
                let starts = and_not(&touched, &shifted_right(&touched));
                self.runs.extend(set_bits(&starts).map(|bit| (beside, left + bit)));
            }
        }
        let open = and(&run, &self.planes.open_row(self.bottom + row, left));
        let (word, cell) = (row / 64, 1u64 << (row % 64));
        // Bits count from the disc's leftmost column, arcs from half a chord before that.
        let first_arc = left - self.shape.half_chords[row] - self.left;
        for bit in set_bits(&run) {
            let arc = &mut self.reach[first_arc + bit][word];
            let is_new = u32::from(*arc & cell == 0);
            *arc |= cell;
            self.num_reached += is_new;
            self.num_open += is_new & u32::from(has(&open, bit));
        }
    }

    /// Floods the disc around `arc` from nothing; `keeps` says whether the disc may slide on.
    #[inline(always)]
    fn flood(&mut self, arc: usize, keeps: bool) {
        let radius = self.kernel.radius();
        let left = self.left + arc - radius;
        for (row, (mask, disc)) in self.masks.iter_mut().zip(&self.shape.disc).enumerate() {
            *mask = and(disc, &self.planes.free_row(self.bottom + row, left));
        }
        self.rows.fill([0; W]);
        self.rows[radius] = span(radius as i64, radius as i64);
        settle(&mut self.rows, &self.masks, radius);
        (self.num_reached, self.num_open) = (0, 0);
        for (row, reached) in self.rows.iter().enumerate() {
            self.num_reached += count(reached);
            self.num_open += count_few(&and(reached, &self.planes.open_row(self.bottom + row, left)));
        }
        if keeps {
            self.shape.by_arcs(&self.rows, &mut self.reach[arc - 2 * radius..=arc]);
        }
    }

    /// What the fill around `arc` comes to; `by_arcs` says whether it is kept by arcs.
    #[inline(always)]
    fn read(&mut self, arc: usize, by_arcs: bool) -> Fill {
        let has_opening = self.num_open > self.most_open && self.has_opening(arc, by_arcs);
        let density = self
            .kernel
            .mass_of_count(self.num_reached)
            .unwrap_or_else(|| self.kernel.mass(self.rows.iter().copied()));
        Fill { density, has_opening }
    }

    /// Whether enough open cells of the fill hang together.
    fn has_opening(&mut self, arc: usize, by_arcs: bool) -> bool {
        let radius = self.kernel.radius();
        self.openings.clear();
        if by_arcs {
            for entered in arc - 2 * radius..=arc {
                let open = and(&self.reach[entered], &self.arcs.entering_open[entered]);
                if is_empty(&open) {
                    continue;
                }
                // Rows of shorter chords have lost the cells that entered first.
                let is_inside = |&row: &usize| entered + 2 * self.shape.half_chords[row] >= arc;
                let cells = set_bits(&open).filter(is_inside);
                self.openings.extend(cells.map(|row| (row, entered + self.shape.half_chords[row])));
            }
        } else {
            let left = self.left + arc - radius;
            for (row, reached) in self.rows.iter().enumerate() {
                let open = and(reached, &self.planes.open_row(self.bottom + row, left));
                self.openings.extend(set_bits(&open).map(|bit| (row, bit)));
            }
        }
        self.openings.has_larger_than(self.most_open)
    }

    #[inline(always)]
    fn is_free(&self, row: usize, column: usize) -> bool {
        self.planes.is_free(self.bottom + row, column)
    }
}

/// The fills of a row of centres, compiled for the words and counts of bits that the processor at hand has.
struct RowOfCenters<'a, 'b, const W: usize> {
    disc: &'a mut DiscSweep<'b, W>,
    column: i64,
    row: i64,
    fills: &'a mut [Option<Fill>],
}

impl<const W: usize> WithSimd for RowOfCenters<'_, '_, W> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.disc.fill_row(self.column, self.row, self.fills);
    }
}

/// Floods `reach` within `masks`, from the `middle` row up, then all the way down and up again until a way changes
/// nothing.
#[inline(always)]
fn settle<const W: usize>(reach: &mut [Row<W>], masks: &[Row<W>], middle: usize) {
    reach[middle] = spread(&reach[middle], &masks[middle]);
    let mut has_changed = false;
    let mut before = reach[middle];
    for (row, mask) in reach[middle + 1..].iter_mut().zip(&masks[middle + 1..]) {
        before = grow(&before, row, mask, &mut has_changed);
    }
    loop {
        has_changed = false;
        for (row, mask) in reach.iter_mut().zip(masks).rev() {
            before = grow(&before, row, mask, &mut has_changed);
        }
        if !has_changed {
            return;
        }
        has_changed = false;
        for (row, mask) in reach.iter_mut().zip(masks) {
            before = grow(&before, row, mask, &mut has_changed);
        }
        if !has_changed {
            return;
        }
    }
}

/// Adds to a row what the row `before` leads to; returns the row.
#[inline(always)]
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
