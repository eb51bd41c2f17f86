//! Where along the drive something is noted: places to observe, and keyframes (thesis 4.2.1 and 6.2.1).
//!
//! Words count observations, so these must be spaced by travel, not by scans: a place between two scans has an
//! interpolated pose. Keyframes are whole scans.

mod config;
mod keyframe_sampler;
mod place_sampler;

pub use config::{OdometryNoise, SamplingConfig};
pub use keyframe_sampler::{KeyframePose, KeyframeSampler};
pub use place_sampler::{Place, PlaceSampler};
