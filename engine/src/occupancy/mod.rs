//! Occupancy of a whole map: what is free, what is occupied, what nobody has seen.
//!
//! ```text
//!   scans at poses ─► TiledOccupancy: hits and passes of every cell, square by square
//!                          └─► GridMap: free, occupied or unknown, one rectangle ─► cast_ray, exports, sessions
//! ```
//! Everyone who draws, compares or searches a map reads it here. The rolling map around one robot is
//! [`grid`](crate::grid)'s.

mod grid_map;
mod ray_cast;
mod tiled;

pub use grid_map::{CellState, GridMap};
pub use ray_cast::cast_ray;
pub use tiled::{CellBounds, CellCounts, CellIndex, OccupancyConfig, TiledOccupancy};
