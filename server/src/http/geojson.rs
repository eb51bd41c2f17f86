//! Shapes as GeoJSON writes them (RFC 7946), in metres under the frame of a component instead of degrees.

use locution_engine::geometry::Point2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::error::ApiError;
use crate::records::Shape;

/// Positions of one shape.
const NUM_POSITIONS_MAX: usize = 1000;
/// No coordinate is larger, metres.
const FARTHEST_M: f64 = 1e7;

/// A shape in metres.
// Other members are passed over, as GeoJSON wants it: programs add a `bbox` or more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "type", content = "coordinates")]
pub enum ShapeDto {
    /// A position.
    Point(PositionDto),
    /// A line through at least two positions.
    LineString(Vec<PositionDto>),
    /// An area: the outer border, counter-clockwise, then the holes, clockwise; the last position of each is its first.
    Polygon(Vec<Vec<PositionDto>>),
}

/// x and y, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(transparent)]
#[schema(value_type = Vec<f64>, min_items = 2, max_items = 2)]
pub struct PositionDto([f64; 2]);

fn xy(point: &Point2) -> PositionDto {
    PositionDto([point.x, point.y])
}

impl From<&Shape> for ShapeDto {
    fn from(shape: &Shape) -> Self {
        match shape {
            Shape::Point(point) => Self::Point(xy(point)),
            Shape::Line(points) => Self::LineString(points.iter().map(xy).collect()),
            Shape::Polygon(rings) => {
                let ring = |ring: &Vec<Point2>| ring.iter().map(xy).collect();
                Self::Polygon(rings.iter().map(ring).collect())
            }
        }
    }
}

impl ShapeDto {
    /// A polygon of rings that are closed implicitly.
    pub fn polygon(rings: &[Vec<Point2>]) -> Self {
        let ring = |ring: &Vec<Point2>| ring.iter().chain(ring.first()).map(xy).collect();
        Self::Polygon(rings.iter().map(ring).collect())
    }

    /// The shape, when it is one.
    ///
    /// # Errors
    /// 422 that names the coordinate.
    pub fn check(&self) -> Result<Shape, ApiError> {
        let shape = match self {
            Self::Point(coordinates) => Shape::Point(position("geometry.coordinates", coordinates)?),
            Self::LineString(coordinates) => Shape::Line(positions("geometry.coordinates", coordinates, 2)?),
            Self::Polygon(coordinates) => {
                if coordinates.is_empty() {
                    return Err(ApiError::invalid("geometry.coordinates", "a polygon has an outer border"));
                }
                let ring = |(idx, ring): (usize, &Vec<PositionDto>)| {
                    let field = format!("geometry.coordinates[{idx}]");
                    let points = positions(&field, ring, 4)?;
                    if points.first() != points.last() {
                        return Err(ApiError::invalid(field, "the last position of a ring is its first"));
                    }
                    Ok(points)
                };
                Shape::Polygon(coordinates.iter().enumerate().map(ring).collect::<Result<_, _>>()?)
            }
        };
        if shape.points().len() > NUM_POSITIONS_MAX {
            let detail = format!("a shape has at most {NUM_POSITIONS_MAX} positions");
            return Err(ApiError::invalid("geometry.coordinates", detail));
        }
        Ok(shape)
    }
}

fn positions(field: &str, given: &[PositionDto], num_min: usize) -> Result<Vec<Point2>, ApiError> {
    if given.len() < num_min {
        return Err(ApiError::invalid(field, format!("at least {num_min} positions are needed")));
    }
    given.iter().enumerate().map(|(idx, xy)| position(&format!("{field}[{idx}]"), xy)).collect()
}

fn position(field: &str, PositionDto([x, y]): &PositionDto) -> Result<Point2, ApiError> {
    for (idx, value) in [x, y].into_iter().enumerate() {
        if !value.is_finite() || value.abs() > FARTHEST_M {
            let detail = format!("{value} must be a number within ±{FARTHEST_M:e}");
            return Err(ApiError::invalid(format!("{field}[{idx}]"), detail));
        }
    }
    Ok(Point2::new(*x, *y))
}

/// What a feature of a map is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum FeatureKindDto {
    /// A room, corridor or hall.
    Room,
    /// A door between two rooms.
    Door,
    /// Something that a person drew.
    Annotation,
}

/// What is said of a feature; null is what does not apply to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeaturePropertiesDto {
    /// What it is.
    pub feature: FeatureKindDto,
    /// Component of the map in whose frame it is.
    pub component: u32,
    /// Id of the room or of the annotation.
    pub id: Option<String>,
    /// Of a room `room`, `corridor` or `hall`; of an annotation its kind.
    pub label: Option<String>,
    /// What people call it.
    pub name: Option<String>,
    /// Of a room, square metres.
    pub area_m2: Option<f64>,
    /// Of a door, metres.
    pub width_m: Option<f64>,
    /// Ids of the rooms beside a room, or joined by a door.
    pub rooms: Vec<u64>,
}

/// `Feature`, as GeoJSON calls it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub enum FeatureTypeDto {
    /// The only one.
    Feature,
}

/// A thing on the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureDto {
    /// `Feature`.
    #[serde(rename = "type")]
    pub kind: FeatureTypeDto,
    /// Where it is.
    pub geometry: ShapeDto,
    /// What it is.
    pub properties: FeaturePropertiesDto,
}

/// `FeatureCollection`, as GeoJSON calls it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub enum CollectionTypeDto {
    /// The only one.
    FeatureCollection,
}

/// The rooms, doors and annotations of a map as GeoJSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureCollectionDto {
    /// `FeatureCollection`.
    #[serde(rename = "type")]
    pub kind: CollectionTypeDto,
    /// Rooms, then doors, then annotations, component after component.
    pub features: Vec<FeatureDto>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(json: serde_json::Value) -> String {
        let geometry: ShapeDto = serde_json::from_value(json).unwrap();
        format!("{:?}", geometry.check().unwrap_err())
    }

    #[test]
    fn shapes_come_back_and_impossible_ones_name_the_coordinate() {
        let json = serde_json::json!({"type": "Polygon", "coordinates": [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]]});
        let geometry: ShapeDto = serde_json::from_value(json.clone()).unwrap();
        assert_eq!(serde_json::to_value(ShapeDto::from(&geometry.check().unwrap())).unwrap(), json);
        let line = serde_json::json!({"type": "LineString", "coordinates": [[0, 0], [1e9, 0]]});
        assert!(problem(line).contains("geometry.coordinates[1][0]"));
        let open = serde_json::json!({"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 2]]]});
        assert!(problem(open).contains("geometry.coordinates[0]"));
        let many = serde_json::json!({"type": "LineString", "coordinates": vec![[0, 0]; 1001]});
        assert!(problem(many).contains("1000"));
        let with_more = serde_json::json!({"type": "Point", "coordinates": [0, 0], "bbox": []});
        assert_eq!(
            serde_json::from_value::<ShapeDto>(with_more).unwrap(),
            ShapeDto::Point(PositionDto([0.0; 2]))
        );
    }
}
