//! Matches as objects, and what people say of them.

use axum::Json;
use axum::http::StatusCode;

use crate::app::Name;
use crate::app::maps::{a_match, decide, matches, undecide};
use crate::dto::common::{Page, PageParams};
use crate::dto::maps::{DecisionDto, DecisionKindDto, MapParams, MatchDto, MatchParams};
use crate::error::{ApiError, Problem};
use crate::extract::{Body, IdOf, Params, SiteOf};

/// Matches of the serving map, or of a version.
#[utoipa::path(get, path = "/v1/sites/{site}/matches", operation_id = "list_matches", tag = "maps",
    params(("site" = String, Path), MatchParams),
    responses((status = 200, body = Page<MatchDto>), (status = 404, body = Problem), (status = 409, body = Problem)))]
pub async fn list_matches(
    SiteOf(site): SiteOf,
    Params(params): Params<MatchParams>,
) -> Result<Json<Page<MatchDto>>, ApiError> {
    let page = PageParams { limit: params.limit, cursor: params.cursor.clone() };
    let map = site.map(params.version).await?;
    let run = match &params.run {
        Some(run) => Some(site.run(&Name::new(run, "run")?).await?.idx),
        None => None,
    };
    let (matches, next) = matches(&map, &params.filter(run)?, page.first()?, page.limit()?).await?;
    let items = matches.into_iter().map(|found| MatchDto::new(found, &map.record)).collect();
    Ok(Json(Page { items, next_cursor: next.map(|next| next.to_string()) }))
}

/// One match with its evidence.
#[utoipa::path(get, path = "/v1/sites/{site}/matches/{id}", operation_id = "get_match", tag = "maps",
    params(("site" = String, Path), ("id" = String, Path), MapParams),
    responses((status = 200, body = MatchDto), (status = 404, body = Problem)))]
pub async fn get_match(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<MapParams>,
) -> Result<Json<MatchDto>, ApiError> {
    let map = site.map(params.version).await?;
    Ok(Json(MatchDto::new(a_match(&map, id).await?, &map.record)))
}

/// Veto or confirm a match. It sticks to the pair of places, also in maps to come, and counts at the next build.
#[utoipa::path(put, path = "/v1/sites/{site}/matches/{id}/decision", operation_id = "decide_match", tag = "maps",
    params(("site" = String, Path), ("id" = String, Path), MapParams), request_body = DecisionDto,
    responses((status = 200, body = MatchDto), (status = 404, body = Problem)))]
pub async fn decide_match(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<MapParams>,
    Body(decision): Body<DecisionDto>,
) -> Result<Json<MatchDto>, ApiError> {
    let map = site.map(params.version).await?;
    let found = a_match(&map, id).await?.found;
    decide(&site, &found, decision.decision == DecisionKindDto::Confirm).await?;
    Ok(Json(MatchDto::new(a_match(&map, id).await?, &map.record)))
}

/// Take back what was said of a match.
#[utoipa::path(delete, path = "/v1/sites/{site}/matches/{id}/decision", operation_id = "undecide_match",
    tag = "maps", params(("site" = String, Path), ("id" = String, Path), MapParams),
    responses((status = 204), (status = 404, body = Problem)))]
pub async fn undecide_match(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<MapParams>,
) -> Result<StatusCode, ApiError> {
    let map = site.map(params.version).await?;
    let found = a_match(&map, id).await?.found;
    undecide(&site, &found).await?;
    Ok(StatusCode::NO_CONTENT)
}
