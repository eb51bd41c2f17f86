//! Runs on the wire.

use locution_engine::scan::ScanGeometry;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::common::PoseDto;
use crate::app::runs::NewRun;
use crate::error::ApiError;
use crate::records::Run;

/// What all scans of a run share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GeometryDto {
    /// Readings per scan.
    #[schema(example = 180)]
    pub num_ranges: usize,
    /// Direction of the first beam in the laser's frame.
    #[schema(example = -1.5708)]
    pub angle_min_rad: f64,
    /// From one beam to the next; negative when the sweep runs clockwise.
    #[schema(example = 0.0174533)]
    pub angle_increment_rad: f64,
    /// A reading at or above this means "no return".
    #[schema(example = 81.83)]
    pub range_max_m: f64,
    /// Where the laser sits on the robot; at its centre looking ahead unless said.
    #[serde(default)]
    pub robot_from_laser: PoseDto,
}

impl From<&ScanGeometry> for GeometryDto {
    fn from(geometry: &ScanGeometry) -> Self {
        Self {
            num_ranges: geometry.num_ranges,
            angle_min_rad: geometry.angle_min_rad,
            angle_increment_rad: geometry.angle_increment_rad,
            range_max_m: geometry.range_max_m,
            robot_from_laser: geometry.robot_from_laser.into(),
        }
    }
}

impl GeometryDto {
    /// The engine's geometry; what cannot be translated is refused by the engine.
    ///
    /// # Errors
    /// 422 for numbers that are not finite or a scan over the limit.
    pub fn check(&self, num_ranges_max: usize) -> Result<ScanGeometry, ApiError> {
        if self.num_ranges == 0 || self.num_ranges > num_ranges_max {
            let problem = format!("a scan has 1 to {num_ranges_max} readings");
            return Err(ApiError::invalid("geometry.num_ranges", problem));
        }
        let robot_from_laser = self.robot_from_laser.check().map_err(|(name, problem)| {
            ApiError::invalid(format!("geometry.robot_from_laser.{name}"), problem)
        })?;
        Ok(ScanGeometry {
            num_ranges: self.num_ranges,
            angle_min_rad: self.angle_min_rad,
            angle_increment_rad: self.angle_increment_rad,
            range_max_m: self.range_max_m,
            robot_from_laser,
        })
    }
}

/// Makes a run.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewRunDto {
    /// The robot, when there is more to say than the run's name.
    #[schema(example = "porter-3")]
    pub robot: Option<String>,
    /// The laser.
    pub geometry: GeometryDto,
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
        Ok(NewRun { geometry: self.geometry.check(num_ranges_max)?, robot: self.robot })
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
            geometry: GeometryDto::from(&run.record.geometry),
            state: if run.head.is_finished { RunStateDto::Finished } else { RunStateDto::Open },
            next_sequence: run.head.next_sequence,
            num_scans: run.head.next_sequence,
            num_observations: run.text.num_observations,
            num_words: run.text.num_words_all_levels(),
        }
    }
}
