//! Kernels laid out for floods: the chords of the disc and running sums of the kernel along each (Eqs 2.14–2.16).

use super::bit_window::Row;
use locution_engine::density::KernelProfile;

/// Unnormalised height of a kernel at distance `d` for bandwidth `h`, in the same unit; d < h.
pub(super) fn height(profile: KernelProfile, d: f64, h: f64) -> f64 {
    match profile {
        KernelProfile::Uniform => 1.0,
        KernelProfile::Gaussian => (-0.5 * (d / h).powi(2)).exp(),
        KernelProfile::Inverted => h * 1.871 - (h * h - d * d).sqrt(),
    }
}

/// A kernel as rows of cells.
#[derive(Clone, Debug)]
pub(super) struct KernelRows {
    radius: usize,
    half_chords: Vec<Option<usize>>,
    /// Per row from −radius to radius: running sums of the normalised kernel over the columns from −radius on.
    running: Vec<Vec<f32>>,
    is_uniform: bool,
    cell_mass: f64,
}

impl KernelRows {
    /// The kernel of a bandwidth given in cells.
    pub fn new(profile: KernelProfile, bandwidth_cells: f64) -> Self {
        let radius = ((bandwidth_cells.ceil() as usize).max(1)) - 1;
        let half_chords: Vec<Option<usize>> = (0..=radius)
            .map(|dy| (0..=radius).rev().find(|&dx| (dx as f64).hypot(dy as f64) < bandwidth_cells))
            .collect();
        let height_at = |dx: i64, dy: i64| {
            let d = (dx as f64).hypot(dy as f64);
            if d < bandwidth_cells { height(profile, d, bandwidth_cells) } else { 0.0 }
        };
        let reach = radius as i64;
        let sum: f64 =
            (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| height_at(dx, dy))).sum();
        let running = (-reach..=reach)
            .map(|dy| {
                let mut total = 0.0;
                let sums = (-reach..=reach).map(|dx| {
                    total += height_at(dx, dy) / sum;
                    total as f32
                });
                std::iter::once(0.0).chain(sums).collect()
            })
            .collect();
        Self {
            radius,
            half_chords,
            running,
            is_uniform: profile == KernelProfile::Uniform,
            cell_mass: 1.0 / sum,
        }
    }

    /// Largest column distance that the disc reaches.
    pub const fn radius(&self) -> usize {
        self.radius
    }

    /// True when all cells weigh the same.
    pub const fn is_uniform(&self) -> bool {
        self.is_uniform
    }

    /// Half the chord `dy` rows from the centre; None outside the disc.
    pub fn half_chord(&self, dy: usize) -> Option<usize> {
        self.half_chords.get(dy).copied().flatten()
    }

    /// Kernel mass of that many cells when the kernel weighs all alike, else None.
    pub fn mass_of_count(&self, num_cells: u32) -> Option<f32> {
        self.is_uniform.then(|| (f64::from(num_cells) * self.cell_mass) as f32)
    }

    /// Kernel mass of the set cells of a disc's rows, whose first bit is the disc's leftmost column.
    pub fn mass<const W: usize>(&self, rows: impl Iterator<Item = Row<W>>) -> f32 {
        rows.zip(&self.running).map(|(row, running)| row_mass(&row, running)).sum()
    }
}

/// Sums the kernel over the runs of set bits of a row.
fn row_mass<const W: usize>(row: &Row<W>, running: &[f32]) -> f32 {
    let mut mass = 0.0;
    for (word_idx, &word) in row.iter().enumerate() {
        let mut rest = word;
        while rest != 0 {
            let first = rest.trailing_zeros() as usize;
            let length = (!(rest >> first)).trailing_zeros() as usize;
            let from = word_idx * 64 + first;
            mass += running[from + length] - running[from];
            rest &= if first + length >= 64 { 0 } else { u64::MAX << (first + length) };
        }
    }
    mass
}
