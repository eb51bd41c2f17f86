//! What changed between two sessions of a place.

use axum::Json;
use axum::extract::State;

use crate::app::AppError;
use crate::app::maps::{NoSessions, Sessions};
use crate::dto::changes::{ChangeDto, ChangesParams, names};
use crate::dto::common::{Page, PageParams};
use crate::error::{ApiError, Problem};
use crate::extract::{Params, SiteOf};
use crate::state::AppState;

/// Doors, furniture, pallets: what came and what went between two sessions of a place, the largest first.
#[utoipa::path(get, path = "/v1/sites/{site}/changes", operation_id = "list_changes", tag = "maps",
    params(("site" = String, Path), ChangesParams),
    responses((status = 200, body = Page<ChangeDto>), (status = 404, body = Problem),
        (status = 409, body = Problem), (status = 422, body = Problem)))]
pub async fn list_changes(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Params(params): Params<ChangesParams>,
) -> Result<Json<Page<ChangeDto>>, ApiError> {
    let page = PageParams { limit: params.limit, cursor: params.cursor };
    let (first, limit) = (page.first()?, page.limit()?);
    let map = site.map(params.version).await?;
    let (before, after) = (names(params.before.as_ref()), names(params.after.as_ref()));
    let sessions = Sessions::new(&map.record, before.as_deref(), after.as_deref()).map_err(refusal)?;
    let changes = state.app.changes(&site, &map, &sessions).await?;
    let skipped = usize::try_from(first).unwrap_or(usize::MAX);
    let items = changes.iter().skip(skipped).take(limit);
    let items = items.map(|change| ChangeDto::new(sessions.component, change)).collect();
    Ok(Json(Page::of(items, first, changes.len() as u64)))
}

fn refusal(reason: NoSessions) -> ApiError {
    match reason {
        NoSessions::UnknownRun(name) => AppError::not_found("run", name).into(),
        NoSessions::Invalid(field, detail) => ApiError::invalid(field, detail),
    }
}
