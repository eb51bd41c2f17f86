//! What a person drew into a map, tied to the keyframes around it.

use bytes::Bytes;
use locution_engine::geometry::Point2;
use locution_engine::semantics::Anchor;
use serde::{Deserialize, Serialize};

use super::codec;
use crate::storage::StorageError;

/// Where something is, as GeoJSON has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    Point(Point2),
    Line(Vec<Point2>),
    /// The outer border, then the holes; the last position of each ring is its first.
    Polygon(Vec<Vec<Point2>>),
}

impl Shape {
    /// All its positions.
    pub fn points(&self) -> Vec<Point2> {
        match self {
            Self::Point(point) => vec![*point],
            Self::Line(points) => points.clone(),
            Self::Polygon(rings) => rings.iter().flatten().copied().collect(),
        }
    }

    /// The same with every position moved; `None` when one of them cannot be.
    pub fn moved(&self, to: impl Fn(&Point2) -> Option<Point2>) -> Option<Self> {
        Some(match self {
            Self::Point(point) => Self::Point(to(point)?),
            Self::Line(points) => Self::Line(points.iter().map(to).collect::<Option<_>>()?),
            Self::Polygon(rings) => {
                let ring = |ring: &Vec<Point2>| ring.iter().map(&to).collect::<Option<_>>();
                Self::Polygon(rings.iter().map(ring).collect::<Option<_>>()?)
            }
        })
    }

    /// The mean of its positions; of a polygon's those of its outer border.
    pub fn middle(&self) -> Point2 {
        let points = match self {
            Self::Polygon(rings) => rings.first().cloned().unwrap_or_default(),
            _ => self.points(),
        };
        let share = 1.0 / points.len().max(1) as f64;
        let add = |sum: Point2, point: &Point2| Point2::new(sum.x + share * point.x, sum.y + share * point.y);
        points.iter().fold(Point2::default(), add)
    }
}

/// `Key::Annotation`: something that a person drew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Annotation {
    /// What sort of thing it is, in the words of whoever drew it; `room` names a room.
    pub kind: String,
    pub name: String,
    /// In the frame of the map in which it was drawn.
    pub shape: Shape,
    /// Keyframes of that map, with their poses in it: where they are in another map, there it is, too.
    pub anchors: Vec<Anchor>,
}

impl Annotation {
    /// The stored form.
    pub fn encode(&self) -> Bytes {
        codec::encode(self)
    }

    /// The annotation behind its stored form.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn decode(bytes: &[u8]) -> Result<Self, StorageError> {
        codec::decode(bytes, "an annotation")
    }
}
