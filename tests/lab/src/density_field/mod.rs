//! The precomputed density fields of a map (thesis section 3.3.1): for every free cell what a robot there would measure.

mod arc_planes;
mod bit_window;
mod connected_disc;
mod density_gradient;
mod field;
mod kernel_rows;
mod openings;

#[cfg(test)]
mod connected_disc_tests;

pub use density_gradient::GradientConfig;
pub use field::{DensityField, DensityFieldConfig, KernelReading, MAX_KERNELS, observe};
pub(crate) use field::{EMPTY, FULL, STABLE, UNDEFINED, direction_code};
