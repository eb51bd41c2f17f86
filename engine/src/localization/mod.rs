//! Monte-Carlo localisation in a served map (thesis 3.3).

mod bit_window;
mod connected_disc;
mod density_field;
mod density_gradient;
mod grid_map;
mod kernel_rows;

pub use density_field::{DensityField, DensityFieldConfig, KernelReading, MAX_KERNELS, observe};
pub use density_gradient::GradientConfig;
pub use grid_map::{CellState, GridMap};
pub use kernel_rows::KernelProfile;
