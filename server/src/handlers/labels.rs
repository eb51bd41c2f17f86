//! Labelled places, and questions in their words.

use axum::Json;

use crate::app::maps::{find_labels, labels};
use crate::dto::common::{Page, PageParams};
use crate::dto::labels::{LabelAnswerDto, LabelDto, LabelParams, LabelQueryDto};
use crate::error::{ApiError, Problem};
use crate::extract::{Body, Params, SiteOf};

/// Labelled stretches of all runs, in the order of travel. The label belongs to the place, whoever drove it.
#[utoipa::path(get, path = "/v1/sites/{site}/labels", operation_id = "list_labels", tag = "maps",
    params(("site" = String, Path), LabelParams),
    responses((status = 200, body = Page<LabelDto>), (status = 404, body = Problem), (status = 409, body = Problem)))]
pub async fn list_labels(
    SiteOf(site): SiteOf,
    Params(params): Params<LabelParams>,
) -> Result<Json<Page<LabelDto>>, ApiError> {
    let page = PageParams { limit: params.limit, cursor: params.cursor };
    let (first, limit) = (page.first()?, page.limit()?);
    let labels = labels(&site.map(params.version).await?).await?;
    let total = labels.len() as u64;
    let skipped = usize::try_from(first).unwrap_or(usize::MAX);
    let items = labels.into_iter().skip(skipped).take(limit).map(LabelDto::from).collect();
    Ok(Json(Page::of(items, first, total)))
}

/// Where is "a corridor over ten metres, then a left corner, then a bifurcation"? Driven either way round.
#[utoipa::path(post, path = "/v1/sites/{site}/queries/labels", operation_id = "query_labels", tag = "maps",
    params(("site" = String, Path)), request_body = LabelQueryDto,
    responses((status = 200, body = Vec<LabelAnswerDto>), (status = 404, body = Problem),
        (status = 409, body = Problem), (status = 422, body = Problem)))]
pub async fn query_labels(
    SiteOf(site): SiteOf,
    Body(query): Body<LabelQueryDto>,
) -> Result<Json<Vec<LabelAnswerDto>>, ApiError> {
    let (patterns, limit) = query.check()?;
    let map = site.map(None).await?;
    let answers = find_labels(&map, &patterns, limit).await?;
    Ok(Json(answers.into_iter().map(LabelAnswerDto::from).collect()))
}
