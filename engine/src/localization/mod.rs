//! Localisation in a known map (thesis 2.1.1 and 3.3, SPEC section 6).
//!
//! ```text
//!   GridMap ─► ServedMap: density fields, likelihood field        (once per map version)
//!   odometry, measurement ─► ParticleFilter: predict ─► weigh ─► resample ─► hypotheses
//!   scans ─► Localizer: search ─► follow ─► judge ─► lost, ambiguous or converged
//! ```
//!
//! [`Localizer`] is a session as it is served; it searches the map for the robot's surroundings and judges every place
//! by all the scans of the last metres.
//!
//! A measurement is a [`SensorModel`]: free-space densities ([`DensityModel`], the thesis' own), a scan against the
//! likelihood field ([`LikelihoodFieldModel`], for tracking) or the thesis' two rivals ([`BeamModel`]). Every random
//! number comes from the filter's seed.

mod arc_planes;
mod beam_models;
mod bit_window;
mod config;
mod connected_disc;
mod density_field;
mod density_gradient;
mod density_model;
mod filter_trial;
mod global_search;
mod grid_map;
mod hypotheses;
mod kernel_rows;
mod likelihood_field;
mod likelihood_model;
mod localizer;
mod motion_model;
mod noise;
mod openings;
mod particle_filter;
mod particles;
mod raycast;
mod resampling;
mod served_map;
mod spread;
mod surroundings;
mod sweep;
mod track;
mod turns;

#[cfg(test)]
mod connected_disc_tests;
#[cfg(test)]
mod session_tests;
#[cfg(test)]
mod tests;

pub use beam_models::{BeamComparison, BeamModel, BeamModelConfig};
pub use config::LocalizationConfig;
pub use density_field::{DensityField, DensityFieldConfig, KernelReading, MAX_KERNELS, observe};
pub use density_gradient::GradientConfig;
pub use density_model::{DensityModel, DensityModelConfig};
pub use filter_trial::{FilterSenses, FilterSensor, FilterTrial, Sensed};
pub use global_search::{GlobalSearchConfig, ScoredPose, SearchPyramid};
pub use grid_map::{CellState, GridMap};
pub use hypotheses::{ClusterConfig, Hypothesis};
pub use likelihood_field::{LikelihoodField, LikelihoodFieldConfig};
pub use likelihood_model::LikelihoodFieldModel;
pub use localizer::{LocalizationEstimate, LocalizationState, Localizer, LocalizerConfig};
pub use motion_model::OdometryMotionModel;
pub use particle_filter::{ParticleFilter, ParticleFilterConfig, RecoveryConfig, SensorModel};
pub use particles::Particles;
pub use served_map::ServedMap;
