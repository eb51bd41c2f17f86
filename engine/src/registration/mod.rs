//! Registration: where does this scan, or this neighbourhood, lie in that one (SPEC section 4)?
//!
//! [`OdometryRefiner`] matches scans against the recent dozen metres and hands out keyframes; odometry is one witness
//! among others to it. Everything rests on two parts: a correlative search that finds the right valley, and point-to-line
//! steps that find its bottom.

mod area;
mod branch_and_bound;
mod config;
mod correlative;
mod evidence_grid;
mod lost;
mod motion_prior;
mod odometry_record;
mod point_to_line;
mod points;
mod recent_scan;
mod refiner;
#[cfg(test)]
mod refiner_tests;
mod register;
mod scan_clock;
mod submap;
mod surface_map;
#[cfg(test)]
pub(crate) mod testing;

pub use area::{Area, AreaBuilder, AreaFit, AreaSearch};
pub use branch_and_bound::SearchWindow;
pub use config::{MotionLimits, OdometryNoise, RefinerConfig, SubmapConfig};
pub use lost::CutReason;
pub(crate) use refiner::rotated;
pub use refiner::{KeyframeMotion, OdometryRefiner, Refined};
pub(crate) use register::Opinions;
pub use register::{SubmapFit, refine_from, register};
pub(crate) use scan_clock::ScanClock;
pub use submap::{Submap, SubmapScan};
