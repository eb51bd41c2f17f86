//! What changed between two sessions of a place.

use axum::Json;
use axum::extract::State;
use locution_engine::mapping::ChangeKind;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::AppError;
use crate::app::maps::{ChangeVisit, DatedChange, NoSessions, Sessions};
use crate::error::ApiError;
use crate::extract::{Paged, SiteOf};
use crate::http::values::{Page, PageParams, PointDto};
use crate::state::AppState;

/// Which runs to compare.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct ChangesParams {
    /// Runs of the first session, separated by commas; all other runs that share the frame unless said.
    pub before: Option<String>,
    /// Runs of the second session, separated by commas; the latest run unless said.
    pub after: Option<String>,
    /// Version of the map; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// Names separated by commas.
pub fn names(list: Option<&String>) -> Option<Vec<String>> {
    list.map(|list| list.split(',').map(|name| name.trim().to_owned()).collect())
}

/// What became of something that stood or stands there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum ChangeKindDto {
    /// It stands there now and did not.
    Appeared,
    /// It stood there and does not now.
    Disappeared,
}

/// A visit that saw a changed area.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ChangeVisitDto {
    /// The run.
    pub run: String,
    /// When the visit ended, if it saw the area as it was; when it began, if it saw it as it is.
    pub timestamp_ns: i64,
}

impl From<&ChangeVisit> for ChangeVisitDto {
    fn from(visit: &ChangeVisit) -> Self {
        Self { run: visit.run.clone(), timestamp_ns: visit.timestamp_ns }
    }
}

/// An area that changed: something came or went.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ChangeDto {
    /// Whether it came or went.
    pub kind: ChangeKindDto,
    /// Component of the map in whose frame the positions are.
    pub component: u32,
    /// Mean position of what changed.
    #[serde(rename = "centre")]
    pub center: PointDto,
    /// Lower left corner of the rectangle around it.
    pub low: PointDto,
    /// Upper right corner.
    pub high: PointDto,
    /// Surface that changed, square metres.
    #[schema(minimum = 0)]
    pub area_m2: f64,
    /// Free-space density observed around it in the second session, minus the first; null where one did not pass.
    pub density_change: Option<f64>,
    /// How clearly the scans and densities of both sessions tell, from 0 to 1.
    #[schema(minimum = 0, maximum = 1)]
    pub confidence: f64,
    /// The last visit that saw it as it was; null when no single one saw enough of it.
    pub last_as_before: Option<ChangeVisitDto>,
    /// The first visit that saw it as it is; what happened, happened between the two.
    pub first_as_after: Option<ChangeVisitDto>,
}

impl ChangeDto {
    /// A change in a component.
    pub fn new(component: u32, dated: &DatedChange) -> Self {
        let change = &dated.change;
        let kind = match change.kind {
            ChangeKind::Appeared => ChangeKindDto::Appeared,
            ChangeKind::Disappeared => ChangeKindDto::Disappeared,
        };
        Self {
            kind,
            component,
            center: (&change.center).into(),
            low: (&change.low).into(),
            high: (&change.high).into(),
            area_m2: change.area_m2,
            density_change: change.density_change,
            confidence: change.confidence,
            last_as_before: dated.last_as_before.as_ref().map(ChangeVisitDto::from),
            first_as_after: dated.first_as_after.as_ref().map(ChangeVisitDto::from),
        }
    }
}

/// Doors, furniture, pallets: what came and what went between two sessions of a place, the largest first.
#[utoipa::path(get, path = "/v1/sites/{site}/changes", operation_id = "list_changes", tag = "maps",
    params(ChangesParams, PageParams),
    responses((status = 200, description = "A page of changes", body = Page<ChangeDto>),
        (status = 409, description = "No map has been built yet")))]
pub async fn list_changes(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Paged(params, page): Paged<ChangesParams>,
) -> Result<Json<Page<ChangeDto>>, ApiError> {
    let map = site.map(params.version).await?;
    let (before, after) = (names(params.before.as_ref()), names(params.after.as_ref()));
    let sessions = Sessions::new(&map.record, before.as_deref(), after.as_deref()).map_err(refusal)?;
    let changes = state.app.changes(&site, &map, &sessions).await?;
    let items = changes.iter().map(|change| ChangeDto::new(sessions.component, change));
    Ok(Json(Page::of_all(items, changes.len(), page)))
}

fn refusal(reason: NoSessions) -> ApiError {
    match reason {
        NoSessions::UnknownRun(name) => AppError::not_found("run", name).into(),
        NoSessions::Invalid(field, detail) => ApiError::invalid(field, detail),
    }
}
