//! Rooms, corridors and halls of a map's grid, and the doors between them.
//!
//! ```text
//! grid ─► floor without small obstacles ─► clearance ─► basins that grow until they meet at a saddle
//!                                             │            └─ narrower than the space on both sides: a door, else one basin
//!                                             └► thickness ─► mouths: narrow parts that leave a wide one ─► rooms and doors
//! ```
//! The clearance of a cell is its distance to the nearest obstacle; its thickness the radius of the largest free disc
//! that covers it, which is what a person would call half the width of the space there (MAORIS calls it the free-space
//! image). A crossing or a row of doors makes the clearance of a corridor rise and fall, so a saddle alone is no door;
//! the median thickness around it hardly notices.
//!
//! [`MapRooms`] does so for every component of a map and gives each room the id that it had in the map before.

mod basins;
mod config;
mod describe;
mod floor;
mod known;
mod mouths;
#[cfg(test)]
mod tests;
mod thickness;

use serde::{Deserialize, Serialize};

pub use config::RoomsConfig;
pub use known::{ComponentRooms, KnownDoor, KnownRoom, MapRooms, RoomsBefore};

use crate::geometry::{Point2, distance_to_blocked};
use crate::occupancy::GridMap;
use floor::Floor;

/// What a room is by its shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RoomKind {
    /// Neither long nor very wide.
    Room,
    /// Many times as long as it is wide.
    Corridor,
    /// Wide in both directions.
    Hall,
}

/// A part of the floor with one use, corridors and halls included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Room {
    /// What it is by its shape.
    pub kind: RoomKind,
    /// Free floor in it, small obstacles included, square metres.
    pub area_m2: f64,
    /// The position in it that is farthest from any wall.
    pub center: Point2,
    /// Its outer border, counter-clockwise, then those of what stands in it, clockwise; each closed implicitly, to within a
    /// cell, map frame.
    pub rings: Vec<Vec<Point2>>,
    /// Numbers of the rooms that an opening joins it to, ascending.
    pub neighbors: Vec<u32>,
}

/// An opening between two rooms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Door {
    /// Its middle, map frame.
    pub position: Point2,
    /// Diameter of the largest disc that passes through it, metres.
    pub width_m: f64,
    /// Numbers of the rooms it joins, ascending.
    pub rooms: (u32, u32),
}

/// The rooms of one grid.
#[derive(Clone, Debug, PartialEq)]
pub struct RoomMap {
    /// In the order of their first cells, row by row from the lower left; the position in this list is the number.
    pub rooms: Vec<Room>,
    /// In the order of the rooms they join.
    pub doors: Vec<Door>,
    width: usize,
    resolution_m: f64,
    origin: Point2,
    /// Number of each cell's room plus one; 0 in walls and in pockets too small to be a room.
    room_of_cell: Vec<u32>,
}

impl RoomMap {
    /// Number of the room that holds a point.
    pub fn room_at(&self, point: &Point2) -> Option<u32> {
        let along = |value: f64, from: f64| ((value - from) / self.resolution_m).floor();
        let (column, row) = (along(point.x, self.origin.x), along(point.y, self.origin.y));
        if !(0.0..self.width as f64).contains(&column) || row < 0.0 {
            return None;
        }
        self.room_of_cell.get(row as usize * self.width + column as usize)?.checked_sub(1)
    }
}

/// Divides the free floor of a grid into rooms. What is unknown is no floor.
///
/// O(n log n) for n cells, and for the thickness the area of the discs along the middle of the free space.
pub fn find_rooms(grid: &GridMap, config: &RoomsConfig) -> RoomMap {
    let floor = Floor::of_grid(grid, config.obstacle_size_m);
    let clearance = distance_to_blocked(floor.width, floor.height, &floor.is_free);
    let thickness = thickness::thickness(&floor, &clearance);
    let mut regions = basins::basins(&floor, &clearance, &thickness, config);
    floor::absorb_small(&floor, &mut regions, config.room_area_min_m2);
    mouths::split_at_mouths(&floor, &thickness, &mut regions, config);
    floor::absorb_small(&floor, &mut regions, config.room_area_min_m2);
    describe::describe(&floor, grid.origin(), &clearance, &thickness, &regions, config)
}
