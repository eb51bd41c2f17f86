//! What a run became: observations, words, trajectory.

use std::fmt::Write;

use axum::Json;
use axum::response::{IntoResponse, Response};
use locution_engine::formats::write_tum;
use locution_engine::text::{Observation, Word, WordId};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::runs::{Frame, FrameOf, StampedPose, Trajectory, observations_in, trajectory};
use crate::app::site::Site;
use crate::error::ApiError;
use crate::extract::{Paged, Params, RunName, SiteOf, WantsText};
use crate::http::text;
use crate::http::values::{Page, PageParams, PoseDto, window};
use crate::records::Run;

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
    #[schema(min_items = 2, max_items = 2)]
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

/// Which observations to list.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct ObservationParams {
    /// Not before, nanoseconds.
    pub from_ns: Option<i64>,
    /// Before, nanoseconds.
    pub to_ns: Option<i64>,
    /// Within this rectangle: `x,y,x,y` of two opposite corners, metres in `frame`.
    #[param(pattern = "^-?[0-9.eE+-]+(,-?[0-9.eE+-]+){3}$", max_length = 200, example = "0,0,12.5,8")]
    pub area: Option<String>,
    /// In whose coordinates the area is; `run` unless said.
    #[param(inline)]
    pub frame: Option<FrameDto>,
    /// Version of the map, when the frame is `map`; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// Which words to answer.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct WordParams {
    /// The level; 0 unless said.
    #[param(default = 0)]
    #[serde(default)]
    pub level: u8,
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
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
    /// In the frame `map` only the pieces of the run that lie in this component; unless said, in that of the first.
    #[param(minimum = 0)]
    pub component: Option<u32>,
    /// Not before, nanoseconds.
    pub from_ns: Option<i64>,
    /// Before, nanoseconds.
    pub to_ns: Option<i64>,
    /// Within this rectangle: `x,y,x,y` of two opposite corners, metres in `frame`.
    #[param(pattern = "^-?[0-9.eE+-]+(,-?[0-9.eE+-]+){3}$", max_length = 200, example = "0,0,12.5,8")]
    pub area: Option<String>,
    /// Most poses to answer; all unless said.
    #[param(minimum = 1)]
    pub limit: Option<u32>,
    /// `next_cursor` of the answer before.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub cursor: Option<u64>,
}

impl TrajectoryParams {
    /// The poses asked for, and where the next ones begin.
    ///
    /// # Errors
    /// 422 for a window that is none and a limit of zero.
    async fn poses(&self, site: &Site, run: &Run) -> Result<(Trajectory, Option<u64>), ApiError> {
        let limit = self.limit.map_or(usize::MAX, |limit| limit as usize);
        if limit == 0 {
            return Err(ApiError::invalid("limit", "at least 1 pose"));
        }
        let window = window(self.from_ns, self.to_ns, self.area.as_deref())?;
        let mut trajectory = trajectory(site, run, self.frame.into(), self.version, self.component).await?;
        let first = self.cursor.unwrap_or(0);
        trajectory.poses.retain(|pose| {
            pose.scan_seq >= first && window.holds(pose.timestamp_ns, &pose.frame_from_robot.position())
        });
        let next = trajectory.poses.get(limit).map(|pose| pose.scan_seq);
        trajectory.poses.truncate(limit);
        Ok((trajectory, next))
    }
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
    /// One for every scan that was asked for, in order; of a run that was cut, in the map frame, for those of the pieces
    /// that lie in the component.
    pub poses: Vec<StampedPoseDto>,
    /// Where the next ones begin, when fewer were wanted than there are; null at the end.
    pub next_cursor: Option<String>,
}

/// TUM's format.
pub fn trajectory_as_tum(poses: &[StampedPose]) -> String {
    write_tum(poses.iter().map(|pose| (pose.timestamp_ns, pose.frame_from_robot)))
}

/// Density samples, in order of travel.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/observations", operation_id = "list_observations", tag = "texts",
    params(ObservationParams, PageParams),
    responses((status = 200, description = "A page of observations", body = Page<ObservationDto>)))]
pub async fn list_observations(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Paged(params, page): Paged<ObservationParams>,
) -> Result<Json<Page<ObservationDto>>, ApiError> {
    let run = site.run(&name).await?;
    let window = window(params.from_ns, params.to_ns, params.area.as_deref())?;
    let of = FrameOf { frame: params.frame.unwrap_or(FrameDto::Run).into(), version: params.version };
    let (found, next) = observations_in(&site, &run, &window, of, page.first, page.limit).await?;
    let items = found.into_iter().map(|(number, item)| ObservationDto::new(number, item)).collect();
    Ok(Json(Page { items, next_cursor: next.map(|next| next.to_string()) }))
}

/// The text of a run, one level at a time; `Accept: text/plain` gives all words of the level, one a line.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/words", operation_id = "list_words", tag = "texts",
    params(WordParams, PageParams),
    responses((status = 200, description = "A page of words, or all of a level as text",
        content((Page<WordDto> = "application/json"), (String = "text/plain")))))]
pub async fn list_words(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    WantsText(wants_text): WantsText,
    Paged(params, page): Paged<WordParams>,
) -> Result<Response, ApiError> {
    let (first, limit) = if wants_text { (0, usize::MAX) } else { (page.first, page.limit) };
    let run = site.run(&name).await?;
    let words = run.words(params.level, first, limit).await?;
    if wants_text {
        return Ok(text(words_as_text(&words)));
    }
    let items = words.into_iter().map(WordDto::from).collect();
    Ok(Json(Page::of(items, first, run.num_words(params.level))).into_response())
}

/// A pose for every scan, in the frame asked for; `Accept: text/plain` gives TUM's format.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/trajectory", operation_id = "get_trajectory", tag = "texts",
    params(TrajectoryParams),
    responses((status = 200, description = "A pose for every scan",
        content((TrajectoryDto = "application/json"), (String = "text/plain"))),
        (status = 409, description = "The run is in no map yet")))]
pub async fn get_trajectory(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    WantsText(wants_text): WantsText,
    Params(params): Params<TrajectoryParams>,
) -> Result<Response, ApiError> {
    let run = site.run(&name).await?;
    let (trajectory, next) = params.poses(&site, &run).await?;
    if wants_text {
        return Ok(text(trajectory_as_tum(&trajectory.poses)));
    }
    let poses = trajectory.poses.iter().map(StampedPoseDto::from).collect();
    let next_cursor = next.map(|next| next.to_string());
    Ok(Json(TrajectoryDto { component: trajectory.component, poses, next_cursor }).into_response())
}

/// The same in TUM's format, for tools that go by the name.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/trajectory.tum", operation_id = "get_trajectory_tum", tag = "texts",
    params(TrajectoryParams),
    responses((status = 200, description = "A pose a line", body = String, content_type = "text/plain"),
        (status = 409, description = "The run is in no map yet")))]
pub async fn get_trajectory_tum(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Params(params): Params<TrajectoryParams>,
) -> Result<Response, ApiError> {
    let run = site.run(&name).await?;
    Ok(text(trajectory_as_tum(&params.poses(&site, &run).await?.0.poses)))
}
