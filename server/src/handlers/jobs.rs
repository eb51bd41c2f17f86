//! Builds and other long work.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;

use crate::dto::common::{Page, PageParams};
use crate::dto::jobs::{BuildParams, JobDto};
use crate::error::{ApiError, Problem};
use crate::extract::{IdOf, Params, SiteOf};
use crate::records::JobKind;
use crate::state::AppState;

/// Build the map of everything stored now; the old version serves until the new one is complete.
#[utoipa::path(post, path = "/v1/sites/{site}/builds", operation_id = "build_map", tag = "jobs",
    params(("site" = String, Path), BuildParams),
    responses((status = 202, body = JobDto), (status = 200, body = JobDto), (status = 404, body = Problem)))]
pub async fn build_map(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<BuildParams>,
) -> Result<(StatusCode, Json<JobDto>), ApiError> {
    let job = state.app.queue_job(&site, JobKind::Build).await?;
    if !params.wait {
        return Ok((StatusCode::ACCEPTED, Json(job.into())));
    }
    Ok((StatusCode::OK, Json(site.jobs().ended(job.record.id).await?.into())))
}

/// All jobs that are remembered, the newest first.
#[utoipa::path(get, path = "/v1/sites/{site}/jobs", operation_id = "list_jobs", tag = "jobs",
    params(("site" = String, Path), PageParams),
    responses((status = 200, body = Page<JobDto>), (status = 404, body = Problem)))]
pub async fn list_jobs(
    SiteOf(site): SiteOf,
    Params(page): Params<PageParams>,
) -> Result<Json<Page<JobDto>>, ApiError> {
    let (first, limit) = (page.first()?, page.limit()?);
    let jobs = site.jobs().all();
    let total = jobs.len() as u64;
    let skipped = usize::try_from(first).unwrap_or(usize::MAX);
    let items = jobs.into_iter().skip(skipped).take(limit).map(JobDto::from).collect();
    Ok(Json(Page::of(items, first, total)))
}

/// One job.
#[utoipa::path(get, path = "/v1/sites/{site}/jobs/{id}", operation_id = "get_job", tag = "jobs",
    params(("site" = String, Path), ("id" = String, Path)),
    responses((status = 200, body = JobDto), (status = 404, body = Problem)))]
pub async fn get_job(SiteOf(site): SiteOf, IdOf(id): IdOf) -> Result<Json<JobDto>, ApiError> {
    Ok(Json(site.jobs().get(id)?.into()))
}
