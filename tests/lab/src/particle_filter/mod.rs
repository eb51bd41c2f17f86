//! Monte-Carlo localisation with free-space densities: the thesis' own way (2.1.1 and 3.3), kept for its comparison.
//!
//! ```text
//!   GridMap ─► FieldMap: density fields, likelihood field           (once per map)
//!   odometry, measurement ─► ParticleFilter: predict ─► weigh ─► resample ─► hypotheses
//! ```
//!
//! A measurement is a [`SensorModel`]: free-space densities ([`DensityModel`], the thesis' own), a scan against the
//! likelihood field ([`LikelihoodFieldModel`], for tracking) or the thesis' two rivals ([`BeamModel`]). Every random
//! number comes from the filter's seed. What the server answers with is the session of [`locution_engine::locate`].

mod beam_models;
mod density_model;
mod field_map;
mod filter_trial;
mod hypotheses;
mod likelihood_model;
mod motion_model;
mod noise;
#[expect(clippy::module_inception, reason = "the filter is what the room is named after")]
mod particle_filter;
mod particles;
mod resampling;

#[cfg(test)]
mod tests;

pub use beam_models::{BeamComparison, BeamModel, BeamModelConfig};
pub use density_model::{DensityModel, DensityModelConfig};
pub use field_map::FieldMap;
pub use filter_trial::{FilterSenses, FilterSensor, FilterTrial, Sensed};
pub use hypotheses::ClusterConfig;
pub use likelihood_model::LikelihoodFieldModel;
pub use motion_model::OdometryMotionModel;
pub use particle_filter::{ParticleFilter, ParticleFilterConfig, RecoveryConfig, SensorModel};
pub use particles::Particles;
