//! A map with everything a particle filter reads of it, computed once.

use locution_engine::geometry::Point2;
use locution_engine::locate::{LikelihoodField, LikelihoodFieldConfig};
use locution_engine::occupancy::{CellState, GridMap};

use crate::density_field::{DensityField, DensityFieldConfig};

/// A map with its fields.
#[derive(Clone, Debug)]
pub struct FieldMap {
    /// The cells.
    pub grid: GridMap,
    /// Density fields of all kernels.
    pub density: DensityField,
    /// Likelihood of beam ends.
    pub likelihood: LikelihoodField,
    free_cells: Vec<u32>,
}

impl FieldMap {
    /// Computes all fields of a map.
    pub fn build(grid: GridMap, density: &DensityFieldConfig, likelihood: &LikelihoodFieldConfig) -> Self {
        let density = DensityField::build(&grid, density);
        let likelihood = LikelihoodField::build(&grid, likelihood);
        let free_cells = free_cells_by_neighborhood(&grid);
        Self { grid, density, likelihood, free_cells }
    }

    /// Indices of all free cells, neighbours in the plane close together in the list.
    pub fn free_cells(&self) -> &[u32] {
        &self.free_cells
    }

    /// Centre of a cell by its index.
    pub fn center_of(&self, cell: u32) -> Point2 {
        let (column, row) = (cell as usize % self.grid.width(), cell as usize / self.grid.width());
        self.grid.center_of(column as i64, row as i64)
    }
}

/// Free cells square by square: particles sown in this order touch memory in order.
fn free_cells_by_neighborhood(grid: &GridMap) -> Vec<u32> {
    const SIDE: usize = 8;
    let (width, height) = (grid.width(), grid.height());
    let mut cells = Vec::with_capacity(grid.num_free());
    for (bottom, left) in
        (0..height).step_by(SIDE).flat_map(|y| (0..width).step_by(SIDE).map(move |x| (y, x)))
    {
        for row in bottom..(bottom + SIDE).min(height) {
            for column in left..(left + SIDE).min(width) {
                let cell = row * width + column;
                if grid.cells()[cell] == CellState::Free {
                    cells.push(cell as u32);
                }
            }
        }
    }
    cells
}
