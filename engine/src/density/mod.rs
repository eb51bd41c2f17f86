//! Free-space density: how much of the surroundings is open (thesis sections 2.2, 3.2 and 6.3).
//!
//! From a cell, flood the free cells within a kernel's bandwidth; the density is the kernel's weight over what was
//! reached. The same flood tells whether unknown space was met (hard density) and through how many frontiers it
//! leaves the kernel. The room reads any grid that offers [`OccupancyRows`](crate::grid::OccupancyRows).

mod bit_row;
mod config;
mod estimate;
mod flood_fill;
mod kernel;

pub use config::{DensityConfig, KernelConfig, KernelProfile};
pub use estimate::{DensityEstimator, FreeSpaceDensity};
