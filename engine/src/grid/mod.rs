//! The rolling local map around the robot: a Histogramic In-Motion Map (thesis sections 2.1.2 and 3.2.1).
//!
//! [`LocalMap::integrate_scan`] reads like Algorithm 2.2: every cell in the sensor's field of view, not only those
//! on a beam, is compared with the reading of the nearest beam; cells around the reading become more occupied, cells
//! before it less. What lies farther than `radius_m` from the robot is forgotten. The room knows scans and poses,
//! nothing of densities.

mod bit_planes;
mod cell;
mod config;
mod disc;
mod field_of_view;
mod himm;
mod laser;
mod local_map;

pub use cell::Cell;
pub use config::{LocalMapConfig, in_cells};
pub use local_map::LocalMap;

/// Cells that can be asked for by rows; what the flood fill of the density reads.
pub trait OccupancyRows {
    /// Writes which of the cells from `start` to the right are free and which are neither free nor occupied: bit `i`
    /// of the row is the cell `i` columns right of `start`. Both slices have the same length; all bits are written.
    fn read_row(&self, start: Cell, free: &mut [u64], unknown: &mut [u64]);
}
