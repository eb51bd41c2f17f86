//! The free floor of a grid as plain cells, and regions of it that are numbered from 1; 0 is no region.

use std::collections::{BTreeMap, BTreeSet};

use crate::occupancy::{CellState, GridMap};

/// Free cells, row by row.
pub(super) struct Floor {
    pub width: usize,
    pub height: usize,
    pub resolution_m: f64,
    pub is_free: Vec<bool>,
}

impl Floor {
    /// The free cells of a grid and what small obstacles cover.
    pub fn of_grid(grid: &GridMap, obstacle_size_m: f64) -> Self {
        let is_free: Vec<bool> = grid.cells().iter().map(|&state| state == CellState::Free).collect();
        let (width, height, resolution_m) = (grid.width(), grid.height(), grid.resolution_m());
        let mut floor = Self { width, height, resolution_m, is_free };
        floor.clear_obstacles(obstacle_size_m);
        floor
    }

    /// The cells beside a cell, over edges.
    pub fn beside(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (width, column) = (self.width, cell % self.width);
        let num_cells = self.width * self.height;
        [
            (cell >= width).then(|| cell.wrapping_sub(width)),
            (column > 0).then(|| cell.wrapping_sub(1)),
            (column + 1 < width).then_some(cell + 1),
            (cell + width < num_cells).then_some(cell + width),
        ]
        .into_iter()
        .flatten()
    }

    /// The cells around a cell, over edges and corners.
    pub fn around(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (width, height) = (self.width, self.height);
        let (column, row) = (cell % width, cell / width);
        (row.saturating_sub(1)..=(row + 1).min(height - 1)).flat_map(move |r| {
            (column.saturating_sub(1)..=(column + 1).min(width - 1))
                .map(move |c| r * width + c)
                .filter(move |&other| other != cell)
        })
    }

    /// Area of one cell, square metres.
    pub const fn cell_m2(&self) -> f64 {
        self.resolution_m * self.resolution_m
    }

    /// Frees what hangs together, stays clear of the border and extends less than `size_m` along both axes.
    fn clear_obstacles(&mut self, size_m: f64) {
        let mut is_seen = self.is_free.clone();
        for start in 0..is_seen.len() {
            if is_seen[start] {
                continue;
            }
            is_seen[start] = true;
            let mut cells = vec![start];
            let (mut low, mut high) = ((usize::MAX, usize::MAX), (0, 0));
            let mut next = 0;
            while let Some(&cell) = cells.get(next) {
                next += 1;
                let (column, row) = (cell % self.width, cell / self.width);
                low = (low.0.min(column), low.1.min(row));
                high = (high.0.max(column), high.1.max(row));
                for other in self.around(cell) {
                    if !is_seen[other] {
                        is_seen[other] = true;
                        cells.push(other);
                    }
                }
            }
            let is_inside = low.0 > 0 && low.1 > 0 && high.0 + 1 < self.width && high.1 + 1 < self.height;
            let extent = (high.0 - low.0).max(high.1 - low.1) + 1;
            if is_inside && (extent as f64) * self.resolution_m < size_m {
                cells.into_iter().for_each(|cell| self.is_free[cell] = true);
            }
        }
    }
}

/// Gives every region smaller than `area_min_m2`, smallest first, to the region it touches most; one that touches none is
/// dropped.
pub(super) fn absorb_small(floor: &Floor, regions: &mut [u32], area_min_m2: f64) {
    let mut num_cells: BTreeMap<u32, usize> = BTreeMap::new();
    let mut contacts: BTreeMap<u32, BTreeMap<u32, usize>> = BTreeMap::new();
    for (cell, &region) in regions.iter().enumerate().filter(|(_, region)| **region != 0) {
        *num_cells.entry(region).or_default() += 1;
        for other in floor.beside(cell).map(|other| regions[other]) {
            if other != 0 && other != region {
                *contacts.entry(region).or_default().entry(other).or_default() += 1;
            }
        }
    }
    let is_small = |num_cells: usize| (num_cells as f64) * floor.cell_m2() < area_min_m2;
    let mut small: BTreeSet<(usize, u32)> =
        num_cells.iter().map(|(region, num)| (*num, *region)).filter(|(num, _)| is_small(*num)).collect();
    let mut heir_of: BTreeMap<u32, u32> = BTreeMap::new();
    while let Some((num, region)) = small.pop_first() {
        let touched = contacts.remove(&region).unwrap_or_default();
        let most = touched.iter().rev().max_by_key(|(_, length)| **length);
        let heir = most.map_or(0, |(other, _)| *other);
        heir_of.insert(region, heir);
        if heir == 0 {
            continue;
        }
        let grown = num_cells.entry(heir).or_default();
        small.remove(&(*grown, heir));
        *grown += num;
        if is_small(*grown) {
            small.insert((*grown, heir));
        }
        for (other, length) in touched {
            let of_other = contacts.entry(other).or_default();
            of_other.remove(&region);
            if other != heir {
                *of_other.entry(heir).or_default() += length;
                *contacts.entry(heir).or_default().entry(other).or_default() += length;
            }
        }
    }
    for region in regions.iter_mut() {
        while let Some(heir) = heir_of.get(region) {
            *region = *heir;
        }
    }
}
