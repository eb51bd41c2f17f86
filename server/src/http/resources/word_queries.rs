//! Questions by word pattern.

use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::IntoResponse;
use axum::{Extension, Json};
use locution_engine::index::WordPattern;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::app::ask::{WordAnswer, find_words};
use crate::auth::Identity;
use crate::elsewhere::Answers;
use crate::error::ApiError;
use crate::extract::{Body, SiteOf};
use crate::http::values::{DirectionDto, PoseDto};
use crate::state::AppState;

/// Most words of a question.
const NUM_WORDS_MAX: usize = 64;

/// One word of a question; what is left out may be anything.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WordPatternDto {
    /// d: density class.
    #[schema(example = 3)]
    pub class: Option<u8>,
    /// s: number of observations.
    #[schema(example = 24)]
    pub size: Option<u32>,
    /// How far the size may be off, as a share of the larger; 0.25 unless said.
    #[schema(minimum = 0, maximum = 1)]
    pub size_tolerance: Option<f64>,
    /// a: turn, radians.
    #[schema(example = 1.57)]
    pub turn_rad: Option<f64>,
    /// How far the turn may be off, radians; 30 degrees unless said.
    #[schema(minimum = 0, maximum = 3.141592653589793)]
    pub turn_tolerance_rad: Option<f64>,
}

/// A sequence of words to look for, driven either way.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WordQueryDto {
    /// In the order of driving.
    #[schema(min_items = 1, max_items = 64)]
    pub words: Vec<WordPatternDto>,
    /// Most places to answer; 20 unless said.
    #[schema(minimum = 1, maximum = 1_000)]
    pub limit: Option<usize>,
}

impl WordQueryDto {
    /// The checked question.
    ///
    /// # Errors
    /// 422 for tolerances that cannot be, and for too many or too few words.
    pub fn check(&self) -> Result<(Vec<WordPattern>, usize), ApiError> {
        if self.words.is_empty() || self.words.len() > NUM_WORDS_MAX {
            return Err(ApiError::invalid("words", format!("a question has 1 to {NUM_WORDS_MAX} words")));
        }
        let limit = self.limit.unwrap_or(20);
        if !(1..=1000).contains(&limit) {
            return Err(ApiError::invalid("limit", "1 to 1000 places"));
        }
        let patterns = self.words.iter().enumerate().map(|(idx, word)| {
            let size_tolerance = word.size_tolerance.unwrap_or(0.25);
            if !(0.0..=1.0).contains(&size_tolerance) {
                return Err(ApiError::invalid(format!("words[{idx}].size_tolerance"), "a share from 0 to 1"));
            }
            let turn_tolerance_rad = word.turn_tolerance_rad.unwrap_or(30f64.to_radians());
            if !(0.0..=std::f64::consts::PI).contains(&turn_tolerance_rad) {
                return Err(ApiError::invalid(format!("words[{idx}].turn_tolerance_rad"), "from 0 to π"));
            }
            Ok(WordPattern {
                class: word.class,
                size: word.size,
                size_tolerance,
                turn_rad: word.turn_rad,
                turn_tolerance_rad,
            })
        });
        Ok((patterns.collect::<Result<_, ApiError>>()?, limit))
    }
}

/// Where a question fits.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct WordAnswerDto {
    /// The site.
    pub site: String,
    /// The run.
    pub run: String,
    /// `same`: read forwards; `opposite`: backwards.
    pub direction: DirectionDto,
    /// First and last word of level 0; alternative words make them more than the question has.
    #[schema(min_items = 2, max_items = 2)]
    pub words: [u32; 2],
    /// First and last observation.
    #[schema(min_items = 2, max_items = 2)]
    pub observations: [u32; 2],
    /// Mean fit of the words, from 0 (just within the tolerances) to 1 (exact).
    #[schema(minimum = 0, maximum = 1)]
    pub fit: f64,
    /// Component of the map; null when the run is not in it.
    pub component: Option<u32>,
    /// The middle of the place in that component's frame.
    pub map_from_middle: Option<PoseDto>,
}

impl WordAnswerDto {
    /// An answer of a site as it is sent.
    pub fn new(site: &str, answer: WordAnswer) -> Self {
        Self {
            site: site.to_owned(),
            run: answer.run,
            direction: answer.direction.into(),
            words: [answer.words.0, answer.words.1],
            observations: [answer.observations.0, answer.observations.1],
            fit: answer.fit,
            component: answer.in_map.map(|(component, _)| component),
            map_from_middle: answer.in_map.map(|(_, pose)| pose.into()),
        }
    }
}

/// Where are these words driven, one after the other, either way round?
#[utoipa::path(post, path = "/v1/sites/{site}/queries/words", operation_id = "query_words", tag = "texts",
    request_body = WordQueryDto,
    responses((status = 200, description = "Where the words are driven, best fit first", body = Vec<WordAnswerDto>)))]
pub async fn query_words(
    SiteOf(site): SiteOf,
    Body(query): Body<WordQueryDto>,
) -> Result<Json<Vec<WordAnswerDto>>, ApiError> {
    let (patterns, limit) = query.check()?;
    let answers = find_words(&site, &patterns, limit).await?;
    let name = site.name().as_str();
    Ok(Json(answers.into_iter().map(|answer| WordAnswerDto::new(name, answer)).collect()))
}

/// Where are these words driven, in all sites that the key may see?
#[utoipa::path(post, path = "/v1/queries/words", operation_id = "query_words_everywhere", tag = "texts",
    request_body = WordQueryDto,
    responses((status = 200, description = "Where the words are driven, best fit first", body = Vec<WordAnswerDto>)))]
pub async fn query_words_everywhere(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    headers: HeaderMap,
    Body(query): Body<WordQueryDto>,
) -> Result<impl IntoResponse, ApiError> {
    let (patterns, limit) = query.check()?;
    let elsewhere =
        Answers::<Vec<WordAnswerDto>>::to(&state, &identity, "/queries/words", &headers, &query).await?;
    let unanswered = elsewhere.as_header();
    let mut answers: Vec<_> = elsewhere.found.into_iter().flatten().collect();
    for site in state.app.sites(|name| identity.may_see(name)).await? {
        let name = site.name().as_str();
        let found = find_words(&site, &patterns, limit).await?;
        answers.extend(found.into_iter().map(|answer| WordAnswerDto::new(name, answer)));
    }
    answers.sort_by(|a, b| b.fit.total_cmp(&a.fit));
    answers.truncate(limit);
    Ok((unanswered, Json(answers)))
}
