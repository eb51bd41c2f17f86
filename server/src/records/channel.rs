//! Channels: names that stand for a map version, which robots follow.

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use super::codec;
use super::keys::MapVersion;
use crate::storage::StorageError;

/// Moves that are kept of a channel.
const NUM_MOVES_KEPT: usize = 50;

/// One move of a channel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChannelMove {
    /// Where it points since.
    pub version: MapVersion,
    /// When it was moved, seconds since 1970.
    pub at_s: u64,
    /// Name of the key that moved it.
    pub by: String,
}

/// `Key::Channel`: where a channel points and pointed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Channel {
    /// The oldest first; never empty.
    moves: Vec<ChannelMove>,
}

impl Channel {
    /// A channel that was just made.
    pub fn new(first: ChannelMove) -> Self {
        Self { moves: vec![first] }
    }

    /// The version to which it points; `None` of a record that holds no move.
    pub fn version(&self) -> Option<MapVersion> {
        self.moves.last().map(|last| last.version)
    }

    /// The version to which it pointed before the last move.
    pub fn version_before(&self) -> Option<MapVersion> {
        self.moves.len().checked_sub(2).map(|idx| self.moves[idx].version)
    }

    /// Its moves, the oldest first.
    pub fn moves(&self) -> &[ChannelMove] {
        &self.moves
    }

    /// Points it to another version.
    pub fn move_to(&mut self, next: ChannelMove) {
        self.moves.push(next);
        let num_forgotten = self.moves.len().saturating_sub(NUM_MOVES_KEPT);
        self.moves.drain(..num_forgotten);
    }

    /// Takes the last move back.
    pub fn roll_back(&mut self) {
        self.moves.pop();
    }

    /// The stored form.
    pub fn encode(&self) -> Bytes {
        codec::encode(self)
    }

    /// The channel behind its stored form.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn decode(bytes: &[u8]) -> Result<Self, StorageError> {
        codec::decode(bytes, "a channel")
    }
}

/// `Key::ChannelRobot`: what a robot said that it drives by.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotReport {
    /// The version that it has loaded.
    pub version: MapVersion,
    /// When it said so, seconds since 1970.
    pub at_s: u64,
}

impl RobotReport {
    /// The stored form.
    pub fn encode(&self) -> Bytes {
        codec::encode(self)
    }

    /// The report behind its stored form.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn decode(bytes: &[u8]) -> Result<Self, StorageError> {
        codec::decode(bytes, "the report of a robot")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(version: MapVersion) -> ChannelMove {
        ChannelMove { version, at_s: 7, by: "operator".into() }
    }

    #[test]
    fn moves_are_kept_up_to_a_number_and_taken_back() {
        let mut channel = Channel::new(moved(1));
        assert_eq!((channel.version(), channel.version_before()), (Some(1), None));
        for version in 2..=60 {
            channel.move_to(moved(version));
        }
        assert_eq!(channel.moves().len(), NUM_MOVES_KEPT);
        assert_eq!((channel.version(), channel.version_before()), (Some(60), Some(59)));
        channel.roll_back();
        assert_eq!(Channel::decode(&channel.encode()).unwrap(), channel);
        assert_eq!(channel.version(), Some(59));
    }
}
