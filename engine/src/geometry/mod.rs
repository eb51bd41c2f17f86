//! Poses, angles and cells of the plane: metres, radians, counter-clockwise, x forward.
//!
//! This room knows no other room. Transforms say both frames, target first: `map_from_robot`, so that
//! products chain (`map_from_odom.compose(&odom_from_robot)`).

mod angle;
mod distance_transform;
mod pose2;

pub use angle::{angle_between, wrap_angle};
pub use distance_transform::distance_to_blocked;
pub use pose2::{Point2, Pose2};
