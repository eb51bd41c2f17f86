//! Places and routes on the wire.

use locution_engine::geometry::Point2;
use locution_engine::semantics::{Place, Route};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// A position, metres.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct PointDto {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
}

impl From<&Point2> for PointDto {
    fn from(point: &Point2) -> Self {
        Self { x: point.x, y: point.y }
    }
}

/// A place: driven ground of one label, voted over all passes.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct PlaceDto {
    /// Its number in the component.
    pub place: u32,
    /// `bifurcation`, `corner`, `corridor`, `dead-end` or `hall`.
    #[schema(example = "corridor")]
    pub label: String,
    /// Share of the votes that agree, from 0 to 1.
    pub confidence: f32,
    /// Mean of the positions observed in it.
    #[serde(rename = "centre")]
    pub center: PointDto,
    /// Metres of the longest pass through it.
    pub length_m: f64,
    /// Border of the ground that was driven, counter-clockwise.
    pub outline: Vec<PointDto>,
}

impl PlaceDto {
    /// A place with its number.
    pub fn new(place: u32, from: &Place) -> Self {
        Self {
            place,
            label: from.label.name().into(),
            confidence: from.confidence,
            center: (&from.center).into(),
            length_m: from.length_m,
            outline: from.outline.iter().map(PointDto::from).collect(),
        }
    }
}

/// From where to where.
#[derive(Clone, Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct RouteParams {
    /// Metres.
    pub from_x: f64,
    /// Metres.
    pub from_y: f64,
    /// Metres.
    pub to_x: f64,
    /// Metres.
    pub to_y: f64,
    /// Component of the map; the first unless said.
    #[serde(default)]
    pub component: u32,
    /// Version of the map; the serving one unless said.
    pub version: Option<u64>,
}

/// A way from one position to another.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RouteDto {
    /// Metres.
    pub length_m: f64,
    /// The way in one sentence.
    pub description: String,
    /// Places on the way: place, label, length_m, turn, text.
    #[schema(value_type = Vec<Object>)]
    pub steps: serde_json::Value,
    /// Positions on the way.
    pub points: Vec<PointDto>,
}

impl From<Route> for RouteDto {
    fn from(route: Route) -> Self {
        Self {
            length_m: route.length_m,
            steps: serde_json::to_value(&route.steps).unwrap_or_default(),
            points: route.points.iter().map(PointDto::from).collect(),
            description: route.description,
        }
    }
}
