//! What a run became: observations, words, trajectory.

use axum::Json;
use axum::response::{IntoResponse, Response};

use crate::app::runs::trajectory;
use crate::dto::common::{Page, PageParams};
use crate::dto::texts::{
    ObservationDto, TrajectoryDto, TrajectoryParams, WordDto, WordParams, trajectory_as_tum, words_as_text,
};
use crate::error::{ApiError, Problem};
use crate::extract::{Params, RunName, SiteOf, WantsText};

use super::text;

/// Density samples, in order of travel.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/observations", operation_id = "list_observations",
    tag = "texts", params(("site" = String, Path), ("run" = String, Path), PageParams),
    responses((status = 200, body = Page<ObservationDto>), (status = 404, body = Problem)))]
pub async fn list_observations(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Params(page): Params<PageParams>,
) -> Result<Json<Page<ObservationDto>>, ApiError> {
    let (first, limit) = (page.first()?, page.limit()?);
    let run = site.run(&name).await?;
    let items = run.observations(first, limit).await?;
    let items = (first..).zip(items).map(|(number, item)| ObservationDto::new(number, item)).collect();
    Ok(Json(Page::of(items, first, run.text.num_observations)))
}

/// The text of a run, one level at a time; `Accept: text/plain` gives all words of the level, one a line.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/words", operation_id = "list_words", tag = "texts",
    params(("site" = String, Path), ("run" = String, Path), WordParams),
    responses((status = 200, content((Page<WordDto> = "application/json"), (String = "text/plain"))),
        (status = 404, body = Problem)))]
pub async fn list_words(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    WantsText(wants_text): WantsText,
    Params(params): Params<WordParams>,
) -> Result<Response, ApiError> {
    let page = PageParams { limit: params.limit, cursor: params.cursor };
    let (first, limit) = if wants_text { (0, usize::MAX) } else { (page.first()?, page.limit()?) };
    let run = site.run(&name).await?;
    let words = run.words(params.level, first, limit).await?;
    if wants_text {
        return Ok(text(words_as_text(&words)));
    }
    let items = words.into_iter().map(WordDto::from).collect();
    Ok(Json(Page::of(items, first, run.num_words(params.level))).into_response())
}

/// A pose for every scan, in the frame asked for; `Accept: text/plain` gives TUM's format.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/trajectory", operation_id = "get_trajectory", tag = "texts",
    params(("site" = String, Path), ("run" = String, Path), TrajectoryParams),
    responses((status = 200, content((TrajectoryDto = "application/json"), (String = "text/plain"))),
        (status = 404, body = Problem), (status = 409, body = Problem)))]
pub async fn get_trajectory(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    WantsText(wants_text): WantsText,
    Params(params): Params<TrajectoryParams>,
) -> Result<Response, ApiError> {
    let run = site.run(&name).await?;
    let trajectory = trajectory(&site, &run, params.frame.into(), params.version).await?;
    if wants_text {
        return Ok(text(trajectory_as_tum(&trajectory.poses)));
    }
    Ok(Json(TrajectoryDto::from(trajectory)).into_response())
}

/// The same in TUM's format, for tools that go by the name.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/trajectory.tum", operation_id = "get_trajectory_tum",
    tag = "texts", params(("site" = String, Path), ("run" = String, Path), TrajectoryParams),
    responses((status = 200, body = String, content_type = "text/plain"), (status = 404, body = Problem)))]
pub async fn get_trajectory_tum(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Params(params): Params<TrajectoryParams>,
) -> Result<Response, ApiError> {
    let run = site.run(&name).await?;
    let trajectory = trajectory(&site, &run, params.frame.into(), params.version).await?;
    Ok(text(trajectory_as_tum(&trajectory.poses)))
}
