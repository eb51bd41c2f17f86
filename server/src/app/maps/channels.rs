//! Channels: an operator says which map version robots drive by, and takes it back; robots say which one they have.
//!
//! A version to which a channel points, and the one before, are kept for as long as it does.

use std::collections::BTreeSet;

use crate::app::site::Site;
use crate::app::{AppError, Name};
use crate::records::{Channel, ChannelMove, Key, MapVersion, RobotReport};

/// No site has more.
const NUM_CHANNELS_MAX: usize = 100;
/// No channel has more.
const NUM_ROBOTS_MAX: usize = 10_000;

/// Channels of a site, by name.
///
/// # Errors
/// Those of the storage.
pub async fn channels(site: &Site) -> Result<Vec<(String, Channel)>, AppError> {
    Ok(site.reader().channels().await?)
}

/// One channel.
///
/// # Errors
/// [`AppError::NotFound`].
pub async fn a_channel(site: &Site, name: &Name) -> Result<Channel, AppError> {
    let channel = site.reader().channel(name.as_str()).await?;
    channel.ok_or_else(|| AppError::not_found("channel", name))
}

/// What the robots that follow a channel said that they drive by, by name.
///
/// # Errors
/// Those of the storage.
pub async fn channel_robots(site: &Site, name: &Name) -> Result<Vec<(String, RobotReport)>, AppError> {
    Ok(site.reader().channel_robots(name.as_str()).await?)
}

/// Points a channel to a version, the serving one unless said; makes it when there is none. Whether it was made.
///
/// # Errors
/// [`AppError::NotFound`] for a version that is not kept, [`AppError::NotReady`] before the first map,
/// [`AppError::Invalid`] when there are too many channels.
pub async fn move_channel(
    site: &Site,
    name: &Name,
    version: Option<MapVersion>,
    at_s: u64,
    by: &str,
) -> Result<bool, AppError> {
    loop {
        let seen = site.state().record.next_decision;
        let version = site.map(version).await?.record.version;
        let before = site.reader().channel(name.as_str()).await?;
        if before.is_none() && channels(site).await?.len() >= NUM_CHANNELS_MAX {
            return Err(AppError::invalid(
                "channel",
                format!("a site has at most {NUM_CHANNELS_MAX} channels"),
            ));
        }
        let is_new = before.is_none();
        let next = ChannelMove { version, at_s, by: by.to_owned() };
        let moved = match before {
            Some(channel) if channel.version() == Some(version) => return Ok(false),
            Some(mut channel) => {
                channel.move_to(next);
                channel
            }
            None => Channel::new(next),
        };
        if write_as_seen(site, seen, name, Some(&moved)).await? {
            return Ok(is_new);
        }
    }
}

/// Takes the last move of a channel back.
///
/// # Errors
/// [`AppError::NotFound`]; [`AppError::NotReady`] when it points nowhere before.
pub async fn roll_back(site: &Site, name: &Name) -> Result<(), AppError> {
    loop {
        let seen = site.state().record.next_decision;
        let mut channel = a_channel(site, name).await?;
        let nowhere = || AppError::NotReady {
            detail: format!("there is no kept version to which the channel `{name}` could go back"),
        };
        // The version before the last move is kept; those before it may be gone.
        let before = channel.version_before().ok_or_else(nowhere)?;
        site.reader().map(before).await?.ok_or_else(nowhere)?;
        channel.roll_back();
        if write_as_seen(site, seen, name, Some(&channel)).await? {
            return Ok(());
        }
    }
}

/// Forgets a channel and what its robots said.
///
/// # Errors
/// [`AppError::NotFound`].
pub async fn delete_channel(site: &Site, name: &Name) -> Result<(), AppError> {
    loop {
        let seen = site.state().record.next_decision;
        a_channel(site, name).await?;
        if write_as_seen(site, seen, name, None).await? {
            return Ok(());
        }
    }
}

/// Writes or forgets a channel when nothing that people say has changed since it was read.
async fn write_as_seen(
    site: &Site,
    seen: u64,
    name: &Name,
    channel: Option<&Channel>,
) -> Result<bool, AppError> {
    let robots = match channel {
        None => channel_robots(site, name).await?,
        Some(_) => Vec::new(),
    };
    site.change(|record, batch| {
        if record.next_decision != seen {
            return Ok(false);
        }
        record.next_decision += 1;
        let key = Key::Channel(name.to_string()).encode();
        match channel {
            Some(channel) => batch.put(key, channel.encode()),
            None => batch.delete(key),
        }
        for (robot, _) in robots {
            batch.delete(Key::ChannelRobot(name.to_string(), robot).encode());
        }
        Ok(true)
    })
    .await
}

/// Notes by which version a robot drives.
///
/// # Errors
/// [`AppError::NotFound`] for a channel that there is not, [`AppError::Invalid`] when too many robots follow it.
pub async fn note_robot(site: &Site, name: &Name, robot: &Name, report: RobotReport) -> Result<(), AppError> {
    a_channel(site, name).await?;
    let robots = channel_robots(site, name).await?;
    if robots.len() >= NUM_ROBOTS_MAX && !robots.iter().any(|(known, _)| *known == robot.as_str()) {
        let problem = format!("a channel has at most {NUM_ROBOTS_MAX} robots");
        return Err(AppError::invalid("robot", problem));
    }
    site.change(|_, batch| {
        batch.put(Key::ChannelRobot(name.to_string(), robot.to_string()).encode(), report.encode());
        Ok(())
    })
    .await
}

/// Versions that channels hold: those to which they point, and those to which they can go back.
///
/// # Errors
/// Those of the storage.
pub async fn held_versions(site: &Site) -> Result<BTreeSet<MapVersion>, AppError> {
    let channels = channels(site).await?;
    Ok(channels
        .iter()
        .flat_map(|(_, channel)| [channel.version(), channel.version_before()])
        .flatten()
        .collect())
}
