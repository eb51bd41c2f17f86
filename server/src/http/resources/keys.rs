//! Keys over HTTP: made, listed, given another secret, revoked. A site's own admin manages the keys of that site.

use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::{Extension, Json};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::{Name, on_blocking_thread};
use crate::auth::{Identity, IssuedKey, now_s};
use crate::config::{ApiKeyConfig, Scope};
use crate::error::ApiError;
use crate::extract::{Body, Params};
use crate::state::AppState;

/// Longest that a key may live when it says so, and longest grace of a rotation, seconds: ten years.
const LIFE_MAX_S: u64 = 315_360_000;

/// Makes a key.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewKeyDto {
    /// 1 to 64 of `A–Z a–z 0–9 . _ -`; stands in the log.
    #[schema(example = "robot-7")]
    pub name: String,
    /// `read`, `write` or `admin`.
    pub scope: Scope,
    /// Sites it may do it in; `*` means all.
    #[schema(example = json!(["office"]))]
    pub sites: Vec<String>,
    /// How long it is valid, seconds; for good unless said.
    #[schema(minimum = 1, maximum = 315_360_000)]
    pub expires_in_s: Option<u64>,
    /// Most requests in a second, on average.
    pub requests_per_s_max: Option<f64>,
    /// Most localisations at once.
    #[serde(rename = "num_localisations_max")]
    pub num_localizations_max: Option<usize>,
}

/// A key, without its secret.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct KeyDto {
    /// Its name.
    pub name: String,
    /// What it may do.
    pub scope: Scope,
    /// Where.
    pub sites: Vec<String>,
    /// Whether it stands in the server's configuration, where the API cannot change it.
    pub is_configured: bool,
    /// When it was made, seconds since 1970; null for keys of the configuration.
    pub created_at_s: Option<u64>,
    /// When it stops being valid, seconds since 1970.
    pub expires_at_s: Option<u64>,
    /// Until when the secret before the last rotation is valid, seconds since 1970.
    pub previous_valid_until_s: Option<u64>,
    /// Most requests in a second.
    pub requests_per_s_max: Option<f64>,
    /// Most localisations at once.
    #[serde(rename = "num_localisations_max")]
    pub num_localizations_max: Option<usize>,
}

/// A key with its secret, which is shown this once and kept nowhere.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct IssuedKeyDto {
    /// The secret, sent as `Authorization: Bearer …`.
    #[schema(example = "loc_5f2b…")]
    pub secret: String,
    /// The key.
    pub key: KeyDto,
}

/// All keys that may be managed.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct KeysDto {
    /// In the order of making, those of the configuration first.
    pub items: Vec<KeyDto>,
}

/// How a secret is changed.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct RotateParams {
    /// How long the old secret stays valid beside the new one, seconds; not at all unless said.
    #[param(maximum = 315_360_000)]
    pub grace_s: Option<u64>,
}

/// Keys that the API makes are known to one server only.
fn check_alone(state: &AppState) -> Result<(), ApiError> {
    if state.elsewhere.is_none() {
        return Ok(());
    }
    let detail = "servers that share an object store take their keys from the configuration; change it and send SIGHUP";
    Err(ApiError::new(StatusCode::CONFLICT, "configured-keys", "Keys stand in the configuration", detail))
}

impl KeyDto {
    fn of(record: &IssuedKey, is_configured: bool) -> Self {
        let key = &record.key;
        Self {
            name: key.name.clone(),
            scope: key.scope,
            sites: key.sites.clone(),
            is_configured,
            created_at_s: (!is_configured).then_some(record.created_at_s),
            expires_at_s: key.expires_at_s,
            previous_valid_until_s: record.previous.as_ref().map(|previous| previous.until_s),
            requests_per_s_max: key.requests_per_s_max,
            num_localizations_max: key.num_localizations_max,
        }
    }
}

impl NewKeyDto {
    fn check(self) -> Result<ApiKeyConfig, ApiError> {
        Name::new(&self.name, "name")?;
        if self.sites.is_empty() || self.sites.len() > 1_000 {
            return Err(ApiError::invalid("sites", "a key is for 1 to 1000 sites, or for `*`"));
        }
        for (idx, site) in self.sites.iter().enumerate().filter(|(_, site)| *site != "*") {
            Name::new(site, &format!("sites[{idx}]"))?;
        }
        if self.expires_in_s.is_some_and(|seconds| seconds == 0 || seconds > LIFE_MAX_S) {
            return Err(ApiError::invalid("expires_in_s", format!("a key lives 1 to {LIFE_MAX_S} seconds")));
        }
        if self.requests_per_s_max.is_some_and(|rate| !(rate > 0.0 && rate <= 1e6)) {
            return Err(ApiError::invalid(
                "requests_per_s_max",
                "a rate lies above 0 and at most at 1000000",
            ));
        }
        Ok(ApiKeyConfig {
            name: self.name,
            sha256: String::new(),
            scope: self.scope,
            sites: self.sites,
            expires_at_s: self.expires_in_s.map(|seconds| now_s() + seconds),
            requests_per_s_max: self.requests_per_s_max,
            num_localizations_max: self.num_localizations_max,
        })
    }
}

/// Make a key; its secret is in this answer and nowhere else.
#[utoipa::path(post, path = "/v1/keys", operation_id = "make_key", tag = "keys", request_body = NewKeyDto,
    responses((status = 201, description = "The key and its secret", body = IssuedKeyDto),
        (status = 409, description = "The name is taken"),
        (status = 422, description = "It would have more rights than the key that makes it")))]
pub async fn make_key(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    Body(new): Body<NewKeyDto>,
) -> Result<(StatusCode, Json<IssuedKeyDto>), ApiError> {
    check_alone(&state)?;
    let (key, by) = (new.check()?, identity.clone());
    let (record, secret) = on_blocking_thread(move || state.gate.keys.issue(&by, key)).await??;
    tracing::info!(target: "locution::audit", event = "key made", name = record.key.name, by = %identity.name());
    Ok((StatusCode::CREATED, Json(IssuedKeyDto { secret, key: KeyDto::of(&record, false) })))
}

/// The keys that this key may manage: all, or those of its sites.
#[utoipa::path(get, path = "/v1/keys", operation_id = "list_keys", tag = "keys",
    responses((status = 200, description = "The keys, without their secrets", body = KeysDto)))]
pub async fn list_keys(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
) -> Json<KeysDto> {
    let items = state.gate.keys.list(&identity);
    Json(KeysDto {
        items: items.iter().map(|(record, is_configured)| KeyDto::of(record, *is_configured)).collect(),
    })
}

/// Give a key another secret.
#[utoipa::path(post, path = "/v1/keys/{key}/rotate", operation_id = "rotate_key", tag = "keys",
    params(RotateParams),
    responses((status = 200, description = "The key and its new secret", body = IssuedKeyDto),
        (status = 404, description = "No issued key of this name may be managed")))]
pub async fn rotate_key(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    Path(name): Path<String>,
    Params(params): Params<RotateParams>,
) -> Result<Json<IssuedKeyDto>, ApiError> {
    check_alone(&state)?;
    let grace_s = params.grace_s.unwrap_or(0);
    if grace_s > LIFE_MAX_S {
        return Err(ApiError::invalid("grace_s", format!("at most {LIFE_MAX_S} seconds")));
    }
    let by = identity.clone();
    let (record, secret) = on_blocking_thread(move || state.gate.keys.rotate(&by, &name, grace_s)).await??;
    tracing::info!(target: "locution::audit", event = "key rotated", name = record.key.name, by = %identity.name());
    Ok(Json(IssuedKeyDto { secret, key: KeyDto::of(&record, false) }))
}

/// Revoke a key; it opens nothing from now on.
#[utoipa::path(delete, path = "/v1/keys/{key}", operation_id = "revoke_key", tag = "keys",
    responses((status = 204, description = "It is revoked"),
        (status = 404, description = "No issued key of this name may be managed"),
        (status = 409, description = "It is the last one that can make others")))]
pub async fn revoke_key(
    State(state): State<AppState>,
    Extension(identity): Extension<Identity>,
    Path(name): Path<String>,
) -> Result<StatusCode, ApiError> {
    check_alone(&state)?;
    let (by, revoked) = (identity.clone(), name.clone());
    on_blocking_thread(move || state.gate.keys.revoke(&by, &revoked)).await??;
    tracing::info!(target: "locution::audit", event = "key revoked", name, by = %identity.name());
    Ok(StatusCode::NO_CONTENT)
}
