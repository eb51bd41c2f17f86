//! Backups: a site as one stream, and a site made of one.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::app::backups::backup;
use crate::error::ApiError;
use crate::extract::{SiteName, SiteOf};
use crate::http::resources::sites::SiteSummaryDto;
use crate::state::AppState;

/// Back up a site as it stands now, while it serves.
///
/// The stream ends with a block that says what it should hold; one that was cut off cannot be restored.
#[utoipa::path(get, path = "/v1/sites/{site}/backup", operation_id = "backup_site", tag = "sites",
    responses((status = 200, description = "The site as one stream", body = Vec<u8>,
        content_type = "application/octet-stream")))]
pub async fn backup_site(SiteOf(site): SiteOf) -> Result<Response, ApiError> {
    let headers = [(header::CONTENT_TYPE, "application/octet-stream")];
    Ok((headers, Body::from_stream(backup(&site).await?)).into_response())
}

/// Make a site of a backup.
#[utoipa::path(put, path = "/v1/sites/{site}/backup", operation_id = "restore_site", tag = "sites",
    request_body(content = Vec<u8>, content_type = "application/octet-stream"),
    responses((status = 201, description = "The site was made", body = SiteSummaryDto),
        (status = 409, description = "A site of the name stands already"),
        (status = 422, description = "The stream is damaged or cut off")))]
pub async fn restore_site(
    State(state): State<AppState>,
    SiteName(name): SiteName,
    body: Body,
) -> Result<(StatusCode, Json<SiteSummaryDto>), ApiError> {
    let site = state.app.restore_site(&name, body.into_data_stream()).await?;
    Ok((StatusCode::CREATED, Json(SiteSummaryDto::from(&site.info().await?))))
}
