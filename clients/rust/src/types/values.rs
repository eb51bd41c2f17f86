//! Values of several bodies.

use serde::{Deserialize, Serialize};

/// A pose in the plane, equally a rigid transform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Heading in radians, counter-clockwise.
    pub theta: f64,
}

/// A position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
}

/// Which way a place was driven, compared with another pass through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// The same way.
    Same,
    /// The other way round.
    Opposite,
}

impl Direction {
    /// Its name in the API.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Opposite => "opposite",
        }
    }
}
