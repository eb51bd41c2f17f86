//! Registration: where does this scan, or this neighbourhood, lie in that one (SPEC section 4)?
//!
//! [`OdometryRefiner`] matches scans against the recent dozen metres and hands out keyframes. Everything rests on
//! two parts: a correlative search that finds the right valley, and point-to-line steps that find its bottom.

mod config;
mod correlative;
mod point_to_line;
mod points;
mod refiner;
mod surface_map;
#[cfg(test)]
pub(crate) mod testing;

pub use config::{OdometryNoise, RefinerConfig, RegistrationConfig};
pub use refiner::{KeyframeMotion, OdometryRefiner, Refined};
