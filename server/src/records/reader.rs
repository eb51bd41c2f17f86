//! One store and one text generation: whatever is read through it belongs together.

use std::sync::Arc;

use locution_engine::mapping::Decision;
use serde::de::DeserializeOwned;

use super::annotation::Annotation;
use super::channel::{Channel, RobotReport};
use super::codec;
use super::keys::{Generation, Key, MapVersion, RunIdx};
use super::map::Map;
use super::run::Run;
use super::stored::RunRecord;
use super::stored_map::MapRecord;
use crate::storage::{Reader, StorageError};

/// Reads a site's runs and maps, either as they stand or as they stood at a snapshot.
#[derive(Clone)]
pub struct SiteReader {
    store: Arc<dyn Reader>,
    generation: Generation,
}

impl SiteReader {
    /// Reads texts of a generation.
    pub fn new(store: Arc<dyn Reader>, generation: Generation) -> Self {
        Self { store, generation }
    }

    /// The text generation that it reads.
    pub fn generation(&self) -> Generation {
        self.generation
    }

    pub(super) fn store(&self) -> &dyn Reader {
        &*self.store
    }

    /// The number of a run of a name; `None` when there is none.
    pub async fn run_idx(&self, name: &str) -> Result<Option<RunIdx>, StorageError> {
        get(self.store(), &Key::RunName(name.to_owned()), "the number of a run").await
    }

    /// A run by its number.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when there is no such run: numbers come from what is stored.
    pub async fn run(&self, idx: RunIdx) -> Result<Run, StorageError> {
        let keys = [Key::Run(idx), Key::RunHead(idx), Key::TextHead(self.generation, idx)];
        let values = self.store.multi_get(&keys.map(|key| key.encode())).await?;
        let missing = || StorageError::Corrupt { what: format!("run {idx} is missing") };
        let record = RunRecord::decode(values[0].as_ref().ok_or_else(missing)?)?;
        let head = codec::decode(values[1].as_ref().ok_or_else(missing)?, "the head of a run")?;
        let text = values[2].as_ref().map(|bytes| codec::decode(bytes, "the head of a text")).transpose()?;
        Ok(Run { idx, record: Arc::new(record), head, text: text.unwrap_or_default(), reader: self.clone() })
    }

    /// A map version; `None` when it is not kept.
    pub async fn map(&self, version: MapVersion) -> Result<Option<Map>, StorageError> {
        let stored = self.store.get(&Key::Map(version).encode()).await?;
        let record = stored.map(|bytes| MapRecord::decode(&bytes)).transpose()?;
        Ok(record.map(|record| Map::new(record, self.clone())))
    }

    /// Numbers of all map versions that are there, oldest first; one that is being written may be among them.
    pub async fn map_versions(&self) -> Result<Vec<MapVersion>, StorageError> {
        let entries = self.store.scan(&Key::all_maps(), &[], usize::MAX).await?;
        Ok(entries.iter().filter_map(|(key, _)| Key::last_u64(key)).collect())
    }

    /// All decisions with their numbers, in the order they were made.
    pub async fn decisions(&self) -> Result<Vec<(u64, Decision)>, StorageError> {
        let entries = self.store.scan(&Key::all_decisions(), &[], usize::MAX).await?;
        let decisions = entries.iter().map(|(key, bytes)| {
            let number = Key::last_u64(key)
                .ok_or_else(|| StorageError::Corrupt { what: "the key of a decision".into() })?;
            Ok((number, codec::decode(bytes, "a decision")?))
        });
        decisions.collect()
    }

    /// What people drew, with its numbers, ascending.
    pub async fn annotations(&self) -> Result<Vec<(u64, Annotation)>, StorageError> {
        let entries = self.store.scan(&Key::all_annotations(), &[], usize::MAX).await?;
        let annotations = entries.iter().map(|(key, bytes)| {
            let number = Key::last_u64(key)
                .ok_or_else(|| StorageError::Corrupt { what: "the key of an annotation".into() })?;
            Ok((number, Annotation::decode(bytes)?))
        });
        annotations.collect()
    }

    /// All channels, by name.
    pub async fn channels(&self) -> Result<Vec<(String, Channel)>, StorageError> {
        let entries = self.store.scan(&Key::all_channels(), &[], usize::MAX).await?;
        entries.iter().map(|(key, bytes)| Ok((named(key)?, Channel::decode(bytes)?))).collect()
    }

    /// One of them; `None` when there is none of this name.
    pub async fn channel(&self, name: &str) -> Result<Option<Channel>, StorageError> {
        let bytes = self.store.get(&Key::Channel(name.to_owned()).encode()).await?;
        bytes.map(|bytes| Channel::decode(&bytes)).transpose()
    }

    /// What the robots of a channel said, by name.
    pub async fn channel_robots(&self, channel: &str) -> Result<Vec<(String, RobotReport)>, StorageError> {
        let entries = self.store.scan(&Key::all_channel_robots(channel), &[], usize::MAX).await?;
        entries.iter().map(|(key, bytes)| Ok((named(key)?, RobotReport::decode(bytes)?))).collect()
    }

    /// One of them; `None` when there is none of this number.
    pub async fn annotation(&self, number: u64) -> Result<Option<Annotation>, StorageError> {
        let bytes = self.store.get(&Key::Annotation(number).encode()).await?;
        bytes.map(|bytes| Annotation::decode(&bytes)).transpose()
    }
}

/// The name that closes a key.
fn named(key: &[u8]) -> Result<String, StorageError> {
    Key::last_name(key).ok_or_else(|| StorageError::Corrupt { what: "the key of a channel".into() })
}

/// The value of one key; `what` names it in errors.
async fn get<T: DeserializeOwned>(
    reader: &dyn Reader,
    key: &Key,
    what: &str,
) -> Result<Option<T>, StorageError> {
    let bytes = reader.get(&key.encode()).await?;
    bytes.map(|bytes| codec::decode(&bytes, what)).transpose()
}
