//! Questions by word pattern.

use axum::extract::State;
use axum::{Extension, Json};

use crate::app::ask::find_words;
use crate::auth::Identity;
use crate::dto::queries::{WordAnswerDto, WordQueryDto};
use crate::error::{ApiError, Problem};
use crate::extract::{Body, SiteOf};
use crate::state::AppState;

/// Where are these words driven, one after the other, either way round?
#[utoipa::path(post, path = "/v1/sites/{site}/queries/words", operation_id = "query_words", tag = "texts",
    params(("site" = String, Path)), request_body = WordQueryDto,
    responses((status = 200, body = Vec<WordAnswerDto>), (status = 404, body = Problem),
        (status = 422, body = Problem)))]
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
    responses((status = 200, body = Vec<WordAnswerDto>), (status = 422, body = Problem)))]
pub async fn query_words_everywhere(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    Body(query): Body<WordQueryDto>,
) -> Result<Json<Vec<WordAnswerDto>>, ApiError> {
    let (patterns, limit) = query.check()?;
    let mut answers = Vec::new();
    for site in state.app.sites(|name| identity.may_see(name)).await? {
        let name = site.name().as_str();
        let found = find_words(&site, &patterns, limit).await?;
        answers.extend(found.into_iter().map(|answer| WordAnswerDto::new(name, answer)));
    }
    answers.sort_by(|a, b| b.fit.total_cmp(&a.fit));
    answers.truncate(limit);
    Ok(Json(answers))
}
