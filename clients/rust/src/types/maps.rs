//! The map, its places and what changed in it.

use serde::{Deserialize, Serialize};

use super::values::{Point, Pose};

/// A map version.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Map {
    /// Its number.
    pub version: u64,
    /// Versions that can be asked for, oldest first.
    pub versions: Vec<u64>,
    /// Parts that nothing connects, each with a frame of its own.
    pub components: Vec<Component>,
    /// Runs with the poses of their keyframes.
    pub runs: Vec<MapRun>,
    /// Regions of equal density along the runs.
    pub regions: Vec<Region>,
    /// Which regions are beside which, by position in `regions`.
    pub connections: Vec<Connection>,
    /// Figures.
    pub statistics: MapStatistics,
}

/// A part of the map with a frame of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Component {
    /// Its number.
    pub component: u32,
    /// Runs in it.
    pub runs: Vec<String>,
}

/// A run in the map; one that was cut is several, piece after piece.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRun {
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
    pub poses: Vec<KeyframePose>,
}

/// The pose of a keyframe in the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyframePose {
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region {
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
    pub map_from_middle: Pose,
}

/// Two regions beside one another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Connection {
    /// Position in `regions`.
    pub from: usize,
    /// Position in `regions`.
    pub to: usize,
    /// `driven`: one follows the other; `same_place`: a verified match joins them.
    pub kind: ConnectionKind,
}

/// Why two regions are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ConnectionKind {
    /// The robot drove from one into the other.
    Driven,
    /// A verified match says that they are the same place.
    SamePlace,
}

/// Figures of a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapStatistics {
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

/// `nav_msgs/MapMetaData`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridInfo {
    /// 0: the server does not know when it is loaded.
    pub map_load_time: RosTime,
    /// Metres per cell.
    pub resolution: f64,
    /// Cells.
    pub width: usize,
    /// Cells.
    pub height: usize,
    /// Pose of the lower left corner.
    pub origin: RosPose,
}

/// `builtin_interfaces/Time`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RosTime {
    /// Seconds.
    pub sec: i32,
    /// And nanoseconds.
    pub nanosec: u32,
}

/// `geometry_msgs/Point`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RosPoint {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Metres.
    pub z: f64,
}

/// `geometry_msgs/Quaternion`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RosQuaternion {
    /// 0 in the plane.
    pub x: f64,
    /// 0 in the plane.
    pub y: f64,
    /// Sine of half the heading.
    pub z: f64,
    /// Cosine of half the heading.
    pub w: f64,
}

/// `geometry_msgs/Pose`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RosPose {
    /// Metres.
    pub position: RosPoint,
    /// A unit quaternion.
    pub orientation: RosQuaternion,
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GridHeader {
    /// 0, as of a map that holds at all times.
    pub stamp: RosTime,
    /// `map`.
    pub frame_id: String,
}

/// An occupancy grid, field by field a `nav_msgs/OccupancyGrid`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Whose it is.
    pub header: GridHeader,
    /// Where and how large.
    pub info: GridInfo,
    /// Row by row from the lower left: 0 free, 100 occupied, −1 unknown.
    pub data: Vec<i8>,
}

/// What kind of place it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlaceLabel {
    /// Three or more passages meet.
    Bifurcation,
    /// The passage turns and nothing else goes on.
    Corner,
    /// A passage between two parallel walls.
    Corridor,
    /// A room or a blind end: one way in.
    DeadEnd,
    /// A large open room.
    Hall,
}

impl PlaceLabel {
    /// Its name in the API.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Bifurcation => "bifurcation",
            Self::Corner => "corner",
            Self::Corridor => "corridor",
            Self::DeadEnd => "dead-end",
            Self::Hall => "hall",
        }
    }
}

/// A stretch of driving through places of one label.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// The run that drove it.
    pub run: String,
    /// Component of the map.
    pub component: u32,
    /// What kind of place it went through.
    pub label: PlaceLabel,
    /// First observation, inclusive.
    pub first: u64,
    /// Last observation, inclusive.
    pub last: u64,
    /// Timestamp of the first, nanoseconds.
    pub first_timestamp_ns: i64,
    /// Timestamp of the last, nanoseconds.
    pub last_timestamp_ns: i64,
    /// Metres along it.
    pub length_m: f64,
    /// Radians turned in it, left positive.
    pub turn_rad: f64,
    /// Share of what was seen that agrees with the label, from 0 to 1.
    pub confidence: f64,
    /// Its middle in the component's frame.
    pub map_from_middle: Pose,
}

/// Which way a place turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Turn {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

/// One part of a question.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelPattern {
    /// What kind of place to look for.
    pub label: PlaceLabel,
    /// Metres along it, at least.
    #[serde(default)]
    pub length_min_m: f64,
    /// Metres along it, at most.
    pub length_max_m: Option<f64>,
    /// Which way it turns; either unless said.
    pub turn: Option<Turn>,
}

/// A sequence of labels to look for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelQuery {
    /// In the order of driving.
    pub labels: Vec<LabelPattern>,
    /// Most places to answer; 20 unless said.
    pub limit: Option<usize>,
}

/// Where a question fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelAnswer {
    /// The site.
    pub site: String,
    /// The stretches, in the order of the question.
    pub places: Vec<Label>,
    /// Whether the run drove them the other way round.
    pub is_reversed: bool,
    /// The least sure of its labels.
    pub confidence: f64,
}

/// A place: driven ground of one label, voted over all passes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Its number in the component.
    pub place: u32,
    /// What kind of place it is.
    pub label: PlaceLabel,
    /// Share of the votes that agree, from 0 to 1.
    pub confidence: f32,
    /// Mean of the positions observed in it.
    #[serde(rename = "centre")]
    pub center: Point,
    /// Metres of the longest pass through it.
    pub length_m: f64,
    /// Border of the ground that was driven, counter-clockwise.
    pub outline: Vec<Point>,
}

/// How a place is left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RouteTurn {
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RouteStep {
    /// Number of the place.
    pub place: u32,
    /// What kind of place it is.
    pub label: PlaceLabel,
    /// Way through it, metres.
    pub length_m: f64,
    /// How it is left.
    pub turn: RouteTurn,
    /// Id of the room in which it lies; null where no room is known.
    pub room: Option<u64>,
    /// Middle of the door through which the room is left at its end; null where it ends otherwise.
    pub door: Option<Point>,
    /// What a person would say.
    pub text: String,
}

/// A way from one position to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// Metres.
    pub length_m: f64,
    /// The way in one sentence.
    pub description: String,
    /// Places on the way.
    pub steps: Vec<RouteStep>,
    /// Positions on the way.
    pub points: Vec<Point>,
}

/// What became of something that stood or stands there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChangeKind {
    /// It stands there now and did not.
    Appeared,
    /// It stood there and does not now.
    Disappeared,
}

/// A visit that saw a changed area.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangeVisit {
    /// The run.
    pub run: String,
    /// When the visit ended, if it saw the area as it was; when it began, if it saw it as it is.
    pub timestamp_ns: i64,
}

/// An area that changed: something came or went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Whether it came or went.
    pub kind: ChangeKind,
    /// Component of the map in whose frame the positions are.
    pub component: u32,
    /// Mean position of what changed.
    #[serde(rename = "centre")]
    pub center: Point,
    /// Lower left corner of the rectangle around it.
    pub low: Point,
    /// Upper right corner.
    pub high: Point,
    /// Surface that changed, square metres.
    pub area_m2: f64,
    /// Free-space density observed around it in the second session, minus the first; null where one did not pass.
    pub density_change: Option<f64>,
    /// How clearly the scans and densities of both sessions tell, from 0 to 1.
    pub confidence: f64,
    /// The last visit that saw it as it was; null when no single one saw enough of it.
    pub last_as_before: Option<ChangeVisit>,
    /// The first visit that saw it as it is; what happened, happened between the two.
    pub first_as_after: Option<ChangeVisit>,
}
