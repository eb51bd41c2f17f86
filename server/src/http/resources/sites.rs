//! Sites: namespaces in which places are matched.

use std::collections::BTreeSet;

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use locution_engine::config::EngineConfig;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::jobs::JobDto;
use crate::app::site::SiteInfo;
use crate::app::{AppError, ListedSite, Name};
use crate::auth::Identity;
use crate::elsewhere::Answers;
use crate::error::ApiError;
use crate::extract::{Body, NoParams, Paged, SiteName, SiteOf};
use crate::http::as_documented::AsDocumented;
use crate::http::values::{Page, PageParams};
use crate::http::with_location;
use crate::http::wording::plain;
use crate::records::Retention;
use crate::state::AppState;

/// Makes a site.
#[derive(Clone, Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSiteDto {
    /// The engine's configuration; what is left out keeps its default.
    #[schema(value_type = Option<Object>)]
    pub config: Option<serde_json::Value>,
}

/// How much of a site is kept; what is left out is kept whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RetentionDto {
    /// Map versions, the serving one included; as the server is configured unless said.
    #[schema(minimum = 1)]
    pub num_versions: Option<u32>,
    /// Runs: finished ones beyond are deleted, the oldest first, when a map is built.
    #[schema(minimum = 1)]
    pub num_runs: Option<u32>,
    /// Scans of all runs together: finished runs are deleted, the oldest first, when a map is built. The latest run stays.
    #[schema(minimum = 1)]
    pub num_scans: Option<u64>,
}

impl From<Retention> for RetentionDto {
    fn from(retention: Retention) -> Self {
        let Retention { num_versions, num_runs, num_scans } = retention;
        Self { num_versions, num_runs, num_scans }
    }
}

impl RetentionDto {
    /// The checked numbers.
    ///
    /// # Errors
    /// 422 for a number of zero.
    fn check(self) -> Result<Retention, ApiError> {
        let Self { num_versions, num_runs, num_scans } = self;
        let numbers = [
            ("num_versions", num_versions.map(u64::from)),
            ("num_runs", num_runs.map(u64::from)),
            ("num_scans", num_scans),
        ];
        match numbers.iter().find(|(_, number)| *number == Some(0)) {
            Some((name, _)) => Err(ApiError::invalid(
                format!("retention.{name}"),
                "at least 1 is kept; leave it out to keep all",
            )),
            None => Ok(Retention { num_versions, num_runs, num_scans }),
        }
    }
}

/// Changes a site; what is left out stays.
#[derive(Clone, Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SiteChangeDto {
    /// Members of the engine's configuration that change, as a JSON merge patch (RFC 7396): null sets a member to its
    /// default. Everything but `translator` can be changed.
    #[schema(value_type = Option<Object>)]
    pub config: Option<serde_json::Value>,
    /// Instead of what stands.
    pub retention: Option<RetentionDto>,
}

/// A site after it was changed.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ChangedSiteDto {
    /// The site.
    pub site: SiteDto,
    /// What makes a map accordingly; null when nothing changed or there is no map.
    pub job: Option<JobDto>,
}

/// Lays a merge patch over a value.
fn merge(value: &mut serde_json::Value, patch: serde_json::Value) {
    use serde_json::Value;
    let Value::Object(changes) = patch else {
        *value = patch;
        return;
    };
    if !value.is_object() {
        *value = Value::Object(serde_json::Map::new());
    }
    let Some(members) = value.as_object_mut() else { return };
    for (name, change) in changes {
        if change.is_null() {
            members.remove(&name);
        } else {
            merge(members.entry(name).or_insert(Value::Null), change);
        }
    }
}

/// Whether a site can be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SiteStateDto {
    /// It answers.
    Serving,
    /// It cannot be opened; it can be deleted, and its numbers are 0.
    Unreadable,
}

/// What a site holds.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct SiteSummaryDto {
    /// Its name.
    #[schema(example = "hospital-floor-2")]
    pub site: String,
    /// Whether it can be asked.
    pub state: SiteStateDto,
    /// Why it is unreadable, and what can be done about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
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
    /// How much of it is kept.
    pub retention: RetentionDto,
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
            state: SiteStateDto::Serving,
            reason: None,
            num_runs: info.num_runs(),
            num_scans: info.num_scans,
            num_observations: info.num_observations,
            num_words: info.num_words,
            bytes_on_disk: info.num_bytes_on_disk,
            generation: info.record.generation,
            map_version: (info.record.map_version > 0).then_some(info.record.map_version),
        }
    }
}

impl SiteSummaryDto {
    /// A site of a list, whether or not it can be opened.
    async fn of(listed: ListedSite) -> Self {
        let info = match listed.site {
            Ok(site) => site.info().await,
            Err(error) => Err(error),
        };
        match info {
            Ok(info) => Self::from(&info),
            Err(error) => Self::unreadable(listed.name.to_string(), error.to_string()),
        }
    }

    fn unreadable(site: String, reason: String) -> Self {
        Self {
            site,
            state: SiteStateDto::Unreadable,
            reason: Some(reason),
            num_runs: 0,
            num_scans: 0,
            num_observations: 0,
            num_words: 0,
            bytes_on_disk: 0,
            generation: 0,
            map_version: None,
        }
    }
}

impl From<SiteDto> for SiteSummaryDto {
    fn from(site: SiteDto) -> Self {
        Self {
            site: site.site,
            state: SiteStateDto::Serving,
            reason: None,
            num_runs: site.num_runs,
            num_scans: site.num_scans,
            num_observations: site.num_observations,
            num_words: site.num_words,
            bytes_on_disk: site.bytes_on_disk,
            generation: site.generation,
            map_version: site.map_version,
        }
    }
}

impl From<SiteInfo> for SiteDto {
    fn from(info: SiteInfo) -> Self {
        let summary = SiteSummaryDto::from(&info);
        Self {
            site: summary.site,
            config: serde_json::to_value(&*info.config).unwrap_or_default(),
            retention: info.record.retention.into(),
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
    request_body = Option<NewSiteDto>,
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
    let parsed = serde_path_to_error::deserialize(config).map_err(|error| {
        let path = error.path().to_string();
        let field = if path == "." { "config".to_owned() } else { format!("config.{path}") };
        ApiError::malformed(format!("{field}: {}", plain(&error.inner().to_string()))).at(field)
    });
    parsed.map(|AsDocumented(config)| config)
}

/// All sites that the key may see.
#[utoipa::path(get, path = "/v1/sites", operation_id = "list_sites", tag = "sites",
    params(PageParams),
    responses((status = 200, description = "A page of sites", body = Page<SiteSummaryDto>)))]
pub async fn list_sites(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    headers: HeaderMap,
    Paged(NoParams {}, page): Paged<NoParams>,
) -> Result<Json<Page<SiteSummaryDto>>, ApiError> {
    let skipped = usize::try_from(page.first).unwrap_or(usize::MAX);
    let mut items = Vec::new();
    let Some(elsewhere) = &state.elsewhere else {
        let sites = state.app.listed_sites(|name| identity.may_see(name)).await?;
        let num_sites = sites.len() as u64;
        for listed in sites.into_iter().skip(skipped).take(page.limit) {
            items.push(SiteSummaryDto::of(listed).await);
        }
        return Ok(Json(Page::of(items, page.first, num_sites)));
    };
    let mut names = state.app.site_names().await?;
    names.retain(|name| identity.may_see(name.as_str()));
    let num_sites = names.len() as u64;
    let names: BTreeSet<Name> = names.into_iter().skip(skipped).take(page.limit).collect();
    let far = names.iter().filter(|name| !elsewhere.serves(name.as_str())).cloned().collect();
    let answers = Answers::<SiteDto>::read(elsewhere.ask(far, "", &headers, None).await);
    items.extend(answers.found.into_iter().map(SiteSummaryDto::from));
    let silent = "its server does not answer, or it is moving between servers";
    items.extend(
        answers.unanswered.iter().map(|name| SiteSummaryDto::unreadable(name.to_string(), silent.into())),
    );
    for listed in state.app.listed_sites(|name| names.iter().any(|wanted| wanted.as_str() == name)).await? {
        items.push(SiteSummaryDto::of(listed).await);
    }
    items.sort_by(|a, b| a.site.cmp(&b.site));
    // One that moved between the two questions is among both answers.
    items.dedup_by(|a, b| a.site == b.site);
    let next = page.first + names.len() as u64;
    Ok(Json(Page { items, next_cursor: (next < num_sites).then(|| next.to_string()) }))
}

/// One site.
#[utoipa::path(get, path = "/v1/sites/{site}", operation_id = "get_site", tag = "sites",
    responses((status = 200, description = "The site", body = SiteDto)))]
pub async fn get_site(SiteOf(site): SiteOf) -> Result<Json<SiteDto>, ApiError> {
    Ok(Json(site.info().await?.into()))
}

/// Change a site's configuration or how much of it is kept. When there is a map, a build is queued that makes it accordingly.
#[utoipa::path(patch, path = "/v1/sites/{site}", operation_id = "change_site", tag = "sites",
    request_body = Option<SiteChangeDto>,
    responses((status = 200, description = "The site as it stands now", body = ChangedSiteDto)))]
pub async fn change_site(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    Body(change): Body<SiteChangeDto>,
) -> Result<Json<ChangedSiteDto>, ApiError> {
    let config = match change.config {
        Some(patch) => {
            let mut config = serde_json::to_value(&*site.state().config).map_err(AppError::internal)?;
            merge(&mut config, patch);
            Some(parse_config(config)?)
        }
        None => None,
    };
    let retention = change.retention.map(RetentionDto::check).transpose()?;
    let job = state.app.change_site(&site, config, retention).await?;
    Ok(Json(ChangedSiteDto { site: site.info().await?.into(), job: job.map(JobDto::from) }))
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

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_patch_changes_what_it_names_as_rfc_7396_says() {
        for (value, patch, merged) in [
            (json!({"a": "b"}), json!({"a": "c"}), json!({"a": "c"})),
            (json!({"a": "b", "b": "c"}), json!({"a": null}), json!({"b": "c"})),
            (json!({"a": {"b": "c"}}), json!({"a": {"b": "d", "c": null}}), json!({"a": {"b": "d"}})),
            (json!({"a": [{"b": "c"}]}), json!({"a": [1]}), json!({"a": [1]})),
            (json!({}), json!({"a": {"bb": {"ccc": null}}}), json!({"a": {"bb": {}}})),
        ] {
            let mut value = value;
            merge(&mut value, patch);
            assert_eq!(value, merged);
        }
    }
}
