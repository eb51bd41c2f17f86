//! Kernels on the grid, normalised by their own discrete sums (thesis Eqs 2.14 to 2.16, SPEC 3.3).
//!
//! Weights are integers whose sum is about 2³¹, so that sums are exact in any order, and a run of cells in a row is
//! the difference of two prefix sums.

use super::bit_row::BitRow;
use super::config::{KernelConfig, KernelProfile};
use super::flood_fill::Row;
use crate::grid::in_cells;

/// What the weights of a kernel add up to, but for rounding.
const TOTAL: f64 = (1u32 << 31) as f64;

/// A kernel as weights of cells around its centre.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    /// Bandwidth in cells.
    pub bandwidth: f64,
    /// Columns left and right of the centre within the support, by distance from the centre's row.
    pub half_widths: Vec<i32>,
    /// For each row distance, sums of the weights of all cells left of a column, from the row's first; none for
    /// a uniform kernel.
    prefix_sums: Vec<Vec<u32>>,
    total: u64,
    /// The weight of every cell of a uniform kernel, whose cells need only be counted.
    uniform_weight: Option<u64>,
}

impl Kernel {
    /// The kernel on cells of `resolution_m`.
    pub fn new(config: &KernelConfig, resolution_m: f64) -> Self {
        let bandwidth = in_cells(config.bandwidth_m, resolution_m);
        let half_widths = half_widths(bandwidth);
        let weights: Vec<Vec<f64>> = half_widths
            .iter()
            .zip(0i32..)
            .map(|(&half, dy)| {
                (-half..=half)
                    .map(|dx| weight(config.profile, f64::from(dx).hypot(f64::from(dy)), bandwidth))
                    .collect()
            })
            .collect();
        let mirrored = |row: usize| if row == 0 { 1.0 } else { 2.0 };
        let sum: f64 = weights
            .iter()
            .enumerate()
            .map(|(row, row_weights)| mirrored(row) * row_weights.iter().sum::<f64>())
            .sum();
        let prefix_sums: Vec<Vec<u32>> = weights
            .iter()
            .map(|row| {
                let scaled = row.iter().map(|weight| (weight / sum * TOTAL).round() as u32);
                std::iter::once(0)
                    .chain(scaled.scan(0u32, |left, weight| {
                        *left += weight;
                        Some(*left)
                    }))
                    .collect()
            })
            .collect();
        let row_total = |row: &Vec<u32>| u64::from(row.last().copied().unwrap_or(0));
        let total = prefix_sums
            .iter()
            .enumerate()
            .map(|(row, sums)| if row == 0 { 1 } else { 2 } * row_total(sums))
            .sum();
        let is_uniform = config.profile == KernelProfile::Uniform;
        let uniform_weight = is_uniform.then(|| prefix_sums.first().map_or(0, |sums| u64::from(sums[1])));
        let prefix_sums = if is_uniform { Vec::new() } else { prefix_sums };
        Self { bandwidth, half_widths, prefix_sums, total, uniform_weight }
    }

    /// Cells on the border of the support.
    pub fn perimeter(&self) -> f64 {
        std::f64::consts::TAU * self.bandwidth
    }

    /// Weighted share of the support that was reached; row `center` holds the kernel's centre at bit `center`.
    #[inline(always)]
    pub fn density<const W: usize>(&self, rows: &[Row<W>], center: usize) -> f32 {
        let covered: u64 = (0..self.half_widths.len())
            .map(|dy| {
                let below = if dy > 0 { self.row_sum(&rows[center - dy].reached, dy, center) } else { 0 };
                self.row_sum(&rows[center + dy].reached, dy, center) + below
            })
            .sum();
        (covered as f64 / self.total as f64) as f32
    }

    #[inline(always)]
    fn row_sum<const W: usize>(&self, row: &BitRow<W>, dy: usize, center: usize) -> u64 {
        if let Some(weight) = self.uniform_weight {
            return u64::from(row.count()) * weight;
        }
        let (first, sums) = (center - self.half_widths[dy] as usize, &self.prefix_sums[dy]);
        let mut sum = 0;
        row.for_each_run(|start, end| sum += u64::from(sums[end - first] - sums[start - first]));
        sum
    }
}

/// Columns within d < h left and right of the centre, by row distance.
fn half_widths(bandwidth: f64) -> Vec<i32> {
    let is_inside = |dx: i32, dy: i32| f64::from(dx * dx + dy * dy) < bandwidth * bandwidth;
    let reach = bandwidth.ceil() as i32;
    (0..=reach).map_while(|dy| (0..=reach).take_while(|&dx| is_inside(dx, dy)).last()).collect()
}

fn weight(profile: KernelProfile, distance: f64, bandwidth: f64) -> f64 {
    match profile {
        KernelProfile::Uniform => 1.0,
        KernelProfile::Gaussian => (-0.5 * (distance / bandwidth).powi(2)).exp(),
        KernelProfile::Inverted => bandwidth * 1.871 - (bandwidth * bandwidth - distance * distance).sqrt(),
    }
}
