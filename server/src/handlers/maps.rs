//! The map in all its forms. The version is the ETag of each.

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use locution_engine::formats::write_pgm;

use super::encodings::{GridDto, gray_png, map_dto, yaml_of};
use crate::app::maps::{PictureForm, graph_as_g2o, gray_image, map_trajectories, topology};
use crate::app::{AppError, on_blocking_thread};
use crate::dto::maps::{MapDto, MapParams};
use crate::dto::texts::trajectory_as_tum;
use crate::error::{ApiError, Problem};
use crate::extract::{Params, SiteOf};
use crate::records::Map;
use crate::state::AppState;

/// A form of the map with its version as ETag; 304 when the client has it.
fn answer(map: &Map, headers: &HeaderMap, content_type: &'static str, body: Vec<u8>) -> Response {
    let tag = format!("\"{}\"", map.record.version);
    if headers.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response();
    }
    ([(header::ETAG, tag), (header::CONTENT_TYPE, content_type.into())], body).into_response()
}

/// Regions, connections, components and trajectories of the serving map, or of a version.
#[utoipa::path(get, path = "/v1/sites/{site}/map", operation_id = "get_map", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = MapDto), (status = 404, body = Problem), (status = 409, body = Problem)))]
pub async fn get_map(
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let runs = map.placed_runs(params.component).await?;
    let topology = topology(&map, &runs).await?;
    let versions = site.map_versions().await?;
    let body =
        serde_json::to_vec(&map_dto(&map.record, versions, &runs, topology)).map_err(AppError::internal)?;
    Ok(answer(&map, &headers, "application/json", body))
}

/// The occupancy grid of a component, with the fields of `nav_msgs/OccupancyGrid`.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid", operation_id = "get_grid", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = GridDto), (status = 404, body = Problem), (status = 409, body = Problem)))]
pub async fn get_grid(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
) -> Result<Json<GridDto>, ApiError> {
    let map = site.map(params.version).await?;
    let grid = state.app.grid(&site, &map, params.component.unwrap_or(0)).await?;
    Ok(Json(on_blocking_thread(move || GridDto::from(&*grid)).await?))
}

/// The same as PGM for `map_server`; its YAML is beside it.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid.pgm", operation_id = "get_grid_pgm", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = Vec<u8>, content_type = "image/x-portable-graymap"),
        (status = 404, body = Problem)))]
pub async fn get_grid_pgm(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let grid = state.app.grid(&site, &map, params.component.unwrap_or(0)).await?;
    let body = on_blocking_thread(move || write_pgm(&gray_image(&grid))).await?;
    Ok(answer(&map, &headers, "image/x-portable-graymap", body))
}

/// The same as PNG.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid.png", operation_id = "get_grid_png", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = Vec<u8>, content_type = "image/png"), (status = 404, body = Problem)))]
pub async fn get_grid_png(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let grid = state.app.grid(&site, &map, params.component.unwrap_or(0)).await?;
    let body = on_blocking_thread(move || gray_png(&gray_image(&grid))).await?.map_err(AppError::internal)?;
    Ok(answer(&map, &headers, "image/png", body))
}

/// What `map_server` wants to know of the PGM.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid.yaml", operation_id = "get_grid_yaml", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = String, content_type = "application/yaml"), (status = 404, body = Problem)))]
pub async fn get_grid_yaml(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let grid = state.app.grid(&site, &map, params.component.unwrap_or(0)).await?;
    Ok(answer(&map, &headers, "application/yaml", yaml_of(&grid).into_bytes()))
}

/// The pose graph in g2o's format.
#[utoipa::path(get, path = "/v1/sites/{site}/map/graph.g2o", operation_id = "get_graph_g2o", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = String, content_type = "text/plain"), (status = 404, body = Problem)))]
pub async fn get_graph_g2o(
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let body = graph_as_g2o(&map, params.component).await?;
    Ok(answer(&map, &headers, "text/plain; charset=utf-8", body.into_bytes()))
}

/// Poses of all scans of all runs in TUM's format.
#[utoipa::path(get, path = "/v1/sites/{site}/map/trajectory.tum", operation_id = "get_map_tum", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = String, content_type = "text/plain"), (status = 404, body = Problem)))]
pub async fn get_map_tum(
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let poses = map_trajectories(&site, &map, params.component).await?;
    Ok(answer(&map, &headers, "text/plain; charset=utf-8", trajectory_as_tum(&poses).into_bytes()))
}

/// A picture: walls, a colour per run, verified matches; components side by side.
#[utoipa::path(get, path = "/v1/sites/{site}/map/picture.png", operation_id = "get_picture_png", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = Vec<u8>, content_type = "image/png"), (status = 404, body = Problem)))]
pub async fn get_picture_png(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let body = state.app.picture(&site, &map, params.component, PictureForm::Png).await?;
    Ok(answer(&map, &headers, "image/png", body))
}

/// The same as SVG.
#[utoipa::path(get, path = "/v1/sites/{site}/map/picture.svg", operation_id = "get_picture_svg", tag = "maps",
    params(("site" = String, Path), MapParams),
    responses((status = 200, body = String, content_type = "image/svg+xml"), (status = 404, body = Problem)))]
pub async fn get_picture_svg(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<MapParams>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let body = state.app.picture(&site, &map, params.component, PictureForm::Svg).await?;
    Ok(answer(&map, &headers, "image/svg+xml", body))
}
