//! The map in the formats of other tools. A form is made only for a client that does not have it yet.

use std::sync::Arc;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use locution_engine::formats::{GrayImage, write_pgm};
use locution_engine::occupancy::{CellState, GridMap};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::maps::{PictureForm, graph_as_g2o, gray_image, map_as_mcap, ways_of_runs};
use crate::app::site::Site;
use crate::app::{AppError, Area, on_blocking_thread};
use crate::error::ApiError;
use crate::extract::{Params, SiteOf};
use crate::http::resources::maps::MapParams;
use crate::http::resources::texts::trajectory_as_tum;
use crate::http::values::window;
use crate::records::Map;
use crate::state::AppState;

/// The map that a request means, and what the client already has of it.
pub struct MapAt {
    state: AppState,
    pub(super) site: Arc<Site>,
    pub(super) map: Map,
    pub(super) component: Option<u32>,
    headers: HeaderMap,
}

impl FromRequestParts<AppState> for MapAt {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let Params(params) = Params::<MapParams>::from_request_parts(parts, state).await?;
        Self::of(parts, state, params.version, params.component).await
    }
}

/// Which grid.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct GridParams {
    /// The version; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
    /// The component; the first unless said.
    pub component: Option<u32>,
    /// Only the cells that this rectangle touches: `x,y,x,y` of two opposite corners, metres, in the map.
    #[param(pattern = "^-?[0-9.eE+-]+(,-?[0-9.eE+-]+){3}$", max_length = 200, example = "0,0,12.5,8")]
    pub area: Option<String>,
}

/// The grid that a request means, or a window of it.
pub struct GridAt {
    at: MapAt,
    area: Option<Area>,
}

impl FromRequestParts<AppState> for GridAt {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let Params(params) = Params::<GridParams>::from_request_parts(parts, state).await?;
        let area = window(None, None, params.area.as_deref())?.area;
        Ok(Self { at: MapAt::of(parts, state, params.version, params.component).await?, area })
    }
}

impl GridAt {
    /// The occupancy grid of the component, the first unless said.
    async fn grid(&self) -> Result<Arc<GridMap>, ApiError> {
        let MapAt { state, site, map, component, .. } = &self.at;
        let grid = state.app.grid(site, map, component.unwrap_or(0)).await?;
        let Some(area) = self.area else { return Ok(grid) };
        let beside = || ApiError::invalid("area", "no cell of the map lies there");
        let window = on_blocking_thread(move || grid.window(&area.low, &area.high)).await?;
        window.map(Arc::new).ok_or_else(beside)
    }
}

impl MapAt {
    async fn of(
        parts: &mut Parts,
        state: &AppState,
        version: Option<u64>,
        component: Option<u32>,
    ) -> Result<Self, ApiError> {
        let SiteOf(site) = SiteOf::from_request_parts(parts, state).await?;
        let map = site.map(version).await?;
        Ok(Self { state: state.clone(), site, map, component, headers: parts.headers.clone() })
    }

    async fn picture(&self, form: PictureForm) -> Result<Vec<u8>, ApiError> {
        Ok(self.state.app.picture(&self.site, &self.map, self.component, form).await?)
    }

    /// The version's ETag. A site that was deleted and made again counts its versions anew, so the site's birth is in it.
    /// What is drawn of a version is less after a run was deleted.
    fn tag(&self) -> String {
        let record = &self.site.state().record;
        format!("\"{}-{:x}-{}\"", self.map.record.version, record.birth, record.num_deleted_runs)
    }

    /// The name of a file that holds a form of the map: one frame a file, so it names the component that was asked for.
    fn file_name(&self, stem: &str, extension: &str) -> String {
        match self.component {
            Some(component) => format!("{stem}-{component}.{extension}"),
            None => format!("{stem}.{extension}"),
        }
    }

    /// A form of the map with its ETag and the name of its file; 304, and nothing is made, when the client has it.
    pub(super) async fn answer(
        &self,
        content_type: &'static str,
        (stem, extension): (&str, &str),
        body: impl Future<Output = Result<Vec<u8>, ApiError>>,
    ) -> Result<Response, ApiError> {
        let mut response = self.answer_as(self.tag(), content_type, body).await?;
        let disposition = format!("inline; filename=\"{}\"", self.file_name(stem, extension));
        if let Ok(disposition) = HeaderValue::from_str(&disposition) {
            response.headers_mut().insert(header::CONTENT_DISPOSITION, disposition);
        }
        Ok(response)
    }

    /// The tag of a form that also shows what changes without a new version, by a number that counts those changes.
    pub(super) fn tag_with(&self, num_changes: u64) -> String {
        format!("{}-{num_changes}\"", self.tag().trim_end_matches('"'))
    }

    /// A form of the map with a tag of its own.
    pub(super) async fn answer_as(
        &self,
        tag: String,
        content_type: &'static str,
        body: impl Future<Output = Result<Vec<u8>, ApiError>>,
    ) -> Result<Response, ApiError> {
        if is_known(&self.headers, &tag) {
            return Ok((StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response());
        }
        let headers = [(header::ETAG, tag), (header::CONTENT_TYPE, content_type.to_owned())];
        Ok((headers, body.await?).into_response())
    }
}

/// Whether a client says that it has what a tag names; weak tags and lists of them count.
pub(super) fn is_known(headers: &HeaderMap, tag: &str) -> bool {
    let known = headers.get_all(header::IF_NONE_MATCH).into_iter().filter_map(|value| value.to_str().ok());
    known
        .flat_map(|list| list.split(','))
        .map(str::trim)
        .any(|known| known == "*" || known.strip_prefix("W/").unwrap_or(known) == tag)
}

/// An occupancy grid, field by field a message of `nav_msgs/OccupancyGrid`.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct GridDto {
    /// Whose it is.
    pub header: GridHeaderDto,
    /// Where and how large.
    pub info: GridInfoDto,
    /// Row by row from the lower left: 0 free, 100 occupied, −1 unknown.
    pub data: Vec<i8>,
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct GridHeaderDto {
    /// 0, as of a map that holds at all times.
    pub stamp: RosTimeDto,
    /// `map`.
    pub frame_id: String,
}

/// `builtin_interfaces/Time`.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, ToSchema)]
pub struct RosTimeDto {
    /// Seconds.
    pub sec: i32,
    /// And nanoseconds.
    pub nanosec: u32,
}

/// `nav_msgs/MapMetaData`.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct GridInfoDto {
    /// 0: the server does not know when it is loaded.
    pub map_load_time: RosTimeDto,
    /// Metres per cell.
    pub resolution: f64,
    /// Cells.
    pub width: usize,
    /// Cells.
    pub height: usize,
    /// Pose of the lower left corner.
    pub origin: RosPoseDto,
}

/// `geometry_msgs/Pose`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct RosPoseDto {
    /// Metres.
    pub position: RosPointDto,
    /// A unit quaternion.
    pub orientation: RosQuaternionDto,
}

/// `geometry_msgs/Point`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct RosPointDto {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Metres; 0.
    pub z: f64,
}

/// `geometry_msgs/Quaternion`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct RosQuaternionDto {
    /// 0.
    pub x: f64,
    /// 0.
    pub y: f64,
    /// Sine of half the heading.
    pub z: f64,
    /// Cosine of half the heading.
    pub w: f64,
}

impl From<&GridMap> for GridDto {
    fn from(grid: &GridMap) -> Self {
        let value = |cell: &CellState| match cell {
            CellState::Free => 0,
            CellState::Occupied => 100,
            CellState::Unknown => -1,
        };
        let origin = grid.origin();
        Self {
            header: GridHeaderDto { stamp: RosTimeDto::default(), frame_id: "map".to_owned() },
            info: GridInfoDto {
                map_load_time: RosTimeDto::default(),
                resolution: grid.resolution_m(),
                width: grid.width(),
                height: grid.height(),
                origin: RosPoseDto {
                    position: RosPointDto { x: origin.x, y: origin.y, z: 0.0 },
                    orientation: RosQuaternionDto { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
                },
            },
            data: grid.cells().iter().map(value).collect(),
        }
    }
}

/// The YAML of `map_server` for the PGM of the same grid, which is a file of this name beside it.
fn yaml_of(grid: &GridMap, image: &str) -> String {
    let origin = grid.origin();
    format!(
        "image: {image}\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n\
         free_thresh: 0.196\n",
        grid.resolution_m(),
        origin.x,
        origin.y
    )
}

/// A grey picture as PNG.
fn gray_png(image: &GrayImage) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// The occupancy grid of a component, the first unless said, field by field a `nav_msgs/OccupancyGrid`.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid", operation_id = "get_grid", tag = "maps", params(GridParams),
    responses((status = 200, description = "The grid", body = GridDto),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_grid(grid_at: GridAt) -> Result<Response, ApiError> {
    let body = async {
        let grid = grid_at.grid().await?;
        let json = on_blocking_thread(move || serde_json::to_vec(&GridDto::from(&*grid))).await?;
        Ok(json.map_err(AppError::internal)?)
    };
    grid_at.at.answer("application/json", ("grid", "json"), body).await
}

/// The same as PGM for `map_server`; its YAML is beside it.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid.pgm", operation_id = "get_grid_pgm", tag = "maps",
    params(GridParams),
    responses((status = 200, description = "The grid", content_type = "image/x-portable-graymap"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_grid_pgm(grid_at: GridAt) -> Result<Response, ApiError> {
    let body = async {
        let grid = grid_at.grid().await?;
        Ok(on_blocking_thread(move || write_pgm(&gray_image(&grid))).await?)
    };
    grid_at.at.answer("image/x-portable-graymap", ("grid", "pgm"), body).await
}

/// The same as PNG.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid.png", operation_id = "get_grid_png", tag = "maps",
    params(GridParams),
    responses((status = 200, description = "The grid", content_type = "image/png"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_grid_png(grid_at: GridAt) -> Result<Response, ApiError> {
    let body = async {
        let grid = grid_at.grid().await?;
        let png = on_blocking_thread(move || gray_png(&gray_image(&grid))).await?;
        Ok(png.map_err(AppError::internal)?)
    };
    grid_at.at.answer("image/png", ("grid", "png"), body).await
}

/// What `map_server` wants to know of the PGM.
#[utoipa::path(get, path = "/v1/sites/{site}/map/grid.yaml", operation_id = "get_grid_yaml", tag = "maps",
    params(GridParams),
    responses((status = 200, description = "The grid's YAML", body = String, content_type = "application/yaml"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_grid_yaml(grid_at: GridAt) -> Result<Response, ApiError> {
    let image = grid_at.at.file_name("grid", "pgm");
    let body = async { Ok(yaml_of(&*grid_at.grid().await?, &image).into_bytes()) };
    grid_at.at.answer("application/yaml", ("grid", "yaml"), body).await
}

/// The pose graph of a component, the first unless said, in g2o's format.
#[utoipa::path(get, path = "/v1/sites/{site}/map/graph.g2o", operation_id = "get_graph_g2o", tag = "maps",
    params(MapParams),
    responses((status = 200, description = "The graph", body = String, content_type = "text/plain"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_graph_g2o(at: MapAt) -> Result<Response, ApiError> {
    let body = async { Ok(graph_as_g2o(&at.map, at.component.unwrap_or(0)).await?.into_bytes()) };
    at.answer("text/plain; charset=utf-8", ("graph", "g2o"), body).await
}

/// Poses of all scans of all runs of a component, the first unless said, in TUM's format.
#[utoipa::path(get, path = "/v1/sites/{site}/map/trajectory.tum", operation_id = "get_map_tum", tag = "maps",
    params(MapParams),
    responses((status = 200, description = "A pose a line", body = String, content_type = "text/plain"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_map_tum(at: MapAt) -> Result<Response, ApiError> {
    let body = async {
        let ways = ways_of_runs(&at.map, at.component.unwrap_or(0)).await?;
        let poses: Vec<_> = ways.into_iter().flat_map(|(_, poses)| poses).collect();
        Ok(trajectory_as_tum(&poses).into_bytes())
    };
    at.answer("text/plain; charset=utf-8", ("trajectory", "tum"), body).await
}

/// A component of the map, the first unless said, as MCAP for Foxglove: `foxglove.Grid` on `/map`, and of every run
/// `foxglove.PosesInFrame` on `/runs/RUN/path` and `foxglove.PoseInFrame` on `/runs/RUN/pose`.
#[utoipa::path(get, path = "/v1/sites/{site}/map/map.mcap", operation_id = "get_map_mcap", tag = "maps",
    params(GridParams),
    responses((status = 200, description = "The file", content_type = "application/octet-stream"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_map_mcap(grid_at: GridAt) -> Result<Response, ApiError> {
    let at = &grid_at.at;
    let body = async {
        let grid = grid_at.grid().await?;
        let ways = ways_of_runs(&at.map, at.component.unwrap_or(0)).await?;
        let file = on_blocking_thread(move || map_as_mcap(&grid, &ways)).await?;
        Ok(file.map_err(AppError::internal)?)
    };
    at.answer("application/octet-stream", ("map", "mcap"), body).await
}

/// A picture: walls, a colour per run, verified matches; components side by side.
#[utoipa::path(get, path = "/v1/sites/{site}/map/picture.png", operation_id = "get_picture_png", tag = "maps",
    params(MapParams),
    responses((status = 200, description = "The picture", content_type = "image/png"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_picture_png(at: MapAt) -> Result<Response, ApiError> {
    at.answer("image/png", ("picture", "png"), at.picture(PictureForm::Png)).await
}

/// The same as SVG.
#[utoipa::path(get, path = "/v1/sites/{site}/map/picture.svg", operation_id = "get_picture_svg", tag = "maps",
    params(MapParams),
    responses((status = 200, description = "The picture", body = String, content_type = "image/svg+xml"),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_picture_svg(at: MapAt) -> Result<Response, ApiError> {
    at.answer("image/svg+xml", ("picture", "svg"), at.picture(PictureForm::Svg)).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weak_and_listed_tags_are_known() {
        let known = |value: &'static str| {
            let headers = [(header::IF_NONE_MATCH, axum::http::HeaderValue::from_static(value))];
            is_known(&HeaderMap::from_iter(headers), "\"2-ab\"")
        };
        assert!(known("\"2-ab\"") && known("\"1\", W/\"2-ab\"") && known("*"));
        assert!(!known("\"2\"") && !known("2-ab"));
    }
}
