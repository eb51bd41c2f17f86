//! The density estimate around a cell, for all kernels in one flood fill (thesis Algorithms 3.1 and 6.1).

use pulp::{Arch, Simd, WithSimd};

use super::bit_row::BitRow;
use super::config::DensityConfig;
use super::flood_fill::{Row, count_groups, flood_fill, has_group, rows_with_neighbors};
use super::kernel::Kernel;
use crate::grid::{Cell, OccupancyRows};

/// What is known of the free space around a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeSpaceDensity {
    /// Soft density Ψ of each kernel in the order of the config, in [0, 1].
    pub soft: Vec<f32>,
    /// Whether the first kernel's soft density is hard too: its flood fill met no opening of unknown cells.
    pub is_hard: bool,
    /// Frontiers of the first kernel.
    pub num_frontiers: u8,
}

/// Computes densities on grids of one resolution.
#[derive(Clone, Debug)]
pub struct DensityEstimator {
    kernels: Vec<Kernel>,
    /// Indices of the kernels, narrowest first.
    by_bandwidth: Vec<usize>,
    min_opening_cells: f64,
    min_frontier_cells: f64,
    /// Rows above and below the centre that the widest kernel and its border need.
    reach: usize,
}

impl DensityEstimator {
    /// An estimator for cells of `resolution_m`. The config must have passed its check.
    pub fn new(config: &DensityConfig, resolution_m: f64) -> Self {
        let kernels: Vec<Kernel> =
            config.kernels.iter().map(|kernel| Kernel::new(kernel, resolution_m)).collect();
        let mut by_bandwidth: Vec<usize> = (0..kernels.len()).collect();
        by_bandwidth.sort_by(|&a, &b| kernels[a].bandwidth.total_cmp(&kernels[b].bandwidth).then(a.cmp(&b)));
        let perimeter = kernels.first().map_or(0.0, Kernel::perimeter);
        // The border of a support lies less than one cell outside it.
        let reach = kernels.iter().map(|kernel| kernel.half_widths.len()).max().unwrap_or(0);
        Self {
            kernels,
            by_bandwidth,
            min_opening_cells: config.opening_tolerance * perimeter,
            min_frontier_cells: config.frontier_share * perimeter,
            reach,
        }
    }

    /// Densities, hard flag and frontiers around `center`, which counts as free: the robot was there.
    pub fn estimate(&self, grid: &impl OccupancyRows, center: Cell) -> FreeSpaceDensity {
        // Compiled for several processors; the results are the same.
        Arch::new().dispatch(Estimate { estimator: self, grid, center })
    }

    #[inline(always)]
    fn estimate_rows<const W: usize>(&self, grid: &impl OccupancyRows, center: Cell) -> FreeSpaceDensity {
        let mut rows = self.read_rows::<W>(grid, center);
        let middle = &mut rows[self.reach];
        middle.free.insert(self.reach);
        middle.reached.insert(self.reach);
        // What counts as free is no opening into the unknown.
        middle.unknown = middle.unknown.and_not(&middle.reached);
        let mut answer =
            FreeSpaceDensity { soft: vec![0.0; self.kernels.len()], is_hard: true, num_frontiers: 0 };
        for &index in &self.by_bandwidth {
            let kernel = &self.kernels[index];
            for (dy, &half) in kernel.half_widths.iter().enumerate() {
                let support = BitRow::range(self.reach - half as usize, self.reach + half as usize);
                rows[self.reach + dy].support = support;
                rows[self.reach - dy].support = support;
            }
            // What a narrower kernel reached is reached by a wider one too, so the fill goes on from there.
            flood_fill(&mut rows);
            answer.soft[index] = kernel.density(&rows, self.reach);
            if index == 0 {
                // Algorithm 3.1, lines 11 and 12, with the tolerance of SPEC 3.2.
                let met = rows_with_neighbors(&rows, |row| row.unknown.and(&row.support));
                answer.is_hard = !has_group(met, self.min_opening_cells);
                // Algorithm 6.1.
                let border = rows_with_neighbors(&rows, |row| row.free.and_not(&row.support));
                answer.num_frontiers = count_groups(border, self.min_frontier_cells).min(255) as u8;
            }
        }
        answer
    }

    /// The square of cells around a centre.
    #[inline(always)]
    fn read_rows<const W: usize>(&self, grid: &impl OccupancyRows, center: Cell) -> Vec<Row<W>> {
        let reach = self.reach as i32;
        let mut rows = vec![Row::EMPTY; 2 * self.reach + 1];
        for (row, dy) in rows.iter_mut().zip(-reach..) {
            grid.read_row(center.offset(-reach, dy), &mut row.free.0, &mut row.unknown.0);
        }
        rows
    }
}

/// An estimate to be made by code for the processor at hand.
struct Estimate<'a, G> {
    estimator: &'a DensityEstimator,
    grid: &'a G,
    center: Cell,
}

impl<G: OccupancyRows> WithSimd for Estimate<'_, G> {
    type Output = FreeSpaceDensity;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> FreeSpaceDensity {
        let Self { estimator, grid, center } = self;
        match (2 * estimator.reach + 1).div_ceil(64) {
            0 | 1 => estimator.estimate_rows::<1>(grid, center),
            2 => estimator.estimate_rows::<2>(grid, center),
            3 => estimator.estimate_rows::<3>(grid, center),
            4 => estimator.estimate_rows::<4>(grid, center),
            _ => estimator.estimate_rows::<9>(grid, center),
        }
    }
}
