//! Runs: uninterrupted recordings of one robot.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;

use crate::dto::common::{Page, PageParams};
use crate::dto::runs::{NewRunDto, RunDto};
use crate::error::{ApiError, Problem};
use crate::extract::{Body, Params, RunName, SiteOf};
use crate::state::AppState;

/// Make a run, or find it as it stands.
#[utoipa::path(put, path = "/v1/sites/{site}/runs/{run}", operation_id = "make_run", tag = "runs",
    params(("site" = String, Path), ("run" = String, Path)), request_body = NewRunDto,
    responses((status = 201, body = RunDto), (status = 200, body = RunDto), (status = 404, body = Problem),
        (status = 409, body = Problem), (status = 422, body = Problem)))]
pub async fn make_run(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Body(new): Body<NewRunDto>,
) -> Result<(StatusCode, Json<RunDto>), ApiError> {
    let new = new.check(state.app.config().limits.num_ranges_per_scan_max)?;
    let (run, is_new) = state.app.make_run(&site, &name, new).await?;
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, Json(run.into())))
}

/// All runs of a site, in the order of their making.
#[utoipa::path(get, path = "/v1/sites/{site}/runs", operation_id = "list_runs", tag = "runs",
    params(("site" = String, Path), PageParams),
    responses((status = 200, body = Page<RunDto>), (status = 404, body = Problem)))]
pub async fn list_runs(
    SiteOf(site): SiteOf,
    Params(page): Params<PageParams>,
) -> Result<Json<Page<RunDto>>, ApiError> {
    let first = page.first()?;
    let runs = site.runs(u32::try_from(first).unwrap_or(u32::MAX), page.limit()?).await?;
    let items = runs.into_iter().map(RunDto::from).collect();
    Ok(Json(Page::of(items, first, u64::from(site.state().record.num_runs))))
}

/// One run.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}", operation_id = "get_run", tag = "runs",
    params(("site" = String, Path), ("run" = String, Path)),
    responses((status = 200, body = RunDto), (status = 404, body = Problem)))]
pub async fn get_run(SiteOf(site): SiteOf, RunName(name): RunName) -> Result<Json<RunDto>, ApiError> {
    Ok(Json(site.run(&name).await?.into()))
}

/// End a run: delayed observations and pending words are brought out; later batches answer 409.
#[utoipa::path(post, path = "/v1/sites/{site}/runs/{run}/finish", operation_id = "finish_run", tag = "runs",
    params(("site" = String, Path), ("run" = String, Path)),
    responses((status = 200, body = RunDto), (status = 404, body = Problem), (status = 429, body = Problem)))]
pub async fn finish_run(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    RunName(name): RunName,
) -> Result<Json<RunDto>, ApiError> {
    Ok(Json(state.app.finish_run(site, &name).await?.into()))
}
