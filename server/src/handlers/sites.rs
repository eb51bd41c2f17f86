//! Sites: namespaces in which places are matched.

use axum::Extension;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use locution_engine::config::EngineConfig;

use crate::auth::Identity;
use crate::dto::common::{Page, PageParams};
use crate::dto::sites::{NewSiteDto, SiteDto};
use crate::error::{ApiError, Problem};
use crate::extract::{Body, Params, SiteName, SiteOf};
use crate::state::AppState;

/// Make a site, or find it as it stands.
#[utoipa::path(put, path = "/v1/sites/{site}", operation_id = "make_site", tag = "sites",
    params(("site" = String, Path, description = "1 to 64 of `A–Z a–z 0–9 . _ -`, not beginning with a dot")),
    request_body = NewSiteDto,
    responses((status = 201, body = SiteDto), (status = 200, body = SiteDto), (status = 409, body = Problem),
        (status = 422, body = Problem)))]
pub async fn make_site(
    State(state): State<AppState>,
    SiteName(name): SiteName,
    Body(new): Body<NewSiteDto>,
) -> Result<(StatusCode, Json<SiteDto>), ApiError> {
    let (site, is_new) = state.app.make_site(&name, new.config.map(parse_config).transpose()?).await?;
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, Json(site.info().await?.into())))
}

fn parse_config(config: serde_json::Value) -> Result<EngineConfig, ApiError> {
    serde_path_to_error::deserialize(config).map_err(|error| {
        let field = format!("config.{}", error.path());
        ApiError::malformed(format!("{field}: {}", error.inner())).at(field)
    })
}

/// All sites that the key may see.
#[utoipa::path(get, path = "/v1/sites", operation_id = "list_sites", tag = "sites", params(PageParams),
    responses((status = 200, body = Page<SiteDto>)))]
pub async fn list_sites(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    Params(page): Params<PageParams>,
) -> Result<Json<Page<SiteDto>>, ApiError> {
    let (first, limit) = (page.first()?, page.limit()?);
    let sites = state.app.listed_sites(|name| identity.may_see(name)).await?;
    let num_sites = sites.len() as u64;
    let mut items = Vec::new();
    for listed in sites.into_iter().skip(usize::try_from(first).unwrap_or(usize::MAX)).take(limit) {
        items.push(SiteDto::of(listed).await);
    }
    Ok(Json(Page::of(items, first, num_sites)))
}

/// One site.
#[utoipa::path(get, path = "/v1/sites/{site}", operation_id = "get_site", tag = "sites",
    params(("site" = String, Path)), responses((status = 200, body = SiteDto), (status = 404, body = Problem)))]
pub async fn get_site(SiteOf(site): SiteOf) -> Result<Json<SiteDto>, ApiError> {
    Ok(Json(site.info().await?.into()))
}

/// Forget a site and everything in it.
#[utoipa::path(delete, path = "/v1/sites/{site}", operation_id = "delete_site", tag = "sites",
    params(("site" = String, Path)), responses((status = 204), (status = 404, body = Problem)))]
pub async fn delete_site(
    State(state): State<AppState>,
    SiteName(name): SiteName,
) -> Result<StatusCode, ApiError> {
    state.app.delete_site(&name).await?;
    Ok(StatusCode::NO_CONTENT)
}
