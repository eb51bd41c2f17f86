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
/// A closed ring of border cells is connected only across corners, hence the eight-neighbourhood. Empties `rows`.
pub(super) fn count_groups<const W: usize>(rows: &mut [BitRow<W>], min_cells: f64) -> usize {
    let mut num_groups = 0;
    let mut open = Vec::new();
    for index in 0..rows.len() {
        while !rows[index].is_empty() {
            let word = rows[index].0.iter().position(|&word| word != 0).unwrap_or(0);
            open.push((index, word * 64 + rows[index].0[word].trailing_zeros() as usize));
            rows[index].remove(open[0].1);
            let mut size = 0;
            while let Some((row, cell)) = open.pop() {
                size += 1;
                for near_row in row.saturating_sub(1)..=(row + 1).min(rows.len() - 1) {
                    for near_cell in cell.saturating_sub(1)..=(cell + 1).min(64 * W - 1) {
                        if rows[near_row].has(near_cell) {
                            rows[near_row].remove(near_cell);
                            open.push((near_row, near_cell));
                        }
                    }
                }
            }
            if f64::from(size) > min_cells {
                num_groups += 1;
            }
        }
    }
    num_groups
}
