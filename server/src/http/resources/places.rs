//! Places of a map and the ways between them.

use axum::Json;
use locution_engine::geometry::Point2;
use locution_engine::semantics::{Place, Route, RouteStep, Turn};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::labels::PlaceLabelDto;
use super::maps::MapParams;
use crate::app::maps::{find_route, places};
use crate::error::ApiError;
use crate::extract::{Paged, Params, SiteOf};
use crate::http::values::{Page, PageParams, PointDto};

/// A place: driven ground of one label, voted over all passes.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct PlaceDto {
    /// Its number in the component.
    pub place: u32,
    /// What kind of place it is.
    pub label: PlaceLabelDto,
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
            label: from.label.into(),
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
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// How a place is left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RouteTurnDto {
    /// Hardly any turn.
    Straight,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Where one came from.
    Back,
}

/// One place on a route.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RouteStepDto {
    /// Number of the place.
    pub place: u32,
    /// What kind of place it is.
    pub label: PlaceLabelDto,
    /// Way through it, metres.
    pub length_m: f64,
    /// How it is left.
    pub turn: RouteTurnDto,
    /// Id of the room in which it lies; null where no room is known.
    pub room: Option<u64>,
    /// Middle of the door through which the room is left at its end; null where it ends otherwise.
    pub door: Option<PointDto>,
    /// What a person would say.
    pub text: String,
}

impl From<RouteStep> for RouteStepDto {
    fn from(step: RouteStep) -> Self {
        let turn = match step.turn {
            Turn::Straight => RouteTurnDto::Straight,
            Turn::Left => RouteTurnDto::Left,
            Turn::Right => RouteTurnDto::Right,
            Turn::Back => RouteTurnDto::Back,
        };
        Self {
            place: step.place,
            label: step.label.into(),
            length_m: step.length_m,
            turn,
            room: step.room,
            door: step.door.as_ref().map(PointDto::from),
            text: step.text,
        }
    }
}

/// A way from one position to another.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RouteDto {
    /// Metres.
    pub length_m: f64,
    /// The way in one sentence.
    pub description: String,
    /// Places on the way.
    pub steps: Vec<RouteStepDto>,
    /// Positions on the way.
    pub points: Vec<PointDto>,
}

impl From<Route> for RouteDto {
    fn from(route: Route) -> Self {
        Self {
            length_m: route.length_m,
            steps: route.steps.into_iter().map(RouteStepDto::from).collect(),
            points: route.points.iter().map(PointDto::from).collect(),
            description: route.description,
        }
    }
}

/// The places of a component, voted over all passes.
#[utoipa::path(get, path = "/v1/sites/{site}/places", operation_id = "list_places", tag = "maps",
    params(MapParams, PageParams),
    responses((status = 200, description = "A page of places", body = Page<PlaceDto>),
        (status = 409, description = "No map has been built yet")))]
pub async fn list_places(
    SiteOf(site): SiteOf,
    Paged(params, page): Paged<MapParams>,
) -> Result<Json<Page<PlaceDto>>, ApiError> {
    let map = site.map(params.version).await?;
    let places = places(&map, params.component.unwrap_or(0)).await?;
    let items = (0..).zip(&places.places).map(|(number, place)| PlaceDto::new(number, place));
    Ok(Json(Page::of_all(items, places.places.len(), page)))
}

/// The shortest way over driven ground, told place by place and door by door.
#[utoipa::path(get, path = "/v1/sites/{site}/route", operation_id = "get_route", tag = "maps",
    params(RouteParams),
    responses((status = 200, description = "The route", body = RouteDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_route(
    SiteOf(site): SiteOf,
    Params(params): Params<RouteParams>,
) -> Result<Json<RouteDto>, ApiError> {
    let map = site.map(params.version).await?;
    let (from, to) = (Point2::new(params.from_x, params.from_y), Point2::new(params.to_x, params.to_y));
    Ok(Json(find_route(&map, params.component, from, to).await?.into()))
}
