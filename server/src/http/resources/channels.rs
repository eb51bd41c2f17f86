//! Channels: which version of the map a fleet drives by. An operator moves them and takes a move back; robots follow and
//! say which version they have.

use axum::http::StatusCode;
use axum::response::Response;
use axum::{Extension, Json};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::app::Name;
use crate::app::maps::{
    a_channel, channel_robots, channels, delete_channel, move_channel, note_robot, roll_back,
};
use crate::app::site::Site;
use crate::auth::{Identity, now_s};
use crate::error::ApiError;
use crate::extract::{Body, ChannelName, NoParams, Paged, RobotName, SiteOf};
use crate::http::values::{Page, PageParams};
use crate::http::with_location;
use crate::records::{Channel, ChannelMove, RobotReport};

/// Where a channel is to point.
#[derive(Clone, Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelTargetDto {
    /// A version of the map that is kept; the serving one unless said.
    #[schema(minimum = 1)]
    pub map_version: Option<u64>,
}

/// One move of a channel.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ChannelMoveDto {
    /// Where it points since.
    pub map_version: u64,
    /// When it was moved, seconds since 1970.
    pub at_s: u64,
    /// Name of the key that moved it.
    pub by: String,
}

impl From<&ChannelMove> for ChannelMoveDto {
    fn from(moved: &ChannelMove) -> Self {
        Self { map_version: moved.version, at_s: moved.at_s, by: moved.by.clone() }
    }
}

/// The map of a channel in the words of VDA 5050, as its action `downloadMap` wants them.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "camelCase")]
pub struct VdaMapDto {
    /// Name of the site.
    pub map_id: String,
    /// Number of the version.
    pub map_version: String,
    /// Where its grid is on this server.
    pub map_download_link: String,
    /// Digest of everything that the version holds, in hexadecimal: equal digests, equal maps.
    pub map_hash: String,
}

/// A name that stands for a version of the map.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MapChannelDto {
    /// Its name.
    #[schema(example = "stable")]
    pub channel: String,
    /// Where it points. This version is kept as long as it does.
    pub map_version: u64,
    /// Where it pointed before, and goes when the last move is taken back.
    pub map_version_before: Option<u64>,
    /// The last moves, the newest first.
    pub moves: Vec<ChannelMoveDto>,
    /// The map in the words of VDA 5050.
    pub vda5050: VdaMapDto,
}

impl MapChannelDto {
    /// # Errors
    /// Those of the storage.
    async fn of(site: &Site, name: &str, channel: &Channel) -> Result<Self, ApiError> {
        let version = channel.version().unwrap_or_default();
        let map = site.map(Some(version)).await?;
        let hash = map.record.content.iter().map(|byte| format!("{byte:02x}")).collect();
        let link = format!("/v1/sites/{}/map/grid.pgm?version={version}", site.name());
        Ok(Self {
            channel: name.to_owned(),
            map_version: version,
            map_version_before: channel.version_before(),
            moves: channel.moves().iter().rev().map(ChannelMoveDto::from).collect(),
            vda5050: VdaMapDto {
                map_id: site.name().to_string(),
                map_version: version.to_string(),
                map_download_link: link,
                map_hash: hash,
            },
        })
    }
}

/// A robot that follows a channel.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ChannelRobotDto {
    /// Its name.
    pub robot: String,
    /// The version that it said to have.
    pub map_version: u64,
    /// Whether the channel points there.
    pub is_current: bool,
    /// When it said so, seconds since 1970.
    pub at_s: u64,
}

/// What a robot says of itself.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotReportDto {
    /// The version of the map that it has loaded.
    #[schema(minimum = 1)]
    pub map_version: u64,
}

/// Channels of a site, by name.
#[utoipa::path(get, path = "/v1/sites/{site}/channels", operation_id = "list_channels", tag = "maps",
    params(PageParams),
    responses((status = 200, description = "A page of channels", body = Page<MapChannelDto>)))]
pub async fn list_channels(
    SiteOf(site): SiteOf,
    Paged(NoParams {}, page): Paged<NoParams>,
) -> Result<Json<Page<MapChannelDto>>, ApiError> {
    let found = channels(&site).await?;
    let page = Page::of_all(&found, found.len(), page);
    let mut items = Vec::with_capacity(page.items.len());
    for (name, channel) in page.items {
        items.push(MapChannelDto::of(&site, name, channel).await?);
    }
    Ok(Json(Page { items, next_cursor: page.next_cursor }))
}

/// One channel: the version of the map by which robots that follow it drive.
#[utoipa::path(get, path = "/v1/sites/{site}/channels/{channel}", operation_id = "get_channel", tag = "maps",
    responses((status = 200, description = "The channel", body = MapChannelDto)))]
pub async fn get_channel(
    SiteOf(site): SiteOf,
    ChannelName(name): ChannelName,
) -> Result<Json<MapChannelDto>, ApiError> {
    answer(&site, &name).await
}

async fn answer(site: &Site, name: &Name) -> Result<Json<MapChannelDto>, ApiError> {
    let channel = a_channel(site, name).await?;
    Ok(Json(MapChannelDto::of(site, name.as_str(), &channel).await?))
}

/// Point a channel to a version of the map; made when there is none of this name. The version is kept while it points there.
#[utoipa::path(put, path = "/v1/sites/{site}/channels/{channel}", operation_id = "move_channel", tag = "maps",
    request_body = Option<ChannelTargetDto>,
    responses((status = 200, description = "It points there", body = MapChannelDto),
        (status = 201, description = "It was made and points there", body = MapChannelDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn move_channel_to(
    SiteOf(site): SiteOf,
    ChannelName(name): ChannelName,
    Extension(identity): Extension<Identity>,
    Body(target): Body<ChannelTargetDto>,
) -> Result<Response, ApiError> {
    let is_new = move_channel(&site, &name, target.map_version, now_s(), identity.name()).await?;
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    let location = format!("/v1/sites/{}/channels/{name}", site.name());
    Ok(with_location(&location, (status, answer(&site, &name).await?)))
}

/// Take the last move of a channel back.
#[utoipa::path(post, path = "/v1/sites/{site}/channels/{channel}/rollback", operation_id = "roll_back_channel", tag = "maps",
    responses((status = 200, description = "It points where it did before", body = MapChannelDto),
        (status = 409, description = "There is no kept version to go back to")))]
pub async fn roll_back_channel(
    SiteOf(site): SiteOf,
    ChannelName(name): ChannelName,
) -> Result<Json<MapChannelDto>, ApiError> {
    roll_back(&site, &name).await?;
    answer(&site, &name).await
}

/// Forget a channel; the versions that it held are kept no longer than others.
#[utoipa::path(delete, path = "/v1/sites/{site}/channels/{channel}", operation_id = "delete_channel", tag = "maps",
    responses((status = 204, description = "It is gone")))]
pub async fn delete_channel_of(
    SiteOf(site): SiteOf,
    ChannelName(name): ChannelName,
) -> Result<StatusCode, ApiError> {
    delete_channel(&site, &name).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Robots that follow a channel, and which version each has.
#[utoipa::path(get, path = "/v1/sites/{site}/channels/{channel}/robots", operation_id = "list_channel_robots", tag = "maps",
    params(PageParams),
    responses((status = 200, description = "A page of robots", body = Page<ChannelRobotDto>)))]
pub async fn list_channel_robots(
    SiteOf(site): SiteOf,
    ChannelName(name): ChannelName,
    Paged(NoParams {}, page): Paged<NoParams>,
) -> Result<Json<Page<ChannelRobotDto>>, ApiError> {
    let current = a_channel(&site, &name).await?.version();
    let robots = channel_robots(&site, &name).await?;
    let total = robots.len();
    let items = robots.into_iter().map(|(robot, report)| ChannelRobotDto {
        robot,
        map_version: report.version,
        is_current: current == Some(report.version),
        at_s: report.at_s,
    });
    Ok(Json(Page::of_all(items, total, page)))
}

/// Say which version of the map a robot has loaded.
#[utoipa::path(put, path = "/v1/sites/{site}/channels/{channel}/robots/{robot}", operation_id = "report_channel_robot", tag = "maps",
    request_body = RobotReportDto,
    responses((status = 204, description = "It is noted")))]
pub async fn report_channel_robot(
    SiteOf(site): SiteOf,
    ChannelName(name): ChannelName,
    RobotName(robot): RobotName,
    Body(report): Body<RobotReportDto>,
) -> Result<StatusCode, ApiError> {
    let report = RobotReport { version: report.map_version, at_s: now_s() };
    note_robot(&site, &name, &robot, report).await?;
    Ok(StatusCode::NO_CONTENT)
}
