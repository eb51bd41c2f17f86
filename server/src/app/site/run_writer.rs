//! The one writer of a run: its translator in memory, its heads as stored, one batch at a time.
//!
//! The state in memory is a cache of the storage. It is taken out while a batch is being written and put back only
//! after the commit; whatever goes wrong in between (a refusal of the storage, a panic, a dropped request) leaves
//! nothing behind, and the next batch loads it again: the stored translator, then the scans stored since.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use bytes::Bytes;
use tokio::sync::{Mutex, Semaphore, SemaphorePermit};

use super::state::TextConfig;
use super::translation::{RunTranslator, Translated};
use crate::app::{AppError, on_blocking_thread};
use crate::records::{
    Generation, Key, RunHead, RunIdx, RunRecord, StoredKeyframe, TextHead, codec, join_pieces, pieces,
    read_scans, series,
};
use crate::storage::{Batch, Precondition, Reader, StorageError};

/// Scans read and translated at once while a run is resumed.
const NUM_SCANS_PER_REPLAY: u64 = 1_000;

/// The writer of one run.
pub struct RunWriter {
    pub(in crate::app) idx: RunIdx,
    pub(in crate::app) record: Arc<RunRecord>,
    waiting: Semaphore,
    pub(in crate::app) state: Mutex<Option<WriterState>>,
    /// When it was last used, on the clock of `OpenRuns`.
    pub(in crate::app) last_use: AtomicU64,
}

/// What the writer knows of the run; equal to what is stored.
pub struct WriterState {
    pub(in crate::app) generation: Generation,
    pub(in crate::app) head: Stored<RunHead>,
    pub(in crate::app) text: Stored<TextHead>,
    /// None while it works elsewhere, once the run is finished, and when an earlier version of the server stored it.
    pub(in crate::app) translator: Option<RunTranslator>,
}

/// A record with its stored bytes, which the next commit expects to find.
pub struct Stored<T> {
    pub(in crate::app) value: T,
    bytes: Option<Bytes>,
}

impl<T: serde::Serialize + serde::de::DeserializeOwned + Default> Stored<T> {
    async fn load(reader: &dyn Reader, key: &Key) -> Result<Self, StorageError> {
        let bytes = reader.get(&key.encode()).await?;
        let value = bytes.as_ref().map(|bytes| codec::decode(bytes, "the head of a run")).transpose()?;
        Ok(Self { value: value.unwrap_or_default(), bytes })
    }

    /// Writes the value when it still stands as it was read.
    fn put(&mut self, key: &Key, batch: &mut Batch, preconditions: &mut Vec<Precondition>) {
        let bytes = codec::encode(&self.value);
        preconditions.push(Precondition { key: key.encode(), expected: self.bytes.take() });
        batch.put(key.encode(), bytes.clone());
        self.bytes = Some(bytes);
    }
}

impl RunWriter {
    pub(in crate::app) fn new(idx: RunIdx, record: Arc<RunRecord>, num_batches_max: usize) -> Self {
        let waiting = Semaphore::new(num_batches_max);
        Self { idx, record, waiting, state: Mutex::new(None), last_use: AtomicU64::new(0) }
    }

    /// A place in the run's bounded queue.
    pub(in crate::app) fn queue(&self) -> Result<SemaphorePermit<'_>, AppError> {
        let queue = "the queue of this run";
        self.waiting.try_acquire().map_err(|_| AppError::Busy { queue, retry_after: Duration::from_secs(1) })
    }

    /// Drops the translator when nobody is using it; true when there was one to drop.
    pub(in crate::app) fn put_to_sleep(&self) -> bool {
        self.state.try_lock().is_ok_and(|mut state| state.take().is_some())
    }

    pub(in crate::app) fn touch(&self, now: u64) {
        self.last_use.store(now, Ordering::Relaxed);
    }

    /// Reads the heads and brings the translator to where the stored text ends, in a generation that serves or will.
    pub(in crate::app) async fn load(
        &self,
        reader: &dyn Reader,
        generation: Generation,
        text_config: &TextConfig,
    ) -> Result<WriterState, AppError> {
        let head = Stored::<RunHead>::load(reader, &Key::RunHead(self.idx)).await?;
        let text = Stored::<TextHead>::load(reader, &Key::TextHead(generation, self.idx)).await?;
        if text.value.is_finished {
            return Ok(WriterState { generation, head, text, translator: None });
        }
        let stored = self.load_checkpoint(reader, generation, text_config, &text.value).await?;
        let Some(mut translator) = stored else {
            return Ok(WriterState { generation, head, text, translator: None });
        };
        let mut next = text.value.checkpoint_scans;
        while next < text.value.num_scans {
            let end = text.value.num_scans.min(next + NUM_SCANS_PER_REPLAY);
            let scans = read_scans(reader, self.idx, &self.record.geometry, next..end).await?;
            translator = on_blocking_thread(move || {
                // What these scans produced is already stored.
                translator.translate(&scans);
                translator
            })
            .await?;
            next = end;
        }
        Ok(WriterState { generation, head, text, translator: Some(translator) })
    }

    async fn load_checkpoint(
        &self,
        reader: &dyn Reader,
        generation: Generation,
        text_config: &TextConfig,
        text: &TextHead,
    ) -> Result<Option<RunTranslator>, AppError> {
        if text.num_checkpoint_parts == 0 {
            let quantizer = text_config.quantizer.clone();
            return RunTranslator::new(&text_config.engine, &self.record.geometry, quantizer).map(Some);
        }
        let key = |part| Key::Checkpoint(generation, self.idx, part).encode();
        let parts = reader.multi_get(&(0..text.num_checkpoint_parts).map(key).collect::<Vec<_>>()).await?;
        let missing = || StorageError::Corrupt { what: "a part of a stored translator is missing".into() };
        let parts: Vec<Bytes> =
            parts.into_iter().map(|part| part.ok_or_else(missing)).collect::<Result<_, _>>()?;
        RunTranslator::restore(&join_pieces(&parts, "a stored translator")?)
    }
}

impl WriterState {
    /// The translator, to work elsewhere; it must be put back before the state is used again.
    ///
    /// # Errors
    /// [`AppError::NotReady`] for a run that an earlier version of the server left open.
    pub(in crate::app) fn take_translator(&mut self) -> Result<RunTranslator, AppError> {
        self.translator.take().ok_or_else(|| AppError::NotReady {
            detail:
                "the run was begun by an earlier version of the server, whose text this one cannot continue: \
                     finish it and send what follows as another run"
                    .into(),
        })
    }

    /// Adds to a batch everything that translating brought, and moves the heads in memory.
    pub(in crate::app) fn append_text(&mut self, run: RunIdx, translated: &Translated, batch: &mut Batch) {
        let (generation, text) = (self.generation, &mut self.text.value);
        let observations = &translated.observations;
        series::append(batch, observations, text.num_observations, |n| Key::Observations(generation, run, n));
        text.num_observations += observations.len() as u64;
        let num_levels =
            translated.words.iter().map(|word| usize::from(word.id.level) + 1).max().unwrap_or(0);
        text.num_words.resize(num_levels.max(text.num_words.len()), 0);
        for level in 0..num_levels {
            let words: Vec<_> =
                translated.words.iter().filter(|word| usize::from(word.id.level) == level).collect();
            let first = text.num_words[level];
            series::append(batch, &words, first, |n| Key::Words(generation, run, level as u8, n));
            text.num_words[level] += words.len() as u64;
        }
        let keyframes: Vec<_> = translated
            .keyframes
            .iter()
            .map(|keyframe| StoredKeyframe {
                scan_seq: keyframe.scan_seq,
                run_from_robot: keyframe.run_from_robot,
                motion_covariance: keyframe.motion_covariance,
            })
            .collect();
        series::append(batch, &keyframes, text.num_keyframes, |n| Key::Keyframes(generation, run, n));
        text.num_keyframes += keyframes.len() as u64;
        for cut in &translated.cuts {
            batch.put(Key::Cut(generation, run, cut.scan_seq).encode(), codec::encode(&cut.reason));
        }
    }

    /// Stores the translator when enough scans went by since it was last stored, or when asked to.
    pub(in crate::app) fn append_checkpoint(
        &mut self,
        run: RunIdx,
        interval: u64,
        batch: &mut Batch,
    ) -> Result<(), AppError> {
        let text = &mut self.text.value;
        if text.num_scans < text.checkpoint_scans + interval {
            return Ok(());
        }
        let translator = self.translator.as_ref();
        let bytes = translator.ok_or_else(|| AppError::internal("no translator to store"))?.store()?;
        let mut num_parts = 0u32;
        for piece in pieces(&bytes) {
            batch.put(Key::Checkpoint(self.generation, run, num_parts).encode(), piece);
            num_parts += 1;
        }
        for stale in num_parts..text.num_checkpoint_parts {
            batch.delete(Key::Checkpoint(self.generation, run, stale).encode());
        }
        text.checkpoint_scans = text.num_scans;
        text.num_checkpoint_parts = num_parts;
        Ok(())
    }

    /// Removes the stored translator.
    pub(in crate::app) fn drop_checkpoint(&mut self, run: RunIdx, batch: &mut Batch) {
        for part in 0..self.text.value.num_checkpoint_parts {
            batch.delete(Key::Checkpoint(self.generation, run, part).encode());
        }
        self.text.value.num_checkpoint_parts = 0;
    }

    /// Scans that the text covers.
    pub(in crate::app) fn num_scans_translated(&self) -> u64 {
        self.text.value.num_scans
    }

    /// Puts the translator back.
    pub(in crate::app) fn put_translator(&mut self, translator: RunTranslator) {
        self.translator = Some(translator);
    }

    /// Adds only the text's head, for a generation that does not serve yet.
    pub(in crate::app) fn append_text_head(&mut self, run: RunIdx, batch: &mut Batch) -> Vec<Precondition> {
        let mut preconditions = Vec::new();
        self.text.put(&Key::TextHead(self.generation, run), batch, &mut preconditions);
        preconditions
    }

    /// Adds the heads to a batch, with the conditions that nobody moved them meanwhile.
    pub(in crate::app) fn append_heads(&mut self, run: RunIdx, batch: &mut Batch) -> Vec<Precondition> {
        let mut preconditions = Vec::new();
        self.head.put(&Key::RunHead(run), batch, &mut preconditions);
        self.text.put(&Key::TextHead(self.generation, run), batch, &mut preconditions);
        preconditions
    }
}
