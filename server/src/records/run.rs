//! A run, open for reading: pages for clients, everything for the map builder.

use std::ops::Range;
use std::sync::Arc;

use locution_engine::geometry::Pose2;
use locution_engine::mapping::Keyframe;
use locution_engine::scan::Scan;
use locution_engine::text::{Observation, Word};
use locution_engine::translator::Cut;

use super::codec;
use super::keys::{Key, RunIdx};
use super::reader::SiteReader;
use super::scans::{read_scans, read_stamps};
use super::series;
use super::stored::{RunHead, RunRecord, StoredKeyframe, TextHead};
use crate::storage::StorageError;

/// Scans read at once while keyframes are joined with theirs.
const NUM_SCANS_PER_READ: u64 = 2_048;

/// A run as it stood when it was opened, in one text generation.
#[derive(Clone)]
pub struct Run {
    /// Position among the site's runs.
    pub idx: RunIdx,
    pub record: Arc<RunRecord>,
    /// How far the recording has come.
    pub head: RunHead,
    /// How far the text has come.
    pub text: TextHead,
    pub(super) reader: SiteReader,
}

impl Run {
    /// The same run with its text as it stood at another head; nothing beyond it is read.
    pub fn at(self, text: TextHead) -> Self {
        Self { text, ..self }
    }

    /// Words of one level.
    pub fn num_words(&self, level: u8) -> u64 {
        self.text.num_words.get(usize::from(level)).copied().unwrap_or(0)
    }

    /// Up to `limit` observations from number `from` on.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn observations(&self, from: u64, limit: usize) -> Result<Vec<Observation>, StorageError> {
        let generation = self.reader.generation();
        let prefix = Key::all_observations(generation, self.idx);
        let key = |first| Key::Observations(generation, self.idx, first);
        series::read(self.reader.store(), &prefix, key, from..self.text.num_observations, limit).await
    }

    pub async fn all_observations(&self) -> Result<Vec<Observation>, StorageError> {
        self.observations(0, usize::MAX).await
    }

    /// Up to `limit` words of one level from number `from` on.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn words(&self, level: u8, from: u64, limit: usize) -> Result<Vec<Word>, StorageError> {
        let generation = self.reader.generation();
        let prefix = Key::all_words(generation, self.idx, level);
        let key = |first| Key::Words(generation, self.idx, level, first);
        series::read(self.reader.store(), &prefix, key, from..self.num_words(level), limit).await
    }

    /// The words of all levels, level by level, from a number of each on.
    pub async fn words_after(&self, num_known: &[u64]) -> Result<Vec<Word>, StorageError> {
        let mut words = Vec::new();
        for level in 0..self.text.num_words.len() {
            let from = num_known.get(level).copied().unwrap_or(0);
            words.extend(self.words(level as u8, from, usize::MAX).await?);
        }
        Ok(words)
    }

    /// The scans of a range of sequence numbers, as far as there are any.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn scans(&self, range: Range<u64>) -> Result<Vec<Scan>, StorageError> {
        let range = range.start..range.end.min(self.head.next_sequence);
        read_scans(self.reader.store(), self.idx, &self.record.geometry, range).await
    }

    /// Timestamp and odometry of every scan.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn stamps(&self) -> Result<Vec<(i64, Pose2)>, StorageError> {
        read_stamps(self.reader.store(), self.idx, 0..self.head.next_sequence).await
    }

    /// Where the run falls in pieces, in order.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them cannot be read.
    pub async fn cuts(&self) -> Result<Vec<Cut>, StorageError> {
        let prefix = Key::all_cuts(self.reader.generation(), self.idx);
        let mut cuts = Vec::new();
        for (key, bytes) in self.reader.store().scan(&prefix, &[], usize::MAX).await? {
            let corrupt = || StorageError::Corrupt { what: "the key of a cut".into() };
            let scan_seq = Key::last_u64(&key).ok_or_else(corrupt)?;
            // What came after the run was opened is not of it.
            if scan_seq < self.text.num_scans {
                cuts.push(Cut { scan_seq, reason: codec::decode(&bytes, "a cut")? });
            }
        }
        Ok(cuts)
    }

    /// All keyframes without their readings, which stand with the scans.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn stored_keyframes(&self) -> Result<Vec<StoredKeyframe>, StorageError> {
        let generation = self.reader.generation();
        let prefix = Key::all_keyframes(generation, self.idx);
        let key = |first| Key::Keyframes(generation, self.idx, first);
        series::read(self.reader.store(), &prefix, key, 0..self.text.num_keyframes, usize::MAX).await
    }

    /// All keyframes, joined with the scans that they were made from.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when a keyframe or its scan is missing.
    pub async fn keyframes(&self) -> Result<Vec<Keyframe>, StorageError> {
        let stored = self.stored_keyframes().await?;
        let mut keyframes = Vec::with_capacity(stored.len());
        let mut pending = stored.into_iter().peekable();
        while let Some(first) = pending.peek().map(|keyframe| keyframe.scan_seq) {
            let end = self.head.next_sequence.min(first + NUM_SCANS_PER_READ);
            let mut scans = self.scans(first..end).await?;
            if scans.is_empty() {
                return Err(StorageError::Corrupt {
                    what: format!("the keyframe of scan {first} has no scan"),
                });
            }
            while let Some(keyframe) = pending.next_if(|keyframe| keyframe.scan_seq < end) {
                let scan = &mut scans[(keyframe.scan_seq - first) as usize];
                keyframes.push(Keyframe {
                    scan_seq: keyframe.scan_seq,
                    timestamp_ns: scan.timestamp_ns,
                    odom_from_robot: scan.odom_from_robot,
                    run_from_robot: keyframe.run_from_robot,
                    motion_covariance: keyframe.motion_covariance,
                    ranges_m: std::mem::take(&mut scan.ranges_m),
                });
            }
        }
        Ok(keyframes)
    }
}
