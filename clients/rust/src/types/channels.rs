//! Channels: names that stand for a version of the map.

use serde::{Deserialize, Serialize};

/// Where a channel is to point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChannelTarget {
    /// A version of the map that is kept; the serving one when none is said.
    pub map_version: Option<u64>,
}

/// One move of a channel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChannelMove {
    /// Where it points since.
    pub map_version: u64,
    /// When it was moved, seconds since 1970.
    pub at_s: u64,
    /// Name of the key that moved it.
    pub by: String,
}

/// A map in the words of VDA 5050.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct VdaMap {
    /// Name of the site.
    pub map_id: String,
    /// Number of the version.
    pub map_version: String,
    /// Where its grid is on the server.
    pub map_download_link: String,
    /// Digest of everything that the version holds, in hexadecimal.
    pub map_hash: String,
}

/// A name that stands for a version of the map.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MapChannel {
    /// Its name.
    pub channel: String,
    /// Where it points.
    pub map_version: u64,
    /// Where it goes when the last move is taken back.
    pub map_version_before: Option<u64>,
    /// The last moves, the newest first.
    pub moves: Vec<ChannelMove>,
    /// The map in the words of VDA 5050.
    pub vda5050: VdaMap,
}

/// A robot that follows a channel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChannelRobot {
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotReport {
    /// The version of the map that it has loaded.
    pub map_version: u64,
}
