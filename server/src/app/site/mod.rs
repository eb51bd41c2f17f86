//! A site: its record and how it changes, and what this process keeps of it.
//!
//! The parts (writers of runs, jobs, texts) do not know the site that owns them: they are handed its storage and what
//! they need of its record. Questions and work on a site are use cases of the folders beside this one.

mod jobs;
mod run_writer;
mod state;
mod texts;
mod translation;

use std::collections::HashMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use bytes::Bytes;
use locution_engine::config::EngineConfig;
use locution_engine::mapping::RegistrationMemo;
use locution_engine::text::Quantizer;

use super::{AppError, Name};
use crate::records::{
    Generation, Key, Map, MapVersion, Run, RunHead, RunIdx, SiteReader, SiteRecord, TextHead, codec,
};
use crate::storage::{Batch, Precondition, SiteStore, StorageError};

pub use jobs::{JobInfo, Jobs, Progress};
pub use run_writer::{RunWriter, WriterState};
pub use state::{SiteState, TextConfig};
pub use texts::{Segment, SiteTexts};
pub use translation::RunTranslator;

/// An open site.
pub struct Site {
    name: Name,
    store: Arc<dyn SiteStore>,
    state: RwLock<Arc<SiteState>>,
    writers: Mutex<HashMap<Name, Arc<RunWriter>>>,
    /// Held while the record is changed, so that changes of one process queue up instead of conflicting.
    changing: tokio::sync::Mutex<()>,
    pub(in crate::app) making_runs: tokio::sync::Mutex<()>,
    /// Held for reading while scans are appended, for writing while another text generation begins to serve.
    pub(in crate::app) serving: tokio::sync::RwLock<()>,
    jobs: Jobs,
    pub(in crate::app) build_requests: AtomicU64,
    /// Registrations that earlier builds computed.
    pub(in crate::app) memo: Mutex<RegistrationMemo>,
    texts: SiteTexts,
}

/// What a site is and holds.
#[derive(Clone, Debug)]
pub struct SiteInfo {
    /// Its name.
    pub name: Name,
    /// Its record.
    pub record: SiteRecord,
    /// The engine's configuration in it.
    pub config: Arc<EngineConfig>,
    /// Scans of all runs.
    pub num_scans: u64,
    /// Observations of all runs.
    pub num_observations: u64,
    /// Words of all levels of all runs.
    pub num_words: u64,
    /// Bytes it occupies on disk.
    pub num_bytes_on_disk: u64,
}

impl Site {
    /// Opens what a storage holds of a site.
    ///
    /// # Errors
    /// [`AppError::NotFound`] when its record is missing; [`StorageError::Corrupt`] when it cannot be read.
    pub(in crate::app) async fn open(name: &Name, store: Arc<dyn SiteStore>) -> Result<Self, AppError> {
        let bytes = store.get(&Key::Site.encode()).await?.ok_or_else(|| AppError::not_found("site", name))?;
        Ok(Self {
            name: name.clone(),
            state: RwLock::new(Arc::new(SiteState::decode(bytes)?)),
            jobs: Jobs::load(&*store).await?,
            store,
            writers: Mutex::default(),
            changing: tokio::sync::Mutex::default(),
            making_runs: tokio::sync::Mutex::default(),
            serving: tokio::sync::RwLock::default(),
            build_requests: AtomicU64::new(0),
            memo: Mutex::default(),
            texts: SiteTexts::default(),
        })
    }

    /// Its name.
    pub fn name(&self) -> &Name {
        &self.name
    }

    /// Its storage, for use cases that write.
    pub(in crate::app) fn store(&self) -> &dyn SiteStore {
        &*self.store
    }

    /// Its storage as of now; later writes do not show in it.
    ///
    /// # Errors
    /// Those of the storage.
    pub(in crate::app) async fn snapshot(&self) -> Result<SiteReader, AppError> {
        let generation = self.generation();
        Ok(SiteReader::new(self.store.snapshot().await?, generation))
    }

    /// Reads what the serving text generation holds as it stands.
    pub fn reader(&self) -> SiteReader {
        SiteReader::new(self.store.clone(), self.generation())
    }

    /// Its record as of now.
    pub fn state(&self) -> Arc<SiteState> {
        Arc::clone(&self.state.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// The text generation that serves.
    pub fn generation(&self) -> Generation {
        self.state().record.generation
    }

    /// Makes another text generation, written with its own partition, the serving one.
    ///
    /// # Errors
    /// Those of the storage.
    pub(in crate::app) async fn serve_generation(
        &self,
        generation: Generation,
        quantizer: &Quantizer,
    ) -> Result<(), AppError> {
        let quantizer_json = serde_json::to_string(quantizer).map_err(AppError::internal)?;
        self.change(|record, _| {
            record.generation = generation;
            record.quantizer_json = Some(quantizer_json);
            Ok(())
        })
        .await
    }

    /// Changes the record together with other writes: `change` edits the record and may add to the batch.
    ///
    /// # Errors
    /// Those of `change`, and of the storage; then nothing was written.
    pub async fn change<T>(
        &self,
        change: impl FnOnce(&mut SiteRecord, &mut Batch) -> Result<T, AppError>,
    ) -> Result<T, AppError> {
        let _queue = self.changing.lock().await;
        let before = self.state();
        let mut record = before.record.clone();
        let mut batch = Batch::default();
        let answer = change(&mut record, &mut batch)?;
        let bytes = codec::encode(&record);
        batch.put(Key::Site.encode(), bytes.clone());
        let unchanged = Precondition { key: Key::Site.encode(), expected: Some(before.bytes.clone()) };
        self.store.commit(batch, vec![unchanged]).await?;
        let state = SiteState { record, config: Arc::clone(&before.config), bytes };
        *self.state.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(state);
        Ok(answer)
    }

    /// A run by its name.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn run(&self, name: &Name) -> Result<Run, AppError> {
        let reader = self.reader();
        match reader.run_idx(name.as_str()).await? {
            Some(idx) => Ok(reader.run(idx).await?),
            None => Err(AppError::not_found("run", name)),
        }
    }

    /// Up to `limit` runs from number `from` on, in the order of their making.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn runs(&self, from: RunIdx, limit: usize) -> Result<Vec<Run>, AppError> {
        let end = from.saturating_add(u32::try_from(limit).unwrap_or(u32::MAX));
        let reader = self.reader();
        let mut runs = Vec::new();
        for idx in from..end.min(self.state().record.num_runs) {
            runs.push(reader.run(idx).await?);
        }
        Ok(runs)
    }

    /// The one writer of a run.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub(in crate::app) async fn writer(
        &self,
        name: &Name,
        num_batches_max: usize,
    ) -> Result<Arc<RunWriter>, AppError> {
        if let Some(writer) = self.writers.lock().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(Arc::clone(writer));
        }
        let run = self.run(name).await?;
        let writer = Arc::new(RunWriter::new(run.idx, run.record, num_batches_max));
        let mut writers = self.writers.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(Arc::clone(writers.entry(name.clone()).or_insert(writer)))
    }

    /// A version of the map, the serving one unless said.
    ///
    /// # Errors
    /// [`AppError::NotReady`] before the first build, [`AppError::NotFound`] for a version that is not kept.
    pub async fn map(&self, version: Option<MapVersion>) -> Result<Map, AppError> {
        let serving = self.state().record.map_version;
        if serving == 0 {
            let detail = "no map has been built yet: finish a run or POST to …/builds".into();
            return Err(AppError::NotReady { detail });
        }
        let version = version.unwrap_or(serving);
        // A version above the serving one is still being written.
        let map = match version <= serving {
            true => self.reader().map(version).await?,
            false => None,
        };
        map.ok_or_else(|| AppError::not_found("map version", version))
    }

    /// Numbers of the versions that are kept, oldest first.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn map_versions(&self) -> Result<Vec<MapVersion>, AppError> {
        let serving = self.state().record.map_version;
        let versions = self.reader().map_versions().await?;
        Ok(versions.into_iter().filter(|version| *version <= serving).collect())
    }

    /// Its jobs, as far as this process knows.
    pub fn jobs(&self) -> &Jobs {
        &self.jobs
    }

    /// All texts as they stand, indexed.
    ///
    /// # Errors
    /// Those of the storage.
    pub(in crate::app) async fn text_segments(&self) -> Result<Vec<Arc<Segment>>, AppError> {
        self.texts.segments(&self.store, &self.state().record).await
    }

    /// What it holds, counted over the heads of its runs.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn info(&self) -> Result<SiteInfo, AppError> {
        let state = self.state();
        let num_runs = state.record.num_runs;
        let run_keys: Vec<_> = (0..num_runs).map(|run| Key::RunHead(run).encode()).collect();
        let text_keys: Vec<_> =
            (0..num_runs).map(|run| Key::TextHead(state.record.generation, run).encode()).collect();
        let heads = decode_all::<RunHead>(&self.store.multi_get(&run_keys).await?)?;
        let texts = decode_all::<TextHead>(&self.store.multi_get(&text_keys).await?)?;
        Ok(SiteInfo {
            name: self.name.clone(),
            config: Arc::clone(&state.config),
            num_scans: heads.iter().map(|head| head.next_sequence).sum(),
            num_observations: texts.iter().map(|text| text.num_observations).sum(),
            num_words: texts.iter().map(TextHead::num_words_all_levels).sum(),
            num_bytes_on_disk: self.store.num_bytes_on_disk().await?,
            record: state.record.clone(),
        })
    }
}

fn decode_all<T: serde::de::DeserializeOwned>(values: &[Option<Bytes>]) -> Result<Vec<T>, StorageError> {
    values.iter().flatten().map(|bytes| codec::decode(bytes, "the head of a run")).collect()
}
