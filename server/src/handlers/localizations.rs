//! "Where am I": sessions fed with scans, and questions by example.

use axum::extract::State;
use axum::http::StatusCode;
use axum::{Extension, Json};

use crate::app::AppError;
use crate::auth::Identity;
use crate::dto::batches::BatchDto;
use crate::dto::localizations::{
    ExampleAnswerDto, ExampleQueryDto, LocalizationDto, NewLocalizationDto, PosePriorDto,
};
use crate::error::{ApiError, Problem};
use crate::extract::{BatchSlot, Body, IdOf, SiteOf};
use crate::state::AppState;

/// Open a localisation in the serving map; nothing of it is stored.
#[utoipa::path(post, path = "/v1/sites/{site}/localisations", operation_id = "open_localisation",
    tag = "localisation", params(("site" = String, Path)), request_body = NewLocalizationDto,
    responses((status = 201, body = LocalizationDto), (status = 404, body = Problem), (status = 409, body = Problem),
        (status = 422, body = Problem), (status = 429, body = Problem)))]
pub async fn open_localization(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Body(new): Body<NewLocalizationDto>,
) -> Result<(StatusCode, Json<LocalizationDto>), ApiError> {
    let geometry = new.geometry.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let prior = new.prior.as_ref().map(PosePriorDto::check).transpose()?;
    let info = state.app.open_localization(&site, geometry, prior).await?;
    Ok((StatusCode::CREATED, Json(info.into())))
}

/// The answer as it stands.
#[utoipa::path(get, path = "/v1/sites/{site}/localisations/{id}", operation_id = "get_localisation",
    tag = "localisation", params(("site" = String, Path), ("id" = String, Path)),
    responses((status = 200, body = LocalizationDto), (status = 404, body = Problem)))]
pub async fn get_localization(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
) -> Result<Json<LocalizationDto>, ApiError> {
    Ok(Json(state.app.localization(&site, id).await?.into()))
}

/// Feed scans, in the batches of a run, and get the answer after them.
#[utoipa::path(post, path = "/v1/sites/{site}/localisations/{id}/batches", operation_id = "localise",
    tag = "localisation", params(("site" = String, Path), ("id" = String, Path)),
    request_body(content((BatchDto = "application/json"), (BatchDto = "application/cbor"))),
    responses((status = 200, body = LocalizationDto), (status = 404, body = Problem), (status = 409, body = Problem),
        (status = 422, body = Problem)))]
pub async fn localize(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    BatchSlot(_slot): BatchSlot,
    Body(batch): Body<BatchDto>,
) -> Result<Json<LocalizationDto>, ApiError> {
    Ok(Json(state.app.localize(&site, id, batch.try_into()?).await?.into()))
}

/// Close a localisation.
#[utoipa::path(delete, path = "/v1/sites/{site}/localisations/{id}", operation_id = "close_localisation",
    tag = "localisation", params(("site" = String, Path), ("id" = String, Path)),
    responses((status = 204), (status = 404, body = Problem)))]
pub async fn close_localization(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
) -> Result<StatusCode, ApiError> {
    state.app.close_localization(&site, id)?;
    Ok(StatusCode::NO_CONTENT)
}

/// Where in the site was this recorded? The example is not stored.
#[utoipa::path(post, path = "/v1/sites/{site}/queries/example", operation_id = "query_example",
    tag = "localisation", params(("site" = String, Path)),
    request_body(content((ExampleQueryDto = "application/json"), (ExampleQueryDto = "application/cbor"))),
    responses((status = 200, body = ExampleAnswerDto), (status = 404, body = Problem), (status = 409, body = Problem),
        (status = 422, body = Problem)))]
pub async fn query_example(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    BatchSlot(_slot): BatchSlot,
    Body(query): Body<ExampleQueryDto>,
) -> Result<Json<ExampleAnswerDto>, ApiError> {
    let geometry = query.geometry.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let answers = state.app.find_example(&[site], &geometry, query.batch()?).await?;
    let answer = answers.into_iter().next().ok_or_else(|| AppError::internal("a site without an answer"))?;
    Ok(Json(answer.into()))
}

/// Where was this recorded, of all sites that the key may see? Sites without a map are passed over.
#[utoipa::path(post, path = "/v1/queries/example", operation_id = "query_example_everywhere", tag = "localisation",
    request_body(content((ExampleQueryDto = "application/json"), (ExampleQueryDto = "application/cbor"))),
    responses((status = 200, body = Vec<ExampleAnswerDto>), (status = 422, body = Problem)))]
pub async fn query_example_everywhere(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    BatchSlot(_slot): BatchSlot,
    Body(query): Body<ExampleQueryDto>,
) -> Result<Json<Vec<ExampleAnswerDto>>, ApiError> {
    let geometry = query.geometry.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let sites = state.app.sites(|name| identity.may_see(name)).await?;
    let answers = state.app.find_example(&sites, &geometry, query.batch()?).await?;
    Ok(Json(answers.into_iter().map(ExampleAnswerDto::from).collect()))
}
