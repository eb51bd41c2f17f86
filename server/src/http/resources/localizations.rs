//! "Where am I": sessions fed with scans, and questions by example.

use std::sync::Arc;

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use locution_engine::geometry::Pose2;
use locution_engine::locate::{Hypothesis, LocalizationState, Missing, PosePrior};
use locution_engine::recall::AnsweredPlace;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::batches::{BatchDto, ScanDto, checked_batch};
use super::runs::{GeometryDto, check_area};
use crate::app::AppError;
use crate::app::ask::{Declared, ExampleInfo, LocalizationInfo};
use crate::app::runs::NewBatch;
use crate::auth::Identity;
use crate::elsewhere::Answers;
use crate::error::ApiError;
use crate::extract::{Body, IdOf, NoParams, Paged, SiteOf};
use crate::http::values::{ChannelDto, DirectionDto, Page, PageParams, PoseDto};
use crate::http::with_location;
use crate::state::AppState;

/// Opens a localisation; the body of a run, and what is known of where the robot is.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewLocalizationDto {
    /// The robot, for the log.
    pub robot: Option<String>,
    /// The laser.
    pub geometry: GeometryDto,
    /// Where the robot is said to be when the session begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<PosePriorDto>,
    /// The area it is said to be in: only components with a run of this area are looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "second floor", min_length = 1, max_length = 256)]
    pub area: Option<String>,
}

/// A rough pose that a person or another system declares. It is weighed, not believed.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PosePriorDto {
    /// The component of the map whose frame the pose is in.
    #[serde(default)]
    pub component: u32,
    /// Where.
    pub map_from_robot: PoseDto,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
}

impl PosePriorDto {
    /// The declaration as the engine weighs it.
    ///
    /// # Errors
    /// 422 for a matrix that is no covariance.
    pub fn check(&self) -> Result<PosePrior, ApiError> {
        let PoseDto { x, y, theta } = self.map_from_robot;
        PosePrior::new(self.component, Pose2::new(x, y, theta), self.covariance).ok_or_else(|| {
            ApiError::invalid(
                "prior.covariance",
                "must be symmetric with positive variances, the pose finite",
            )
        })
    }
}

/// What is missing before a robot counts as found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MissingDto {
    /// Too little was driven.
    Travel,
    /// That the robot is not in this map is too probable.
    Elsewhere,
    /// Another place of the map is too probable.
    Alternatives,
    /// The best place has not been the best one for long enough.
    Persistence,
    /// What was seen last contradicts the best place.
    RecentScans,
    /// The pose could slide too far, as it can along a plain corridor.
    Position,
}

impl From<Missing> for MissingDto {
    fn from(missing: Missing) -> Self {
        match missing {
            Missing::Travel => Self::Travel,
            Missing::Elsewhere => Self::Elsewhere,
            Missing::Alternatives => Self::Alternatives,
            Missing::Persistence => Self::Persistence,
            Missing::RecentScans => Self::RecentScans,
            Missing::Position => Self::Position,
        }
    }
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
    #[schema(minimum = 0, maximum = 1)]
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
    /// Seconds until it is forgotten, unless scans come or somebody asks for it by its name.
    #[schema(minimum = 0)]
    pub expires_in_s: f64,
    /// Probability that the robot is not in this map; with those of all places 1.
    #[schema(minimum = 0, maximum = 1)]
    pub probability_elsewhere: f64,
    /// What is missing to be `converged`; empty when it is.
    pub missing: Vec<MissingDto>,
    /// Whether the likeliest place is the one that was declared; absent without a declaration or a likely place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior_agrees: Option<bool>,
}

impl From<LocalizationInfo> for LocalizationDto {
    fn from(info: LocalizationInfo) -> Self {
        let estimate = info.estimate;
        Self {
            id: info.id.to_string(),
            map_version: info.map_version,
            state: estimate.state.into(),
            next_sequence: info.next_sequence,
            travel_m: estimate.travel_m,
            hypotheses: estimate.hypotheses.into_iter().map(HypothesisDto::from).collect(),
            probability_elsewhere: estimate.probability_elsewhere,
            missing: estimate.missing.into_iter().map(MissingDto::from).collect(),
            prior_agrees: estimate.prior_agrees,
            expires_in_s: info.expires_in.as_secs_f64(),
        }
    }
}

impl From<Hypothesis> for HypothesisDto {
    fn from(found: Hypothesis) -> Self {
        Self {
            component: found.component,
            map_from_robot: found.map_from_robot.into(),
            covariance: found.covariance,
            probability: found.probability,
        }
    }
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
        checked_batch(0, self.scans)
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
    /// Probability that the example was not made in this site.
    #[schema(minimum = 0, maximum = 1)]
    pub probability_elsewhere: f64,
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
    #[schema(minimum = 0, maximum = 1)]
    pub probability: f64,
    /// The run whose stretch reads like the example.
    pub run: String,
    /// First and last observation of that stretch.
    #[schema(min_items = 2, max_items = 2)]
    pub observations: [u32; 2],
    /// Which way it was driven.
    pub direction: DirectionDto,
    /// What speaks for and against the place.
    pub evidence: ExampleEvidenceDto,
}

/// What speaks for and against a place, by the stage that found it.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ExampleEvidenceDto {
    /// What proposed the place.
    pub channel: ChannelDto,
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
        let run = |place: &AnsweredPlace| info.runs.get(place.found.earlier.run_idx as usize).cloned();
        let place = |place: AnsweredPlace| {
            let (run, first) = run(&place).unwrap_or_default();
            ExamplePlaceDto::new(run, first as u32, place)
        };
        Self {
            site: info.site,
            map_version: info.map_version,
            state: info.answer.state.into(),
            travel_m: info.travel_m,
            places: info.answer.places.into_iter().map(place).collect(),
            probability_elsewhere: info.answer.probability_elsewhere,
        }
    }
}

impl ExamplePlaceDto {
    fn new(run: String, first: u32, place: AnsweredPlace) -> Self {
        let AnsweredPlace { found, probability } = place;
        Self {
            component: found.component,
            map_from_robot: found.map_from_robot.into(),
            covariance: found.covariance.transpose().into(),
            probability,
            run,
            observations: [found.earlier.first, found.earlier.last].map(|idx| first + idx),
            direction: found.direction.into(),
            evidence: ExampleEvidenceDto {
                channel: ChannelDto::Profile,
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

/// Open a localisation in the serving map; nothing of it is stored.
#[utoipa::path(post, path = "/v1/sites/{site}/localisations", operation_id = "open_localization", tag = "localization",
    request_body = NewLocalizationDto,
    responses((status = 201, description = "The localisation is open", body = LocalizationDto,
            headers(("Location" = String, description = "The localisation"))),
        (status = 409, description = "No map has been built yet")))]
pub async fn open_localization(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Extension(identity): Extension<Identity>,
    Body(new): Body<NewLocalizationDto>,
) -> Result<Response, ApiError> {
    let laser = new.geometry.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let prior = new.prior.as_ref().map(PosePriorDto::check).transpose()?;
    check_area(new.area.as_ref())?;
    let declared = Declared { prior, area: new.area };
    let (owner, num_own_max) = (Arc::clone(identity.name()), identity.num_localizations_max());
    let info = state.app.open_localization(&site, laser, declared, owner, num_own_max).await?;
    let location = format!("/v1/sites/{}/localisations/{}", site.name(), info.id);
    Ok(with_location(&location, (StatusCode::CREATED, Json(LocalizationDto::from(info)))))
}

/// All localisations that are open in the site, the oldest first. Listing them keeps none of them open.
#[utoipa::path(get, path = "/v1/sites/{site}/localisations", operation_id = "list_localizations", tag = "localization",
    params(PageParams),
    responses((status = 200, description = "A page of localisations", body = Page<LocalizationDto>)))]
pub async fn list_localizations(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Paged(NoParams {}, page): Paged<NoParams>,
) -> Result<Json<Page<LocalizationDto>>, ApiError> {
    let infos = state.app.localizations(&site).await?;
    let total = infos.len();
    Ok(Json(Page::of_all(infos.into_iter().map(LocalizationDto::from), total, page)))
}

/// The answer as it stands.
#[utoipa::path(get, path = "/v1/sites/{site}/localisations/{id}", operation_id = "get_localization", tag = "localization",
    responses((status = 200, description = "The localisation", body = LocalizationDto)))]
pub async fn get_localization(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
) -> Result<Json<LocalizationDto>, ApiError> {
    Ok(Json(state.app.localization(&site, id).await?.into()))
}

/// Feed scans, in the batches of a run, and get the answer after them.
#[utoipa::path(post, path = "/v1/sites/{site}/localisations/{id}/batches", operation_id = "append_localization_batch", tag = "localization",
    request_body(content((BatchDto = "application/json"), (BatchDto = "application/cbor"))),
    responses((status = 200, description = "The answer after these scans", body = LocalizationDto),
        (status = 409, description = "The batch does not continue the localisation; `expected_sequence` says what does")))]
pub async fn localize(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Body(batch): Body<BatchDto>,
) -> Result<Json<LocalizationDto>, ApiError> {
    Ok(Json(state.app.localize(&site, id, batch.try_into()?).await?.into()))
}

/// Close a localisation.
#[utoipa::path(delete, path = "/v1/sites/{site}/localisations/{id}", operation_id = "close_localization", tag = "localization",
    responses((status = 204, description = "It is closed")))]
pub async fn close_localization(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
) -> Result<StatusCode, ApiError> {
    state.app.close_localization(&site, id)?;
    Ok(StatusCode::NO_CONTENT)
}

/// Where in the site was this recorded? The example is not stored.
#[utoipa::path(post, path = "/v1/sites/{site}/queries/example", operation_id = "query_example", tag = "localization",
    request_body(content((ExampleQueryDto = "application/json"), (ExampleQueryDto = "application/cbor"))),
    responses((status = 200, description = "Where the recording ends in this site, or that it does not", body = ExampleAnswerDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn query_example(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Body(query): Body<ExampleQueryDto>,
) -> Result<Json<ExampleAnswerDto>, ApiError> {
    let (geometry, readings) = query.geometry.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let answers = state.app.find_example(&[site], (&geometry, &readings), query.batch()?).await?;
    let answer = answers.into_iter().next().ok_or_else(|| AppError::internal("a site without an answer"))?;
    Ok(Json(answer.into()))
}

/// Where was this recorded, of all sites that the key may see? Sites without a map are passed over.
#[utoipa::path(post, path = "/v1/queries/example", operation_id = "query_example_everywhere", tag = "localization",
    request_body(content((ExampleQueryDto = "application/json"), (ExampleQueryDto = "application/cbor"))),
    responses((status = 200, description = "An answer for each site, the likeliest first", body = Vec<ExampleAnswerDto>)))]
pub async fn query_example_everywhere(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    headers: HeaderMap,
    Body(query): Body<ExampleQueryDto>,
) -> Result<impl IntoResponse, ApiError> {
    let (geometry, readings) = query.geometry.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let elsewhere =
        Answers::<ExampleAnswerDto>::to(&state, &identity, "/queries/example", &headers, &query).await?;
    let sites = state.app.sites(|name| identity.may_see(name)).await?;
    let answers = state.app.find_example(&sites, (&geometry, &readings), query.batch()?).await?;
    let unanswered = elsewhere.as_header();
    let mut answers: Vec<_> = answers.into_iter().map(ExampleAnswerDto::from).collect();
    if !elsewhere.found.is_empty() {
        let best = |answer: &ExampleAnswerDto| answer.places.first().map_or(0.0, |place| place.probability);
        answers.extend(elsewhere.found);
        answers.sort_by(|a, b| best(b).total_cmp(&best(a)));
    }
    Ok((unanswered, Json(answers)))
}
