//! Places of a map and the ways between them.

use axum::Json;
use locution_engine::geometry::Point2;

use crate::app::maps::{find_route, places};
use crate::dto::maps::MapParams;
use crate::dto::places::{PlaceDto, RouteDto, RouteParams};
use crate::error::{ApiError, Problem};
use crate::extract::{Params, SiteOf};

/// The places of a component, voted over all passes.
#[utoipa::path(get, path = "/v1/sites/{site}/places", operation_id = "list_places", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = Vec<PlaceDto>), (status = 404, body = Problem), (status = 409, body = Problem)))]
pub async fn list_places(
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
) -> Result<Json<Vec<PlaceDto>>, ApiError> {
    let map = site.map(params.version).await?;
    let places = places(&map, params.component.unwrap_or(0)).await?;
    Ok(Json((0..).zip(&places.places).map(|(number, place)| PlaceDto::new(number, place)).collect()))
}

/// The shortest way over driven ground, told place by place.
#[utoipa::path(get, path = "/v1/sites/{site}/route", operation_id = "get_route", tag = "maps",
    params(("site" = String, Path), RouteParams),
    responses((status = 200, body = RouteDto), (status = 404, body = Problem), (status = 409, body = Problem)))]
pub async fn get_route(
    SiteOf(site): SiteOf,
    Params(params): Params<RouteParams>,
) -> Result<Json<RouteDto>, ApiError> {
    let map = site.map(params.version).await?;
    let (from, to) = (Point2::new(params.from_x, params.from_y), Point2::new(params.to_x, params.to_y));
    Ok(Json(find_route(&map, params.component, from, to).await?.into()))
}
