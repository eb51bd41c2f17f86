//! Questions by word pattern.

use axum::Json;

use crate::dto::queries::{WordAnswerDto, WordQueryDto};
use crate::error::{ApiError, Problem};
use crate::extract::{Body, SiteOf};

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
    let answers = site.find_words(&patterns, limit).await?;
    Ok(Json(answers.into_iter().map(WordAnswerDto::from).collect()))
}
