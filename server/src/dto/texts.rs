//! Observations, words and trajectories on the wire.

use std::fmt::Write;

use locution_engine::formats::write_tum;
use locution_engine::text::{Observation, Word, WordId};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::common::PoseDto;
use crate::app::runs::{Frame, StampedPose, Trajectory};

/// A density sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ObservationDto {
    /// Its number in the run.
    pub observation: u64,
    /// Sequence number of the scan taken at this place.
    pub scan_seq: u64,
    /// Timestamp of that scan, nanoseconds.
    pub timestamp_ns: i64,
    /// Distance driven since the run began, metres.
    pub travel_m: f64,
    /// Raw odometry.
    pub odom_from_robot: PoseDto,
    /// Pose in the run's frame.
    pub run_from_robot: PoseDto,
    /// Density of each kernel, in [0, 1].
    pub densities: Vec<f32>,
    /// Whether no opening of unknown cells was met.
    pub is_hard: bool,
    /// Groups of free cells on the border of the kernel.
    pub num_frontiers: u8,
}

impl ObservationDto {
    /// An observation with its number.
    pub fn new(observation: u64, from: Observation) -> Self {
        Self {
            observation,
            scan_seq: from.scan_seq,
            timestamp_ns: from.timestamp_ns,
            travel_m: from.travel_m,
            odom_from_robot: from.odom_from_robot.into(),
            run_from_robot: from.run_from_robot.into(),
            densities: from.densities,
            is_hard: from.is_hard,
            num_frontiers: from.num_frontiers,
        }
    }
}

/// Names a word of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WordIdDto {
    /// 0: as observed; above: alternatives that fuse several words.
    pub level: u8,
    /// Position in its level.
    pub index: u32,
}

impl From<WordId> for WordIdDto {
    fn from(id: WordId) -> Self {
        Self { level: id.level, index: id.index }
    }
}

/// A word ⟨d, s, a⟩.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WordDto {
    /// Its name.
    pub id: WordIdDto,
    /// d: density class.
    pub class: u8,
    /// s: number of observations.
    pub size: u32,
    /// a: turn, radians.
    pub turn_rad: f32,
    /// First and last observation, both inclusive.
    pub observations: [u32; 2],
    /// Words that may stand before it.
    pub predecessors: Vec<WordIdDto>,
}

impl From<Word> for WordDto {
    fn from(word: Word) -> Self {
        Self {
            id: word.id.into(),
            class: word.class,
            size: word.size,
            turn_rad: word.turn_rad,
            observations: [word.observations.0, word.observations.1],
            predecessors: word.predecessors.into_iter().map(WordIdDto::from).collect(),
        }
    }
}

/// One word a line: class, size in observations, turn in radians.
pub fn words_as_text(words: &[Word]) -> String {
    let mut text = String::new();
    for word in words {
        let _ = writeln!(text, "{} {} {}", word.class, word.size, word.turn_rad);
    }
    text
}

/// Which words to answer.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct WordParams {
    /// The level; 0 unless said.
    #[serde(default)]
    pub level: u8,
    /// Most items to answer; 100 unless said, at most 10000.
    pub limit: Option<usize>,
    /// `next_cursor` of the page before.
    pub cursor: Option<String>,
}

/// In whose coordinates poses are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum FrameDto {
    /// The map that serves.
    Map,
    /// The run's own frame: odometry as sent, or refined.
    #[default]
    Run,
    /// Odometry as sent.
    Odom,
}

impl From<FrameDto> for Frame {
    fn from(frame: FrameDto) -> Self {
        match frame {
            FrameDto::Map => Self::Map,
            FrameDto::Run => Self::Run,
            FrameDto::Odom => Self::Odom,
        }
    }
}

/// Which trajectory to answer.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct TrajectoryParams {
    /// In whose coordinates; `run` unless said.
    #[serde(default)]
    #[param(inline)]
    pub frame: FrameDto,
    /// Version of the map, when the frame is `map`; the serving one unless said.
    pub version: Option<u64>,
}

/// A pose at the time of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StampedPoseDto {
    /// Sequence number of the scan.
    pub scan_seq: u64,
    /// Its timestamp, nanoseconds.
    pub timestamp_ns: i64,
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub theta: f64,
}

impl From<&StampedPose> for StampedPoseDto {
    fn from(pose: &StampedPose) -> Self {
        let at = pose.frame_from_robot;
        Self { scan_seq: pose.scan_seq, timestamp_ns: pose.timestamp_ns, x: at.x, y: at.y, theta: at.theta }
    }
}

/// Poses of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrajectoryDto {
    /// Component of the map that the poses belong to; null outside the map frame.
    pub component: Option<u32>,
    /// One for every scan, in order.
    pub poses: Vec<StampedPoseDto>,
}

impl From<Trajectory> for TrajectoryDto {
    fn from(trajectory: Trajectory) -> Self {
        let poses = trajectory.poses.iter().map(StampedPoseDto::from).collect();
        Self { component: trajectory.component, poses }
    }
}

/// TUM's format.
pub fn trajectory_as_tum(poses: &[StampedPose]) -> String {
    write_tum(poses.iter().map(|pose| (pose.timestamp_ns, pose.frame_from_robot)))
}
