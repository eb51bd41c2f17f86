//! Localisations and queries by example on the wire.

use locution_engine::locate::LocalizationState;
use locution_engine::mapping::Direction;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::batches::ScanDto;
use super::common::PoseDto;
use super::runs::GeometryDto;
use crate::app::ask::{ExampleInfo, ExamplePlace, LocalizationInfo};
use crate::app::runs::NewBatch;
use crate::error::ApiError;

/// Opens a localisation; the same body as that of a run.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewLocalizationDto {
    /// The robot, for the log.
    pub robot: Option<String>,
    /// The laser.
    pub geometry: GeometryDto,
}

/// How sure an answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LocalizationStateDto {
    /// No place of the map explains what is seen.
    Lost,
    /// Several places do, or one does not well enough.
    Ambiguous,
    /// One place does, and no other.
    Converged,
}

impl From<LocalizationState> for LocalizationStateDto {
    fn from(state: LocalizationState) -> Self {
        match state {
            LocalizationState::Lost => Self::Lost,
            LocalizationState::Ambiguous => Self::Ambiguous,
            LocalizationState::Converged => Self::Converged,
        }
    }
}

/// A place where the robot may be.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct HypothesisDto {
    /// The component of the map whose frame the pose is in.
    pub component: u32,
    /// Where.
    pub map_from_robot: PoseDto,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
    /// Probability; what is missing to 1 is that of being elsewhere.
    pub probability: f64,
}

/// A localisation as it stands.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct LocalizationDto {
    /// Its name.
    pub id: String,
    /// The map version it looks in.
    pub map_version: u64,
    /// How sure it is.
    pub state: LocalizationStateDto,
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Metres driven since it began.
    pub travel_m: f64,
    /// Likeliest first.
    pub hypotheses: Vec<HypothesisDto>,
}

impl From<LocalizationInfo> for LocalizationDto {
    fn from(info: LocalizationInfo) -> Self {
        Self {
            id: info.id.to_string(),
            map_version: info.map_version,
            state: info.state.into(),
            next_sequence: info.next_sequence,
            travel_m: info.travel_m,
            hypotheses: hypotheses_of(&info),
        }
    }
}

fn hypotheses_of(info: &LocalizationInfo) -> Vec<HypothesisDto> {
    let hypothesis = |found: &crate::app::ask::LocatedHypothesis| HypothesisDto {
        component: found.component,
        map_from_robot: found.map_from_robot.into(),
        covariance: found.covariance,
        probability: found.probability,
    };
    info.hypotheses.iter().map(hypothesis).collect()
}

/// A short recording that is asked about and not stored.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ExampleQueryDto {
    /// The laser.
    pub geometry: GeometryDto,
    /// In order of driving; some metres of it.
    pub scans: Vec<ScanDto>,
}

impl ExampleQueryDto {
    /// The scans, checked as those of a batch are.
    ///
    /// # Errors
    /// 422 naming scan and field.
    pub fn batch(self) -> Result<NewBatch, ApiError> {
        let scans = self.scans.into_iter().enumerate().map(|(idx, scan)| scan.check(idx));
        Ok(NewBatch { first_sequence: 0, scans: scans.collect::<Result<_, _>>()? })
    }
}

/// Where the example ends, in one site.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ExampleAnswerDto {
    /// The site.
    pub site: String,
    /// The map version looked in.
    pub map_version: u64,
    /// `lost` means "not here".
    pub state: LocalizationStateDto,
    /// Metres that the example drives.
    pub travel_m: f64,
    /// Places where the robot was at the end of the example, likeliest first.
    pub places: Vec<ExamplePlaceDto>,
}

/// A place where an example may end.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ExamplePlaceDto {
    /// The component of the map whose frame the pose is in.
    pub component: u32,
    /// Where.
    pub map_from_robot: PoseDto,
    /// Covariance of (x, y, θ), row by row; long along a plain corridor.
    pub covariance: [[f64; 3]; 3],
    /// Probability, over all sites asked; what is missing to 1 is that of being elsewhere.
    pub probability: f64,
    /// The run whose stretch reads like the example.
    pub run: String,
    /// First and last observation of that stretch.
    pub observations: [u32; 2],
    /// Which way it was driven: `same` or `opposite`.
    pub direction: String,
    /// What speaks for and against the place.
    pub evidence: ExampleEvidenceDto,
}

/// What speaks for and against a place, by the stage that found it.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ExampleEvidenceDto {
    /// What proposed the place: `profile`.
    pub channel: String,
    /// Standard deviations by which the density profiles differ less than over the whole site.
    pub profile_score: f64,
    /// 1 when all densities are equal.
    pub resemblance: f64,
    /// Share of the outline that the search laid onto surfaces.
    pub outline: f64,
    /// Share of the example's returns about which the map has an opinion.
    pub coverage: f64,
    /// Of these, the share that lie where the map saw free space.
    pub contradicted: f64,
    /// Share of the map's surfaces there that the example saw through.
    pub contradicts: f64,
}

impl From<ExampleInfo> for ExampleAnswerDto {
    fn from(info: ExampleInfo) -> Self {
        Self {
            site: info.site,
            map_version: info.map_version,
            state: info.state.into(),
            travel_m: info.travel_m,
            places: info.places.into_iter().map(ExamplePlaceDto::from).collect(),
        }
    }
}

impl From<ExamplePlace> for ExamplePlaceDto {
    fn from(place: ExamplePlace) -> Self {
        let ExamplePlace { found, run, probability } = place;
        let direction = match found.direction {
            Direction::Same => "same",
            Direction::Opposite => "opposite",
        };
        Self {
            component: found.component,
            map_from_robot: found.map_from_robot.into(),
            covariance: found.covariance.transpose().into(),
            probability,
            run,
            observations: [found.earlier.first, found.earlier.last],
            direction: direction.into(),
            evidence: ExampleEvidenceDto {
                channel: "profile".into(),
                profile_score: found.evidence.profile_score,
                resemblance: found.evidence.resemblance,
                outline: found.evidence.search_share,
                coverage: found.evidence.fit.coverage,
                contradicted: found.evidence.fit.contradicted,
                contradicts: found.evidence.fit.contradicts,
            },
        }
    }
}
