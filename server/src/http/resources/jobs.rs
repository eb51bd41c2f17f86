//! Builds and other long work.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::site::{JobInfo, Site};
use crate::error::ApiError;
use crate::extract::{IdOf, NoParams, Paged, Params, SiteOf};
use crate::http::values::{Page, PageParams};
use crate::http::with_location;
use crate::records::{JobKind, JobState};
use crate::state::AppState;

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobStateDto {
    /// It waits for its turn.
    Queued,
    /// It is at work.
    Running,
    /// It did what it should.
    Done,
    /// It did not; `error` says why.
    Failed,
    /// Somebody ended it before it was done.
    Cancelled,
}

/// What a job does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobKindDto {
    /// Makes a map of everything stored.
    Build,
}

/// A long piece of work.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct JobDto {
    /// Its name in the site.
    #[schema(example = "7")]
    pub id: String,
    /// What it does.
    pub kind: JobKindDto,
    /// How far it is.
    pub state: JobStateDto,
    /// From 0 to 1.
    #[schema(minimum = 0, maximum = 1)]
    pub progress: f64,
    /// Seconds that it will still take at work, by the time that it has taken so far; null while that cannot be told.
    #[schema(minimum = 0)]
    pub left_s: Option<f64>,
    /// What it is at, or what came of it.
    pub detail: String,
    /// Why it failed.
    pub error: Option<String>,
}

impl From<JobInfo> for JobDto {
    fn from(info: JobInfo) -> Self {
        let kind = match info.record.kind {
            JobKind::Build => JobKindDto::Build,
        };
        let state = match info.record.state {
            JobState::Queued => JobStateDto::Queued,
            JobState::Running => JobStateDto::Running,
            JobState::Done => JobStateDto::Done,
            JobState::Failed => JobStateDto::Failed,
            JobState::Cancelled => JobStateDto::Cancelled,
        };
        Self {
            id: info.record.id.to_string(),
            kind,
            state,
            progress: info.progress,
            left_s: info.left.map(|left| left.as_secs_f64()),
            detail: info.record.detail,
            error: info.record.error,
        }
    }
}

/// How to answer a request for a build.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct BuildParams {
    /// Answer when it is done rather than when it is queued.
    #[serde(default)]
    pub wait: bool,
}

/// Build the map of everything stored now; the old version serves until the new one is complete.
#[utoipa::path(post, path = "/v1/sites/{site}/builds", operation_id = "build_map", tag = "jobs",
    params(BuildParams),
    responses((status = 200, description = "The job has ended, well or not", body = JobDto),
        (status = 202, description = "The job is queued", body = JobDto,
            headers(("Location" = String, description = "Where the job can be watched")))))]
pub async fn build_map(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<BuildParams>,
) -> Result<Response, ApiError> {
    let job = state.app.queue_job(&site, JobKind::Build).await?;
    if !params.wait {
        return Ok(accepted(&site, job));
    }
    Ok(Json(JobDto::from(site.jobs().ended(job.record.id).await?)).into_response())
}

/// 202 with a job and where to watch it.
pub fn accepted(site: &Site, job: JobInfo) -> Response {
    let location = format!("/v1/sites/{}/jobs/{}", site.name(), job.record.id);
    with_location(&location, (StatusCode::ACCEPTED, Json(JobDto::from(job))))
}

/// All jobs that are remembered, the newest first.
#[utoipa::path(get, path = "/v1/sites/{site}/jobs", operation_id = "list_jobs", tag = "jobs",
    params(PageParams),
    responses((status = 200, description = "A page of jobs", body = Page<JobDto>)))]
pub async fn list_jobs(
    SiteOf(site): SiteOf,
    Paged(NoParams {}, page): Paged<NoParams>,
) -> Result<Json<Page<JobDto>>, ApiError> {
    let jobs = site.jobs().all();
    let total = jobs.len();
    Ok(Json(Page::of_all(jobs.into_iter().map(JobDto::from), total, page)))
}

/// One job.
#[utoipa::path(get, path = "/v1/sites/{site}/jobs/{id}", operation_id = "get_job", tag = "jobs",
    responses((status = 200, description = "The job", body = JobDto)))]
pub async fn get_job(SiteOf(site): SiteOf, IdOf(id): IdOf) -> Result<Json<JobDto>, ApiError> {
    Ok(Json(site.jobs().get(id)?.into()))
}

/// Cancel a job. One that waits is over at once, one that runs ends at its next step; one that has ended stays as it is.
/// What it had made so far is not served.
#[utoipa::path(delete, path = "/v1/sites/{site}/jobs/{id}", operation_id = "cancel_job", tag = "jobs",
    responses((status = 200, description = "The job as it ended, or as it stands when that takes longer", body = JobDto)))]
pub async fn cancel_job(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
) -> Result<Json<JobDto>, ApiError> {
    Ok(Json(state.app.cancel_job(&site, id).await?.into()))
}
