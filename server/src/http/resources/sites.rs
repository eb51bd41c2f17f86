//! Sites: namespaces in which places are matched.

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use locution_engine::config::EngineConfig;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::app::site::SiteInfo;
use crate::auth::Identity;
use crate::error::ApiError;
use crate::extract::{Body, NoParams, Paged, SiteName, SiteOf};
use crate::http::values::{Page, PageParams};
use crate::http::with_location;
use crate::http::wording::plain;
use crate::state::AppState;

/// Makes a site.
#[derive(Clone, Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSiteDto {
    /// The engine's configuration; what is left out keeps its default.
    #[schema(value_type = Option<Object>)]
    pub config: Option<serde_json::Value>,
}

/// What a site holds.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct SiteSummaryDto {
    /// Its name.
    #[schema(example = "hospital-floor-2")]
    pub site: String,
    /// Runs.
    pub num_runs: u32,
    /// Scans of all runs.
    pub num_scans: u64,
    /// Observations of all runs.
    pub num_observations: u64,
    /// Words of all levels of all runs.
    pub num_words: u64,
    /// Bytes on disk.
    pub bytes_on_disk: u64,
    /// The text generation that serves.
    pub generation: u32,
    /// The map version that serves; null before the first build.
    pub map_version: Option<u64>,
}

/// A site, how it is configured and what it holds.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct SiteDto {
    /// Its name.
    #[schema(example = "hospital-floor-2")]
    pub site: String,
    /// The engine's configuration in it, complete.
    #[schema(value_type = Object)]
    pub config: serde_json::Value,
    /// Runs.
    pub num_runs: u32,
    /// Scans of all runs.
    pub num_scans: u64,
    /// Observations of all runs.
    pub num_observations: u64,
    /// Words of all levels of all runs.
    pub num_words: u64,
    /// Bytes on disk.
    pub bytes_on_disk: u64,
    /// The text generation that serves.
    pub generation: u32,
    /// The map version that serves; null before the first build.
    pub map_version: Option<u64>,
}

impl From<&SiteInfo> for SiteSummaryDto {
    fn from(info: &SiteInfo) -> Self {
        Self {
            site: info.name.to_string(),
            num_runs: info.record.num_runs,
            num_scans: info.num_scans,
            num_observations: info.num_observations,
            num_words: info.num_words,
            bytes_on_disk: info.num_bytes_on_disk,
            generation: info.record.generation,
            map_version: (info.record.map_version > 0).then_some(info.record.map_version),
        }
    }
}

impl From<SiteInfo> for SiteDto {
    fn from(info: SiteInfo) -> Self {
        let summary = SiteSummaryDto::from(&info);
        Self {
            site: summary.site,
            config: serde_json::to_value(&*info.config).unwrap_or_default(),
            num_runs: summary.num_runs,
            num_scans: summary.num_scans,
            num_observations: summary.num_observations,
            num_words: summary.num_words,
            bytes_on_disk: summary.bytes_on_disk,
            generation: summary.generation,
            map_version: summary.map_version,
        }
    }
}

/// Make a site, or find it as it stands.
#[utoipa::path(put, path = "/v1/sites/{site}", operation_id = "make_site", tag = "sites",
    request_body = NewSiteDto,
    responses((status = 200, description = "The site as it stands", body = SiteSummaryDto),
        (status = 201, description = "The site was made", body = SiteSummaryDto,
            headers(("Location" = String, description = "The site"))),
        (status = 409, description = "The site stands with another configuration")))]
pub async fn make_site(
    State(state): State<AppState>,
    SiteName(name): SiteName,
    Body(new): Body<NewSiteDto>,
) -> Result<Response, ApiError> {
    let (site, is_new) = state.app.make_site(&name, new.config.map(parse_config).transpose()?).await?;
    let answer = Json(SiteSummaryDto::from(&site.info().await?));
    if !is_new {
        return Ok(answer.into_response());
    }
    Ok(with_location(&format!("/v1/sites/{name}"), (StatusCode::CREATED, answer)))
}

fn parse_config(config: serde_json::Value) -> Result<EngineConfig, ApiError> {
    serde_path_to_error::deserialize(config).map_err(|error| {
        let field = format!("config.{}", error.path());
        ApiError::malformed(format!("{field}: {}", plain(&error.inner().to_string()))).at(field)
    })
}

/// All sites that the key may see.
#[utoipa::path(get, path = "/v1/sites", operation_id = "list_sites", tag = "sites",
    params(PageParams),
    responses((status = 200, description = "A page of sites", body = Page<SiteSummaryDto>)))]
pub async fn list_sites(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    Paged(NoParams {}, page): Paged<NoParams>,
) -> Result<Json<Page<SiteSummaryDto>>, ApiError> {
    let sites = state.app.sites(|name| identity.may_see(name)).await?;
    let mut items = Vec::new();
    for site in sites.iter().skip(usize::try_from(page.first).unwrap_or(usize::MAX)).take(page.limit) {
        items.push(SiteSummaryDto::from(&site.info().await?));
    }
    Ok(Json(Page::of(items, page.first, sites.len() as u64)))
}

/// One site.
#[utoipa::path(get, path = "/v1/sites/{site}", operation_id = "get_site", tag = "sites",
    responses((status = 200, description = "The site", body = SiteDto)))]
pub async fn get_site(SiteOf(site): SiteOf) -> Result<Json<SiteDto>, ApiError> {
    Ok(Json(site.info().await?.into()))
}

/// Forget a site and everything in it.
#[utoipa::path(delete, path = "/v1/sites/{site}", operation_id = "delete_site", tag = "sites",
    responses((status = 204, description = "Nothing of the site is left")))]
pub async fn delete_site(
    State(state): State<AppState>,
    SiteName(name): SiteName,
) -> Result<StatusCode, ApiError> {
    state.app.delete_site(&name).await?;
    Ok(StatusCode::NO_CONTENT)
}
