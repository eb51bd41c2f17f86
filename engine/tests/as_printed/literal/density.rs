//! Algorithms 3.1 and 6.1 as printed: a queue of cells, once per kernel.

use std::collections::{HashSet, VecDeque};

use locution_engine::density::{KernelConfig, KernelProfile};
use locution_engine::grid::Cell;

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    Free,
    Unknown,
    Occupied,
}

fn neighbors(cell: Cell) -> [Cell; 4] {
    [cell.offset(1, 0), cell.offset(-1, 0), cell.offset(0, 1), cell.offset(0, -1)]
}

fn distance(a: Cell, b: Cell) -> f64 {
    f64::from(a.x - b.x).hypot(f64::from(a.y - b.y))
}

fn weight(profile: KernelProfile, d: f64, h: f64) -> f64 {
    let c = 1.0;
    match profile {
        KernelProfile::Uniform => 1.0,
        KernelProfile::Gaussian => (-0.5 * d * d / (h * h)).exp(),
        KernelProfile::Inverted => h * (0.871 * c + c) - (h * h - d * d).sqrt() * c,
    }
}

/// Soft density, unknown cells met, and free cells on the border.
pub fn literal_flood(
    content: impl Fn(Cell) -> Content,
    center: Cell,
    kernel: &KernelConfig,
    resolution_m: f64,
) -> (f64, HashSet<Cell>, HashSet<Cell>) {
    let h = (kernel.bandwidth_m / resolution_m * 1e6).round() / 1e6;
    let (mut sum, mut unknown, mut border) = (0.0, HashSet::new(), HashSet::new());
    let (mut queue, mut processed) = (VecDeque::from([center]), HashSet::from([center]));
    while let Some(cell) = queue.pop_front() {
        let d = distance(cell, center);
        let is_free = cell == center || content(cell) == Content::Free;
        if d < h && is_free {
            sum += weight(kernel.profile, d, h);
            queue.extend(neighbors(cell).into_iter().filter(|&neighbor| processed.insert(neighbor)));
        } else if d < h && content(cell) == Content::Unknown {
            unknown.insert(cell);
        } else if is_free {
            border.insert(cell);
        }
    }
    let reach = h.ceil() as i32;
    let disc = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| f64::from(x).hypot(f64::from(y))));
    let total: f64 = disc.filter(|&d| d < h).map(|d| weight(kernel.profile, d, h)).sum();
    (sum / total, unknown, border)
}

/// Number of groups of more than so many cells that touch by edges or corners.
pub fn literal_groups(mut cells: HashSet<Cell>, min_cells: f64) -> usize {
    let mut num_groups = 0;
    while let Some(&start) = cells.iter().next() {
        cells.remove(&start);
        let (mut size, mut queue) = (0, vec![start]);
        while let Some(cell) = queue.pop() {
            size += 1;
            for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                queue.extend(cells.take(&cell.offset(dx, dy)));
            }
        }
        num_groups += usize::from(f64::from(size) > min_cells);
    }
    num_groups
}
