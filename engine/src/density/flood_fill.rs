//! The flood fill of Algorithms 3.1 and 6.1 on rows of bits.

use super::bit_row::BitRow;

/// One row of the cells around a centre.
#[derive(Clone, Copy)]
pub(super) struct Row<const W: usize> {
    pub free: BitRow<W>,
    pub unknown: BitRow<W>,
    /// Cells within the kernel's bandwidth.
    pub support: BitRow<W>,
    pub reached: BitRow<W>,
}

impl<const W: usize> Row<W> {
    pub const EMPTY: Self =
        Self { free: BitRow::EMPTY, unknown: BitRow::EMPTY, support: BitRow::EMPTY, reached: BitRow::EMPTY };
}

/// Grows what is reached to all free cells of the support that hang together with it by edges (the
/// four-neighbourhood).
///
/// Sweeps from the middle out, down and up until nothing changes: a row is filled at once, and only when a
/// neighbouring row reached something new below or above it. A convex room around the middle takes one sweep.
#[inline(always)]
pub(super) fn flood_fill<const W: usize>(rows: &mut [Row<W>]) {
    for row in rows.iter_mut().filter(|row| !row.reached.is_empty()) {
        row.reached = row.reached.spread_within(&row.free.and(&row.support));
    }
    // Both ways from the middle turn by turn, as the processor works on both at once.
    let middle = rows.len() / 2;
    for distance in 1..=middle {
        enter_row(rows, middle - distance, middle - distance + 1);
        enter_row(rows, middle + distance, middle + distance - 1);
    }
    let mut changed = true;
    while changed {
        changed = false;
        for index in 1..rows.len() {
            changed |= enter_row(rows, index, index - 1);
        }
        for index in (1..rows.len()).rev() {
            changed |= enter_row(rows, index - 1, index);
        }
    }
}

/// Lets row `index` be entered from row `from`; true when that reached new cells.
#[inline(always)]
fn enter_row<const W: usize>(rows: &mut [Row<W>], index: usize, from: usize) -> bool {
    let above = rows[from].reached;
    let row = &mut rows[index];
    let allowed = row.free.and(&row.support);
    let entered = above.and(&allowed).and_not(&row.reached);
    if entered.is_empty() {
        return false;
    }
    row.reached = row.reached.or(&entered).spread_within(&allowed);
    true
}

/// Reached cells and their neighbours above, below, left and right, row by row, that lie in a `mask` of the row.
#[inline(always)]
pub(super) fn rows_with_neighbors<const W: usize>(
    rows: &[Row<W>],
    mask: impl Fn(&Row<W>) -> BitRow<W>,
) -> impl Iterator<Item = BitRow<W>> {
    let mut above = BitRow::EMPTY;
    rows.iter().enumerate().map(move |(index, row)| {
        let below = rows.get(index + 1).map_or(BitRow::EMPTY, |row| row.reached);
        let around = row.reached.widened().or(&above).or(&below);
        above = row.reached;
        around.and(&mask(row))
    })
}

/// Number of groups of cells with more than `min_cells` members; cells of a group touch by edges or corners.
#[inline(always)]
pub(super) fn count_groups<const W: usize>(rows: impl Iterator<Item = BitRow<W>>, min_cells: f64) -> usize {
    Groups::of(rows, f64::INFINITY).count_larger_than(min_cells)
}

/// Whether there is such a group.
#[inline(always)]
pub(super) fn has_group<const W: usize>(rows: impl Iterator<Item = BitRow<W>>, min_cells: f64) -> bool {
    f64::from(Groups::of(rows, min_cells).largest) > min_cells
}

/// Cells `start..end` of a row.
#[derive(Clone, Copy)]
struct Run {
    start: usize,
    end: usize,
    group: usize,
}

/// Room for as many runs as a border of a kernel of some metres has, so that it need not grow.
const USUAL_NUM_RUNS: usize = 256;

/// A member of a disjoint set.
struct Group {
    parent: usize,
    /// Of the whole set when it is its own parent.
    num_cells: u32,
}

/// Disjoint sets of runs.
struct Groups {
    groups: Vec<Group>,
    /// Cells of the largest.
    largest: u32,
}

impl Groups {
    /// The groups of cells, up to the row in which one is found that has more than `enough` members.
    ///
    /// A closed ring of border cells is connected only across corners, hence the eight-neighbourhood. Runs of cells
    /// are united with the runs they touch in the row before.
    #[inline(always)]
    fn of<const W: usize>(rows: impl Iterator<Item = BitRow<W>>, enough: f64) -> Self {
        let mut groups = Self { groups: Vec::with_capacity(USUAL_NUM_RUNS), largest: 0 };
        let (mut previous, mut current): (Vec<Run>, Vec<Run>) =
            (Vec::with_capacity(32 * W), Vec::with_capacity(32 * W));
        for row in rows {
            current.clear();
            let mut touching = 0;
            row.for_each_run(|start, end| {
                let group = groups.add((end - start) as u32);
                // Runs of both rows come from left to right; what ends before this run touches no later one.
                while touching < previous.len() && previous[touching].end < start {
                    touching += 1;
                }
                for run in previous[touching..].iter().take_while(|run| run.start <= end) {
                    groups.unite(run.group, group);
                }
                current.push(Run { start, end, group });
            });
            if f64::from(groups.largest) > enough {
                break;
            }
            std::mem::swap(&mut previous, &mut current);
        }
        groups
    }

    #[inline(always)]
    fn add(&mut self, num_cells: u32) -> usize {
        self.groups.push(Group { parent: self.groups.len(), num_cells });
        self.largest = self.largest.max(num_cells);
        self.groups.len() - 1
    }

    #[inline(always)]
    fn root(&mut self, mut group: usize) -> usize {
        while self.groups[group].parent != group {
            self.groups[group].parent = self.groups[self.groups[group].parent].parent;
            group = self.groups[group].parent;
        }
        group
    }

    #[inline(always)]
    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            self.groups[b].parent = a;
            self.groups[a].num_cells += self.groups[b].num_cells;
            self.largest = self.largest.max(self.groups[a].num_cells);
        }
    }

    fn count_larger_than(&self, min_cells: f64) -> usize {
        let roots = self.groups.iter().enumerate().filter(|(index, group)| group.parent == *index);
        roots.filter(|(_, group)| f64::from(group.num_cells) > min_cells).count()
    }
}
