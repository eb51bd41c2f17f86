//! Rooms, doors, and what people draw into a map.

use serde::{Deserialize, Serialize};

use super::values::Point;

/// A shape in metres, as GeoJSON writes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type")]
pub enum Shape {
    /// A position.
    Point {
        /// x and y.
        coordinates: [f64; 2],
    },
    /// A line through positions.
    LineString {
        /// x and y of each; at least two.
        coordinates: Vec<[f64; 2]>,
    },
    /// An area.
    Polygon {
        /// The outer border, counter-clockwise, then the holes, clockwise; the last position of each is its first.
        coordinates: Vec<Vec<[f64; 2]>>,
    },
}

/// What a room is by its shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RoomLabel {
    /// Neither long nor very wide.
    Room,
    /// Many times as long as it is wide.
    Corridor,
    /// Wide in both directions.
    Hall,
}

/// A door of a room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Door {
    /// Its middle.
    pub position: Point,
    /// Diameter of the largest disc that passes through it, metres.
    pub width_m: f64,
    /// Ids of the rooms that it joins.
    pub rooms: Vec<u64>,
}

/// A part of the floor with walls and doors around it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Room {
    /// Its id, the same in every version that holds the room.
    pub id: u64,
    /// What it is by its shape.
    pub label: RoomLabel,
    /// What people call it: the name of the annotation of kind `room` that lies in it.
    pub name: Option<String>,
    /// Component of the map in whose frame the positions are.
    pub component: u32,
    /// Free floor in it, square metres.
    pub area_m2: f64,
    /// The position in it that is farthest from any wall.
    #[serde(rename = "centre")]
    pub center: Point,
    /// Its floor, a polygon.
    pub geometry: Shape,
    /// Ids of the rooms that a door joins it to.
    #[serde(rename = "neighbours")]
    pub neighbors: Vec<u64>,
    /// Its doors.
    pub doors: Vec<Door>,
}

/// What to draw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NewAnnotation {
    /// What sort of thing it is, in words of your own; `room` names the room in which it lies.
    pub kind: String,
    /// What people call it.
    pub name: String,
    /// Component of the map in whose frame the geometry is.
    #[serde(default)]
    pub component: u32,
    /// Where it is, in metres; at most 1000 positions.
    pub geometry: Shape,
}

/// Something that a person drew, where it lies in a version of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Annotation {
    /// Its id, the same in every version.
    pub id: String,
    /// What sort of thing it is.
    pub kind: String,
    /// What people call it.
    pub name: String,
    /// Component of the map in whose frame the geometry is; null in a version without the runs that drove there.
    pub component: Option<u32>,
    /// Where it is, in metres; null in a version without the runs that drove there.
    pub geometry: Option<Shape>,
}
