//! Labelled places, and questions in their words.

use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::IntoResponse;
use axum::{Extension, Json};
use locution_engine::semantics::{LabelPattern, PlaceLabel};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::maps::{DrivenStretch, LabelAnswer, find_labels, labels};
use crate::app::{AppError, Name};
use crate::auth::Identity;
use crate::elsewhere::Answers;
use crate::error::ApiError;
use crate::extract::{Body, Paged, SiteOf};
use crate::http::values::{Page, PageParams, PoseDto, one_of, window};
use crate::state::AppState;

/// Most parts of a question.
const NUM_PARTS_MAX: usize = 16;

/// Which labels to list.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct LabelParams {
    /// Name of the run that drove them.
    #[param(pattern = "^[A-Za-z0-9_-][A-Za-z0-9._-]*$", max_length = 64)]
    pub run: Option<String>,
    /// What kind of place.
    #[param(value_type = Option<PlaceLabelDto>, inline)]
    pub label: Option<String>,
    /// Component of the map.
    pub component: Option<u32>,
    /// Not before, nanoseconds.
    pub from_ns: Option<i64>,
    /// Before, nanoseconds.
    pub to_ns: Option<i64>,
    /// Within this rectangle: `x,y,x,y` of two opposite corners, metres, in the map; the middle counts.
    #[param(pattern = "^-?[0-9.eE+-]+(,-?[0-9.eE+-]+){3}$", max_length = 200, example = "0,0,12.5,8")]
    pub area: Option<String>,
    /// Version of the map; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// What kind of place it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PlaceLabelDto {
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

impl From<PlaceLabel> for PlaceLabelDto {
    fn from(label: PlaceLabel) -> Self {
        match label {
            PlaceLabel::Bifurcation => Self::Bifurcation,
            PlaceLabel::Corner => Self::Corner,
            PlaceLabel::Corridor => Self::Corridor,
            PlaceLabel::DeadEnd => Self::DeadEnd,
            PlaceLabel::Hall => Self::Hall,
        }
    }
}

/// A stretch of driving through places of one label.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct LabelDto {
    /// The run that drove it.
    pub run: String,
    /// Component of the map.
    pub component: u32,
    /// What kind of place it went through.
    pub label: PlaceLabelDto,
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
    #[schema(minimum = 0, maximum = 1)]
    pub confidence: f64,
    /// Its middle in the component's frame.
    pub map_from_middle: PoseDto,
}

impl From<DrivenStretch> for LabelDto {
    fn from(driven: DrivenStretch) -> Self {
        let stretch = driven.stretch;
        Self {
            run: driven.run,
            component: driven.component,
            label: stretch.label.into(),
            first: stretch.first,
            last: stretch.last,
            first_timestamp_ns: stretch.timestamps_ns.0,
            last_timestamp_ns: stretch.timestamps_ns.1,
            length_m: stretch.length_m,
            turn_rad: stretch.turn_rad,
            confidence: stretch.confidence,
            map_from_middle: stretch.map_from_middle.into(),
        }
    }
}

/// Which way a place turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum TurnDto {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

/// One part of a question.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelPatternDto {
    /// What kind of place to look for.
    #[schema(value_type = PlaceLabelDto)]
    pub label: String,
    /// Metres along it, at least.
    #[serde(default)]
    #[schema(example = 10.0)]
    pub length_min_m: f64,
    /// Metres along it, at most.
    pub length_max_m: Option<f64>,
    /// Which way it turns; either unless said.
    pub turn: Option<TurnDto>,
}

/// A sequence of labels to look for.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelQueryDto {
    /// In the order of driving.
    #[schema(min_items = 1, max_items = 16)]
    pub labels: Vec<LabelPatternDto>,
    /// Most places to answer; 20 unless said.
    #[schema(minimum = 1, maximum = 1_000)]
    pub limit: Option<usize>,
}

impl LabelQueryDto {
    /// The checked question.
    ///
    /// # Errors
    /// 422 for a label that does not exist, and for too many or too few parts.
    pub fn check(&self) -> Result<(Vec<LabelPattern>, usize), ApiError> {
        if self.labels.is_empty() || self.labels.len() > NUM_PARTS_MAX {
            return Err(ApiError::invalid("labels", format!("a question has 1 to {NUM_PARTS_MAX} labels")));
        }
        let limit = self.limit.unwrap_or(20);
        if !(1..=1000).contains(&limit) {
            return Err(ApiError::invalid("limit", "1 to 1000 places"));
        }
        let patterns = self.labels.iter().enumerate().map(|(idx, part)| {
            let label = PlaceLabel::from_name(&part.label).ok_or_else(|| {
                let names = PlaceLabel::ALL.map(PlaceLabel::name).join(", ");
                ApiError::invalid(format!("labels[{idx}].label"), format!("one of {names}"))
            })?;
            Ok(LabelPattern {
                label,
                length_min_m: part.length_min_m,
                length_max_m: part.length_max_m.unwrap_or(f64::INFINITY),
                is_left: part.turn.map(|turn| turn == TurnDto::Left),
            })
        });
        Ok((patterns.collect::<Result<_, ApiError>>()?, limit))
    }
}

/// Where a question fits.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct LabelAnswerDto {
    /// The site.
    pub site: String,
    /// The stretches, in the order of the question.
    pub places: Vec<LabelDto>,
    /// Whether the run drove them the other way round.
    pub is_reversed: bool,
    /// The least sure of its labels.
    pub confidence: f64,
}

impl LabelAnswerDto {
    /// An answer of a site.
    pub fn new(site: &Name, answer: LabelAnswer) -> Self {
        Self {
            site: site.to_string(),
            places: answer.stretches.into_iter().map(LabelDto::from).collect(),
            is_reversed: answer.is_reversed,
            confidence: answer.confidence,
        }
    }
}

/// Labelled stretches of all runs, in the order of travel. The label belongs to the place, whoever drove it.
#[utoipa::path(get, path = "/v1/sites/{site}/labels", operation_id = "list_labels", tag = "maps",
    params(LabelParams, PageParams),
    responses((status = 200, description = "A page of labelled stretches", body = Page<LabelDto>),
        (status = 409, description = "No map has been built yet")))]
pub async fn list_labels(
    SiteOf(site): SiteOf,
    Paged(params, page): Paged<LabelParams>,
) -> Result<Json<Page<LabelDto>>, ApiError> {
    let label: Option<PlaceLabelDto> = one_of("label", params.label.as_deref())?;
    let run = params.run.as_deref().map(|run| Name::new(run, "run")).transpose()?;
    let window = window(params.from_ns, params.to_ns, params.area.as_deref())?;
    let mut labels = labels(&site.map(params.version).await?).await?;
    labels.retain(|driven| {
        run.as_ref().is_none_or(|run| run.as_str() == driven.run)
            && params.component.is_none_or(|component| component == driven.component)
            && label.is_none_or(|label| label == driven.stretch.label.into())
            && window.holds_time(driven.stretch.timestamps_ns)
            && window.holds_place(&driven.stretch.map_from_middle.position())
    });
    let total = labels.len();
    Ok(Json(Page::of_all(labels.into_iter().map(LabelDto::from), total, page)))
}

/// Where is "a corridor over ten metres, then a left corner, then a bifurcation"? Driven either way round.
#[utoipa::path(post, path = "/v1/sites/{site}/queries/labels", operation_id = "query_labels", tag = "maps",
    request_body = LabelQueryDto,
    responses((status = 200, description = "Where the labels are driven one after the other", body = Vec<LabelAnswerDto>),
        (status = 409, description = "No map has been built yet")))]
pub async fn query_labels(
    SiteOf(site): SiteOf,
    Body(query): Body<LabelQueryDto>,
) -> Result<Json<Vec<LabelAnswerDto>>, ApiError> {
    let (patterns, limit) = query.check()?;
    let map = site.map(None).await?;
    let answers = find_labels(&map, &patterns, limit).await?;
    Ok(Json(answers.into_iter().map(|answer| LabelAnswerDto::new(site.name(), answer)).collect()))
}

/// The same over all sites that the key may see, the surest first. Sites without a map are passed over.
#[utoipa::path(post, path = "/v1/queries/labels", operation_id = "query_labels_everywhere", tag = "maps",
    request_body = LabelQueryDto,
    responses((status = 200, description = "Where the labels are driven one after the other", body = Vec<LabelAnswerDto>)))]
pub async fn query_labels_everywhere(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    headers: HeaderMap,
    Body(query): Body<LabelQueryDto>,
) -> Result<impl IntoResponse, ApiError> {
    let (patterns, limit) = query.check()?;
    let elsewhere =
        Answers::<Vec<LabelAnswerDto>>::to(&state, &identity, "/queries/labels", &headers, &query).await?;
    let unanswered = elsewhere.as_header();
    let mut answers: Vec<_> = elsewhere.found.into_iter().flatten().collect();
    for site in state.app.sites(|name| identity.may_see(name)).await? {
        let map = match site.map(None).await {
            Err(AppError::NotReady { .. }) => continue,
            map => map?,
        };
        let found = find_labels(&map, &patterns, limit).await?;
        answers.extend(found.into_iter().map(|answer| LabelAnswerDto::new(site.name(), answer)));
    }
    answers.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    answers.truncate(limit);
    Ok((unanswered, Json(answers)))
}
