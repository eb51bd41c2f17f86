//! The map as a graph of regions, with the trajectories of its runs.

use axum::response::Response;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::AppError;
use crate::app::maps::{Topology, topology};
use crate::error::ApiError;
use crate::http::forms::MapAt;
use crate::http::values::PoseDto;
use crate::records::{MapPose, MapRecord, MapRun, PlacedRun};

/// Which map.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct MapParams {
    /// The version; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
    /// The component; for grids the first unless said, elsewhere all.
    pub component: Option<u32>,
}

/// Which version of the map.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct VersionParams {
    /// The version; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// A map version.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MapDto {
    /// Its number.
    pub version: u64,
    /// Versions that can be asked for, oldest first.
    pub versions: Vec<u64>,
    /// Parts that nothing connects, each with a frame of its own.
    pub components: Vec<ComponentDto>,
    /// Runs with the poses of their keyframes.
    pub runs: Vec<MapRunDto>,
    /// Regions of equal density along the runs.
    pub regions: Vec<RegionDto>,
    /// Which regions are beside which, by position in `regions`.
    pub connections: Vec<ConnectionDto>,
    /// Figures.
    pub statistics: MapStatisticsDto,
}

/// A part of the map with a frame of its own.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ComponentDto {
    /// Its number.
    pub component: u32,
    /// Runs in it.
    pub runs: Vec<String>,
}

/// A run in the map; one that was cut is several, piece after piece.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MapRunDto {
    /// Its name.
    pub run: String,
    /// The component whose frame the poses are in.
    pub component: u32,
    /// Sequence number of its first scan: 0 but for later pieces of a run that was cut.
    #[serde(default)]
    pub first_scan: u64,
    /// Scans it had when the map was built.
    pub num_scans: u64,
    /// Metres driven.
    pub length_m: f64,
    /// Poses of its keyframes.
    pub poses: Vec<KeyframePoseDto>,
}

/// The pose of a keyframe in the map.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct KeyframePoseDto {
    /// Sequence number of its scan.
    pub scan_seq: u64,
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub theta: f64,
}

/// A stretch of driving with one density class: a word, placed in the map.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RegionDto {
    /// Component.
    pub component: u32,
    /// The run that drove it.
    pub run: String,
    /// Number of the word of level 0.
    pub word: u32,
    /// Density class.
    pub class: u8,
    /// Metres along it.
    pub length_m: f64,
    /// Radians turned in it.
    pub turn_rad: f64,
    /// Its middle, in the component's frame.
    pub map_from_middle: PoseDto,
}

/// Two regions beside one another.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct ConnectionDto {
    /// Position in `regions`.
    pub from: usize,
    /// Position in `regions`.
    pub to: usize,
    /// `driven`: one follows the other; `same_place`: a verified match joins them.
    #[schema(example = "driven")]
    pub kind: ConnectionKindDto,
}

/// Why two regions are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConnectionKindDto {
    /// The robot drove from one into the other.
    Driven,
    /// A verified match says that they are the same place.
    SamePlace,
}

/// Figures of a map.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MapStatisticsDto {
    /// Matches, whatever became of them.
    pub num_matches: u64,
    /// Matches that hold the map together.
    pub num_verified: u64,
    /// Keyframes.
    pub num_keyframes: u64,
    /// Metres driven by all runs.
    pub length_m: f64,
    /// Seconds that building took.
    pub duration_s: f64,
}

impl MapStatisticsDto {
    /// Sums over the runs.
    pub fn of(map: &MapRecord) -> Self {
        Self {
            num_matches: map.num_matches,
            num_verified: map.num_verified,
            num_keyframes: map.runs.iter().map(|run| run.num_poses).sum(),
            length_m: map.runs.iter().map(|run| run.length_m).sum(),
            duration_s: map.duration_s,
        }
    }
}

/// Components with the names of their runs.
pub fn components_of(map: &MapRecord) -> Vec<ComponentDto> {
    let runs_of = |component: u32| {
        let is_in = move |run: &&MapRun| run.component == component && run.num_poses > 0;
        let mut names: Vec<String> = map.runs.iter().filter(is_in).map(|run| run.name.clone()).collect();
        // Pieces of a run stand side by side.
        names.dedup();
        names
    };
    (0..map.num_components)
        .map(|component| ComponentDto { component, runs: runs_of(component) })
        .filter(|component| !component.runs.is_empty())
        .collect()
}

/// A version on the wire.
pub fn map_dto(map: &MapRecord, versions: Vec<u64>, runs: &[PlacedRun], topology: Topology) -> MapDto {
    let regions = topology.regions.iter().map(|region| RegionDto {
        component: region.component,
        run: map.name_of(region.run),
        word: region.word,
        class: region.class,
        length_m: region.length_m,
        turn_rad: region.turn_rad,
        map_from_middle: region.map_from_middle.into(),
    });
    let connection =
        |kind: ConnectionKindDto| move |(from, to): (usize, usize)| ConnectionDto { from, to, kind };
    let driven = topology.driven.into_iter().map(connection(ConnectionKindDto::Driven));
    let same_place = topology.same_place.into_iter().map(connection(ConnectionKindDto::SamePlace));
    MapDto {
        version: map.version,
        versions,
        components: components_of(map),
        runs: runs.iter().map(run_dto).collect(),
        regions: regions.collect(),
        connections: driven.chain(same_place).collect(),
        statistics: MapStatisticsDto::of(map),
    }
}

fn run_dto(placed: &PlacedRun) -> MapRunDto {
    let pose = |pose: &MapPose| {
        let at = pose.map_from_robot;
        KeyframePoseDto { scan_seq: pose.scan_seq, x: at.x, y: at.y, theta: at.theta }
    };
    MapRunDto {
        run: placed.map_run.name.clone(),
        component: placed.map_run.component,
        first_scan: placed.map_run.first_scan,
        num_scans: placed.map_run.num_scans,
        length_m: placed.map_run.length_m,
        poses: placed.poses.iter().map(pose).collect(),
    }
}

/// Regions, connections, components and trajectories of the serving map, or of a version.
#[utoipa::path(get, path = "/v1/sites/{site}/map", operation_id = "get_map", tag = "maps", params(MapParams),
    responses((status = 200, description = "The map", body = MapDto),
        (status = 304, description = "The client has this version"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_map(at: MapAt) -> Result<Response, ApiError> {
    let body = async {
        let runs = at.map.placed_runs(at.component).await?;
        let topology = topology(&at.map, &runs).await?;
        let versions = at.site.map_versions().await?;
        Ok(serde_json::to_vec(&map_dto(&at.map.record, versions, &runs, topology))
            .map_err(AppError::internal)?)
    };
    at.answer("application/json", ("map", "json"), body).await
}
