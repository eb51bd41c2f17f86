//! Runs: uninterrupted recordings of one robot.

use std::f64::consts::TAU;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use locution_engine::registration::CutReason;
use locution_engine::scan::ScanGeometry;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::jobs::{JobDto, accepted};
use crate::app::runs::{NewRun, RunPiece, pieces};
use crate::error::ApiError;
use crate::extract::{Body, NoParams, Paged, RunName, SiteOf};
use crate::http::resources::maps::VersionParams;
use crate::http::values::{Page, PageParams, PoseDto};
use crate::http::with_location;
use crate::records::{ReadingRules, Run};
use crate::state::AppState;

/// What all scans of a run share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GeometryDto {
    /// Readings per scan, at most the server's limit.
    #[schema(example = 180, minimum = 1, maximum = 8_192)]
    pub num_ranges: usize,
    /// Fewest readings of a scan, of a laser whose number varies; those missing at the end say nothing. As many as
    /// `num_ranges` unless said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 180, minimum = 1, maximum = 8_192)]
    pub num_ranges_min: Option<usize>,
    /// Direction of the first beam in the laser's frame.
    #[schema(example = -1.5708)]
    pub angle_min_rad: f64,
    /// From one beam to the next; negative when the sweep runs clockwise, as that of a laser mounted upside down.
    #[schema(example = 0.0174533)]
    pub angle_increment_rad: f64,
    /// A reading at or above this means "no return".
    #[schema(example = 81.83)]
    pub range_max_m: f64,
    /// A reading below this, or −∞, means "too near to tell" and says nothing; 0 unless said.
    #[serde(default)]
    #[schema(example = 0.06, minimum = 0)]
    pub range_min_m: f64,
    /// Where the laser sits on the robot; at its centre looking ahead unless said.
    #[serde(default)]
    pub robot_from_laser: PoseDto,
}

/// No laser that this is made for sees farther, metres: a larger number is one of millimetres.
const RANGE_MAX_MAX_M: f64 = 1_000.0;

impl GeometryDto {
    /// The laser of a run as it was stated.
    pub fn of(geometry: &ScanGeometry, readings: &ReadingRules) -> Self {
        let is_fixed = readings.num_ranges_min == geometry.num_ranges;
        Self {
            num_ranges: geometry.num_ranges,
            num_ranges_min: (!is_fixed).then_some(readings.num_ranges_min),
            angle_min_rad: geometry.angle_min_rad,
            angle_increment_rad: geometry.angle_increment_rad,
            range_max_m: geometry.range_max_m,
            range_min_m: readings.range_min_m,
            robot_from_laser: geometry.robot_from_laser.into(),
        }
    }

    /// The engine's geometry, and what is said of the readings; what cannot be translated is refused by the engine.
    ///
    /// # Errors
    /// 422 for numbers that are not finite, that must be millimetres or degrees, or a scan over the limit.
    pub fn check(&self, num_ranges_max: usize) -> Result<(ScanGeometry, ReadingRules), ApiError> {
        self.check_units()?;
        let num_ranges_min = self.num_ranges_min.unwrap_or(self.num_ranges);
        if num_ranges_min == 0 || num_ranges_min > self.num_ranges {
            let problem = "must lie between 1 and num_ranges";
            return Err(ApiError::invalid("geometry.num_ranges_min", problem));
        }
        if !(self.range_min_m >= 0.0 && self.range_min_m < self.range_max_m) {
            let problem = "must lie between 0 and range_max_m";
            return Err(ApiError::invalid("geometry.range_min_m", problem));
        }
        if self.num_ranges == 0 || self.num_ranges > num_ranges_max {
            let problem = format!("a scan has 1 to {num_ranges_max} readings");
            return Err(ApiError::invalid("geometry.num_ranges", problem));
        }
        let robot_from_laser = self.robot_from_laser.check().map_err(|(name, problem)| {
            ApiError::invalid(format!("geometry.robot_from_laser.{name}"), problem)
        })?;
        let geometry = ScanGeometry {
            num_ranges: self.num_ranges,
            angle_min_rad: self.angle_min_rad,
            angle_increment_rad: self.angle_increment_rad,
            range_max_m: self.range_max_m,
            robot_from_laser,
        };
        Ok((geometry, ReadingRules { range_min_m: self.range_min_m, num_ranges_min }))
    }

    /// Tells angles that must be degrees and distances that must be millimetres.
    fn check_units(&self) -> Result<(), ApiError> {
        let sweep_rad = self.angle_increment_rad.abs() * self.num_ranges.saturating_sub(1) as f64;
        let mount_rad = self.robot_from_laser.theta.abs();
        for (field, what, value) in [
            ("angle_min_rad", "the first beam's direction", self.angle_min_rad.abs()),
            ("angle_increment_rad", "the sweep from the first beam to the last", sweep_rad),
            ("robot_from_laser.theta", "the laser's heading", mount_rad),
        ] {
            if value > 1.001 * TAU {
                let problem =
                    format!("{what} is {value} rad, more than a full turn: angles are radians, not degrees");
                return Err(ApiError::invalid(format!("geometry.{field}"), problem));
            }
        }
        if self.range_max_m > RANGE_MAX_MAX_M {
            let problem = format!("must be at most {RANGE_MAX_MAX_M}: ranges are metres, not millimetres");
            return Err(ApiError::invalid("geometry.range_max_m", problem));
        }
        Ok(())
    }
}

/// Makes a run.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewRunDto {
    /// The robot, when there is more to say than the run's name.
    #[schema(example = "porter-3", max_length = 256)]
    pub robot: Option<String>,
    /// The laser.
    pub geometry: GeometryDto,
    /// Where the run belongs, for instance a floor: it is never joined to runs of another area. Floors that look alike
    /// cannot be told apart by a laser.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "second floor", min_length = 1, max_length = 256)]
    pub area: Option<String>,
}

/// An area as it may be named.
///
/// # Errors
/// 422 for a name that is empty or too long.
pub fn check_area(area: Option<&String>) -> Result<(), ApiError> {
    if area.is_some_and(|area| area.is_empty() || area.len() > 256) {
        return Err(ApiError::invalid("area", "1 to 256 bytes"));
    }
    Ok(())
}

impl NewRunDto {
    /// The checked run.
    ///
    /// # Errors
    /// 422 for values that cannot be.
    pub fn check(self, num_ranges_max: usize) -> Result<NewRun, ApiError> {
        if self.robot.as_ref().is_some_and(|robot| robot.len() > 256) {
            return Err(ApiError::invalid("robot", "at most 256 bytes"));
        }
        let (geometry, readings) = self.geometry.check(num_ranges_max)?;
        check_area(self.area.as_ref())?;
        Ok(NewRun { robot: self.robot, geometry, readings, area: self.area })
    }
}

/// Whether a run takes more scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunStateDto {
    /// It does.
    Open,
    /// It does not.
    Finished,
}

/// A run and how far it has come.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RunDto {
    /// Its name.
    #[schema(example = "porter-3-monday")]
    pub run: String,
    /// The robot.
    pub robot: Option<String>,
    /// Where it belongs, when the client said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<String>,
    /// The laser.
    pub geometry: GeometryDto,
    /// Whether it takes more scans.
    pub state: RunStateDto,
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Scans stored.
    pub num_scans: u64,
    /// Observations so far.
    pub num_observations: u64,
    /// Words of all levels so far.
    pub num_words: u64,
}

impl From<Run> for RunDto {
    fn from(run: Run) -> Self {
        Self {
            run: run.record.name.clone(),
            robot: run.record.robot.clone(),
            area: run.record.area.clone(),
            geometry: GeometryDto::of(&run.record.geometry, &run.record.readings),
            state: if run.head.is_finished { RunStateDto::Finished } else { RunStateDto::Open },
            next_sequence: run.head.next_sequence,
            num_scans: run.head.next_sequence,
            num_observations: run.text.num_observations,
            num_words: run.text.num_words_all_levels(),
        }
    }
}

/// Make a run, or find it as it stands.
#[utoipa::path(put, path = "/v1/sites/{site}/runs/{run}", operation_id = "make_run", tag = "runs",
    request_body = NewRunDto,
    responses((status = 200, description = "The run as it stands", body = RunDto),
        (status = 201, description = "The run was made", body = RunDto,
            headers(("Location" = String, description = "The run"))),
        (status = 409, description = "The run stands with another geometry or robot")))]
pub async fn make_run(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Body(new): Body<NewRunDto>,
) -> Result<Response, ApiError> {
    let new = new.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let (run, is_new) = state.app.make_run(&site, &name, new).await?;
    let answer = Json(RunDto::from(run));
    if !is_new {
        return Ok(answer.into_response());
    }
    let location = format!("/v1/sites/{}/runs/{name}", site.name());
    Ok(with_location(&location, (StatusCode::CREATED, answer)))
}

/// All runs of a site, in the order of their making.
#[utoipa::path(get, path = "/v1/sites/{site}/runs", operation_id = "list_runs", tag = "runs",
    params(PageParams),
    responses((status = 200, description = "A page of runs", body = Page<RunDto>)))]
pub async fn list_runs(
    SiteOf(site): SiteOf,
    Paged(NoParams {}, page): Paged<NoParams>,
) -> Result<Json<Page<RunDto>>, ApiError> {
    let (runs, next) = site.runs(u32::try_from(page.first).unwrap_or(u32::MAX), page.limit).await?;
    let items = runs.into_iter().map(RunDto::from).collect();
    Ok(Json(Page { items, next_cursor: next.map(|next| next.to_string()) }))
}

/// One run.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}", operation_id = "get_run", tag = "runs",
    responses((status = 200, description = "The run", body = RunDto)))]
pub async fn get_run(SiteOf(site): SiteOf, RunName(name): RunName) -> Result<Json<RunDto>, ApiError> {
    Ok(Json(site.run(&name).await?.into()))
}

/// End a run: delayed observations and pending words are brought out; later batches answer 409.
#[utoipa::path(post, path = "/v1/sites/{site}/runs/{run}/finish", operation_id = "finish_run", tag = "runs",
    responses((status = 200, description = "The run is finished", body = RunDto)))]
pub async fn finish_run(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    RunName(name): RunName,
) -> Result<Json<RunDto>, ApiError> {
    Ok(Json(state.app.finish_run(site, &name).await?.into()))
}

/// Why a piece of a run does not go on from the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CutReasonDto {
    /// Odometry stepped farther than a robot can, and the scans do not fit what was seen before.
    Jump,
    /// Nothing was recorded for a while, and what was seen then does not fit what was seen before.
    Gap,
    /// The laser saw nothing for a while, and what it saw then does not fit what it saw before.
    NoReturns,
    /// By its odometry the robot hardly moved, but it saw through what had been there: it was carried.
    Carried,
    /// There is no odometry to be believed, and the scans changed faster than they could be followed.
    Unfollowed,
}

impl From<CutReason> for CutReasonDto {
    fn from(reason: CutReason) -> Self {
        match reason {
            CutReason::Jump => Self::Jump,
            CutReason::Gap => Self::Gap,
            CutReason::NoReturns => Self::NoReturns,
            CutReason::Carried => Self::Carried,
            CutReason::Unfollowed => Self::Unfollowed,
        }
    }
}

/// A piece of a run: nothing tells how it lies to the piece before but the map, if that joined them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunPieceDto {
    /// Sequence number of its first scan.
    pub from_scan: u64,
    /// Sequence number of its last scan.
    pub to_scan: u64,
    /// Why it does not go on from the piece before; null for the first.
    pub reason: Option<CutReasonDto>,
    /// The component of the map that it lies in; pieces of one component share a frame. Null when it is in no map.
    pub component: Option<u32>,
    /// Metres driven in the map; null when it is in no map.
    pub length_m: Option<f64>,
}

impl From<RunPiece> for RunPieceDto {
    fn from(piece: RunPiece) -> Self {
        Self {
            from_scan: piece.from_scan,
            to_scan: piece.to_scan,
            reason: piece.reason.map(CutReasonDto::from),
            component: piece.in_map.map(|(component, _)| component),
            length_m: piece.in_map.map(|(_, length_m)| length_m),
        }
    }
}

/// The pieces that a run falls in where neither its odometry nor its scans tell how the robot got on: after a jump, a gap,
/// when it was carried. A run that could be followed all the way is one piece.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/pieces", operation_id = "list_pieces", tag = "runs",
    params(VersionParams, PageParams),
    responses((status = 200, description = "A page of pieces, in order", body = Page<RunPieceDto>)))]
pub async fn list_pieces(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Paged(params, page): Paged<VersionParams>,
) -> Result<Json<Page<RunPieceDto>>, ApiError> {
    let run = site.run(&name).await?;
    let all = pieces(&site, &run, params.version).await?;
    let num_all = all.len() as u64;
    let of_page = all.into_iter().skip(usize::try_from(page.first).unwrap_or(usize::MAX)).take(page.limit);
    Ok(Json(Page::of(of_page.map(RunPieceDto::from).collect(), page.first, num_all)))
}

/// Forget a run with all its traces. It is unknown and its scans and texts are gone at once; when there is a map, a build is
/// queued that makes a version without it, and versions that hold it are dropped then.
#[utoipa::path(delete, path = "/v1/sites/{site}/runs/{run}", operation_id = "delete_run", tag = "runs",
    responses((status = 202, description = "The run is forgotten, and the job makes the map without it", body = JobDto,
            headers(("Location" = String, description = "Where the job can be watched"))),
        (status = 204, description = "Nothing of the run is left")))]
pub async fn delete_run(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    RunName(name): RunName,
) -> Result<Response, ApiError> {
    match state.app.delete_run(&site, &name).await? {
        Some(job) => Ok(accepted(&site, job)),
        None => Ok(StatusCode::NO_CONTENT.into_response()),
    }
}
