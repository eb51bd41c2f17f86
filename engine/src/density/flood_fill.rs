//! The flood fill of Algorithms 3.1 and 6.1 on rows of bits.

use super::bit_row::BitRow;

/// Grows `reached` to all cells of `allowed` that hang together with it by edges (the four-neighbourhood).
///
/// Sweeps down and up until nothing changes: a row is filled at once, and only when a neighbouring row reached
/// something new below or above it. A convex room takes one sweep each way.
pub(super) fn flood_fill<const W: usize>(reached: &mut [BitRow<W>], allowed: &[BitRow<W>]) {
    for (row, allowed) in reached.iter_mut().zip(allowed) {
        if !row.is_empty() {
            *row = row.spread_within(allowed);
        }
    }
    let mut changed = true;
    while changed {
        changed = false;
        for index in 1..reached.len() {
            changed |= enter_row(reached, allowed, index, index - 1);
        }
        for index in (1..reached.len()).rev() {
            changed |= enter_row(reached, allowed, index - 1, index);
        }
    }
}

/// Lets row `index` be entered from row `from`; true when that reached new cells.
fn enter_row<const W: usize>(
    reached: &mut [BitRow<W>],
    allowed: &[BitRow<W>],
    index: usize,
    from: usize,
) -> bool {
    let entered = reached[from].and(&allowed[index]).and_not(&reached[index]);
    if entered.is_empty() {
        return false;
    }
    reached[index] = reached[index].or(&entered).spread_within(&allowed[index]);
    true
}

/// Reached cells and their neighbours above, below, left and right.
pub(super) fn with_neighbors<const W: usize>(reached: &[BitRow<W>], index: usize) -> BitRow<W> {
    let mut row = reached[index].widened();
    if index > 0 {
        row = row.or(&reached[index - 1]);
    }
    if index + 1 < reached.len() {
        row = row.or(&reached[index + 1]);
    }
    row
}

/// Number of groups of cells with more than `min_cells` members; cells of a group touch by edges or corners.
///
/// A closed ring of border cells is connected only across corners, hence the eight-neighbourhood. Runs of cells are
/// united with the runs they touch in the row before.
pub(super) fn count_groups<const W: usize>(rows: impl Iterator<Item = BitRow<W>>, min_cells: f64) -> usize {
    let mut groups = Groups::with_capacity(USUAL_NUM_RUNS);
    let (mut previous, mut current): (Vec<Run>, Vec<Run>) = (Vec::with_capacity(8), Vec::with_capacity(8));
    for row in rows {
        current.clear();
        let mut touching = 0;
        row.for_each_run(|start, end| {
            let group = groups.add(end - start);
            // Runs of both rows come from left to right; what ends before this run touches no later one.
            while touching < previous.len() && previous[touching].end < start {
                touching += 1;
            }
            for run in previous[touching..].iter().take_while(|run| run.start <= end) {
                groups.unite(run.group, group);
            }
            current.push(Run { start, end, group });
        });
        std::mem::swap(&mut previous, &mut current);
    }
    groups.count_larger_than(min_cells)
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

/// Disjoint sets with the number of cells in each.
struct Groups {
    parents: Vec<usize>,
    num_cells: Vec<usize>,
}

impl Groups {
    fn with_capacity(num_groups: usize) -> Self {
        Self { parents: Vec::with_capacity(num_groups), num_cells: Vec::with_capacity(num_groups) }
    }

    fn add(&mut self, num_cells: usize) -> usize {
        self.parents.push(self.parents.len());
        self.num_cells.push(num_cells);
        self.parents.len() - 1
    }

    fn root(&mut self, mut group: usize) -> usize {
        while self.parents[group] != group {
            self.parents[group] = self.parents[self.parents[group]];
            group = self.parents[group];
        }
        group
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            self.parents[b] = a;
            self.num_cells[a] += self.num_cells[b];
        }
    }

    fn count_larger_than(&self, min_cells: f64) -> usize {
        let roots = self.parents.iter().enumerate().filter(|(group, parent)| group == *parent);
        roots.filter(|(group, _)| self.num_cells[*group] as f64 > min_cells).count()
    }
}
