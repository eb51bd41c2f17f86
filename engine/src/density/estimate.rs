//! The density estimate around a cell, for all kernels in one flood fill (thesis Algorithms 3.1 and 6.1).

use super::bit_row::BitRow;
use super::config::DensityConfig;
use super::flood_fill::{count_groups, flood_fill, with_neighbors};
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
        match (2 * self.reach + 1).div_ceil(64) {
            0 | 1 => self.estimate_rows::<1>(grid, center),
            2 => self.estimate_rows::<2>(grid, center),
            3 => self.estimate_rows::<3>(grid, center),
            4 => self.estimate_rows::<4>(grid, center),
            _ => self.estimate_rows::<9>(grid, center),
        }
    }

    fn estimate_rows<const W: usize>(&self, grid: &impl OccupancyRows, center: Cell) -> FreeSpaceDensity {
        let mut window = Window::<W>::read(grid, center, self.reach);
        window.free[self.reach].insert(self.reach);
        // What counts as free is no opening into the unknown.
        window.unknown[self.reach] =
            window.unknown[self.reach].and_not(&BitRow::range(self.reach, self.reach));
        let mut reached = vec![BitRow::EMPTY; window.free.len()];
        reached[self.reach].insert(self.reach);
        let mut answer =
            FreeSpaceDensity { soft: vec![0.0; self.kernels.len()], is_hard: true, num_frontiers: 0 };
        for &index in &self.by_bandwidth {
            // What a narrower kernel reached is reached by a wider one too, so the fill goes on from there.
            let support = self.support::<W>(&self.kernels[index]);
            let allowed: Vec<_> =
                window.free.iter().zip(&support).map(|(free, support)| free.and(support)).collect();
            flood_fill(&mut reached, &allowed);
            answer.soft[index] = self.kernels[index].density(&reached, self.reach);
            if index == 0 {
                answer.is_hard = !self.has_opening(&window, &reached, &support);
                answer.num_frontiers = self.num_frontiers(&window, &reached, &support);
            }
        }
        answer
    }

    fn support<const W: usize>(&self, kernel: &Kernel) -> Vec<BitRow<W>> {
        let mut rows = vec![BitRow::EMPTY; 2 * self.reach + 1];
        for (dy, &half) in kernel.half_widths.iter().enumerate() {
            let row = BitRow::range(self.reach - half as usize, self.reach + half as usize);
            rows[self.reach + dy] = row;
            rows[self.reach - dy] = row;
        }
        rows
    }

    /// Algorithm 3.1, lines 11 and 12, with the tolerance of SPEC 3.2.
    fn has_opening<const W: usize>(
        &self,
        window: &Window<W>,
        reached: &[BitRow<W>],
        support: &[BitRow<W>],
    ) -> bool {
        let met = (0..reached.len())
            .map(|row| with_neighbors(reached, row).and(&window.unknown[row]).and(&support[row]));
        let num_met: u32 = met.clone().map(|row| row.count()).sum();
        f64::from(num_met) > self.min_opening_cells && count_groups(met, self.min_opening_cells) > 0
    }

    /// Algorithm 6.1.
    fn num_frontiers<const W: usize>(
        &self,
        window: &Window<W>,
        reached: &[BitRow<W>],
        support: &[BitRow<W>],
    ) -> u8 {
        let border = (0..reached.len())
            .map(|row| with_neighbors(reached, row).and(&window.free[row]).and_not(&support[row]));
        count_groups(border, self.min_frontier_cells).min(255) as u8
    }
}

/// The square of cells around a centre.
struct Window<const W: usize> {
    free: Vec<BitRow<W>>,
    unknown: Vec<BitRow<W>>,
}

impl<const W: usize> Window<W> {
    fn read(grid: &impl OccupancyRows, center: Cell, reach: usize) -> Self {
        let num_rows = 2 * reach + 1;
        let mut window = Self { free: vec![BitRow::EMPTY; num_rows], unknown: vec![BitRow::EMPTY; num_rows] };
        for row in 0..num_rows {
            let start = center.offset(-(reach as i32), row as i32 - reach as i32);
            grid.read_row(start, &mut window.free[row].0, &mut window.unknown[row].0);
        }
        window
    }
}
