//! How a map becomes the bytes and words of its forms.

use locution_engine::formats::GrayImage;
use locution_engine::occupancy::{CellState, GridMap};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::app::maps::Topology;
use crate::dto::maps::{
    ConnectionDto, ConnectionKindDto, KeyframePoseDto, MapDto, MapRunDto, MapStatisticsDto, RegionDto,
    components_of,
};
use crate::records::{MapPose, MapRecord, PlacedRun};

/// An occupancy grid with the field names of `nav_msgs/OccupancyGrid`.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct GridDto {
    /// Where and how large.
    pub info: GridInfoDto,
    /// Row by row from the lower left: 0 free, 100 occupied, −1 unknown.
    pub data: Vec<i8>,
}

/// `nav_msgs/MapMetaData`.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct GridInfoDto {
    /// Metres per cell.
    pub resolution: f64,
    /// Cells.
    pub width: usize,
    /// Cells.
    pub height: usize,
    /// Pose of the lower left corner.
    pub origin: crate::dto::common::PoseDto,
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
            info: GridInfoDto {
                resolution: grid.resolution_m(),
                width: grid.width(),
                height: grid.height(),
                origin: crate::dto::common::PoseDto { x: origin.x, y: origin.y, theta: 0.0 },
            },
            data: grid.cells().iter().map(value).collect(),
        }
    }
}

/// The YAML of `map_server` for the PGM of the same grid.
pub fn yaml_of(grid: &GridMap) -> String {
    let origin = grid.origin();
    format!(
        "image: grid.pgm\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n\
         free_thresh: 0.196\n",
        grid.resolution_m(),
        origin.x,
        origin.y
    )
}

/// A grey picture as PNG.
///
/// # Errors
/// What the encoder says of a picture that it cannot write.
pub fn gray_png(image: &GrayImage) -> Result<Vec<u8>, png::EncodingError> {
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

/// A version on the wire.
pub fn map_dto(map: &MapRecord, versions: Vec<u64>, runs: &[PlacedRun], topology: Topology) -> MapDto {
    let name = |run: u32| map.runs.get(run as usize).map(|run| run.name.clone()).unwrap_or_default();
    let regions = topology.regions.iter().map(|region| RegionDto {
        component: region.component,
        run: name(region.run),
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
        num_scans: placed.map_run.num_scans,
        length_m: placed.map_run.length_m,
        poses: placed.poses.iter().map(pose).collect(),
    }
}
