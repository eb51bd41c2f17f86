//! Channels: which version of the map a fleet drives by.

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{ChannelRobot, ChannelTarget, MapChannel, RobotReport};

impl Client {
    /// Channels of a site, by name.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn channels(&self, site: &str) -> Result<Vec<MapChannel>, ClientError> {
        self.all(&routes::LIST_CHANNELS, &[site], Query::default()).await
    }

    /// One channel.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn channel(&self, site: &str, channel: &str) -> Result<MapChannel, ClientError> {
        self.get(&routes::GET_CHANNEL, &[site, channel], &Query::default()).await
    }

    /// Points a channel to a version, the serving one when none is said; makes it when there is none of this name.
    ///
    /// # Errors
    /// See [`ClientError`]; 404 for a version that is not kept.
    pub async fn move_channel(
        &self,
        site: &str,
        channel: &str,
        map_version: Option<u64>,
    ) -> Result<MapChannel, ClientError> {
        let target = Body::json(&ChannelTarget { map_version })?;
        self.answer(&routes::MOVE_CHANNEL, &[site, channel], &Query::default(), target).await
    }

    /// Takes the last move of a channel back.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 when there is no kept version to go back to.
    pub async fn roll_back_channel(&self, site: &str, channel: &str) -> Result<MapChannel, ClientError> {
        self.answer(&routes::ROLL_BACK_CHANNEL, &[site, channel], &Query::default(), Body::Empty).await
    }

    /// Forgets a channel.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn delete_channel(&self, site: &str, channel: &str) -> Result<(), ClientError> {
        self.done(&routes::DELETE_CHANNEL, &[site, channel], Body::Empty).await
    }

    /// Robots that follow a channel, and which version each has.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn channel_robots(&self, site: &str, channel: &str) -> Result<Vec<ChannelRobot>, ClientError> {
        self.all(&routes::LIST_CHANNEL_ROBOTS, &[site, channel], Query::default()).await
    }

    /// Says which version of the map a robot has loaded.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn report_channel_robot(
        &self,
        site: &str,
        channel: &str,
        robot: &str,
        map_version: u64,
    ) -> Result<(), ClientError> {
        let report = Body::json(&RobotReport { map_version })?;
        self.done(&routes::REPORT_CHANNEL_ROBOT, &[site, channel, robot], report).await
    }
}
