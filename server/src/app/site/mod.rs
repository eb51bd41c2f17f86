//! A site: its record and how it changes, and what this process keeps of it.
//!
//! The parts (writers of runs, jobs, texts) do not know the site that owns them: they are handed its storage and what
//! they need of its record. Questions and work on a site are use cases of the folders beside this one.

mod events;
mod jobs;
mod progress;
mod remembered;
mod run_writer;
mod state;
mod text_budget;
mod texts;
mod translation;

use std::collections::HashMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use bytes::Bytes;
use locution_engine::config::EngineConfig;
use locution_engine::text::Quantizer;
use tokio_util::sync::CancellationToken;

use super::{AppError, Name};
use crate::records::{
    Generation, Key, Map, MapVersion, Run, RunHead, RunIdx, SiteReader, SiteRecord, TextHead, codec,
};
use crate::storage::{Batch, Precondition, SiteStore, StorageError};

pub use events::{EventId, Events, RunChange, SiteEvent, Watched};
pub use jobs::{JobInfo, Jobs};
pub use progress::{BuildStage, Ending, Progress};
pub use remembered::{BuildMemory, Remembered};
pub use run_writer::{RunWriter, WriterState};
pub use state::{SiteState, TextConfig};
pub use text_budget::TextBudget;
pub use texts::Segment;
use texts::SiteTexts;
pub use translation::{RunTranslator, Translated};

/// A site that is open.
pub struct Site {
    name: Name,
    store: Arc<dyn SiteStore>,
    state: Arc<RwLock<Arc<SiteState>>>,
    writers: Mutex<HashMap<Name, Arc<RunWriter>>>,
    /// Held while the record is changed, so that changes of one process queue up instead of conflicting.
    changing: Arc<tokio::sync::Mutex<()>>,
    pub(in crate::app) making_runs: tokio::sync::Mutex<()>,
    /// Held for reading while scans are appended, for writing while another text generation begins to serve.
    pub(in crate::app) serving: tokio::sync::RwLock<()>,
    jobs: Jobs,
    events: Arc<Events>,
    pub(in crate::app) build_requests: AtomicU64,
    /// Registrations that earlier builds computed.
    pub(in crate::app) remembered: Remembered,
    texts: Arc<SiteTexts>,
    text_budget: Arc<TextBudget>,
    /// Set when the site is deleted or the server ends: jobs give way.
    pub(in crate::app) stop: CancellationToken,
}

/// What a site is and holds.
#[derive(Clone, Debug)]
pub struct SiteInfo {
    pub name: Name,
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

impl SiteInfo {
    /// Runs that are there.
    pub fn num_runs(&self) -> u32 {
        self.record.num_runs - self.record.num_deleted_runs
    }
}

impl Site {
    /// Opens what a storage holds of a site; one from before sites had a birth is given one.
    ///
    /// # Errors
    /// [`AppError::NotFound`] when its record is missing; [`StorageError::Corrupt`] when it cannot be read.
    pub(in crate::app) async fn open(
        name: &Name,
        store: Arc<dyn SiteStore>,
        text_budget: Arc<TextBudget>,
        stop: CancellationToken,
        birth_if_none: u64,
    ) -> Result<Self, AppError> {
        let bytes = store.get(&Key::Site.encode()).await?.ok_or_else(|| AppError::not_found("site", name))?;
        let is_outdated = SiteRecord::is_outdated(&bytes);
        let site = Self {
            name: name.clone(),
            state: Arc::new(RwLock::new(Arc::new(SiteState::decode(bytes, birth_if_none)?))),
            jobs: Jobs::load(&*store, stop.clone()).await?,
            events: Arc::new(Events::new(stop.clone())),
            store,
            writers: Mutex::default(),
            changing: Arc::default(),
            making_runs: tokio::sync::Mutex::default(),
            serving: tokio::sync::RwLock::default(),
            build_requests: AtomicU64::new(0),
            remembered: Remembered::default(),
            texts: Arc::default(),
            text_budget,
            stop,
        };
        if is_outdated {
            // The birth just drawn must be the same after the next start.
            site.change(|_, _| Ok(())).await.or_else(unless_full)?;
        }
        Ok(site)
    }

    /// Tells this site from any other that had or will have its name.
    pub fn birth(&self) -> u64 {
        self.state().record.birth
    }

    /// Bytes of the indexes of its texts.
    pub(in crate::app) fn num_index_bytes(&self) -> usize {
        self.texts.num_index_bytes()
    }

    pub fn name(&self) -> &Name {
        &self.name
    }

    /// Its storage, for use cases that write.
    pub(in crate::app) fn store(&self) -> &dyn SiteStore {
        &*self.store
    }

    /// Its storage as of now; later writes do not show in it.
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
        let queue = Arc::clone(&self.changing).lock_owned().await;
        let before = self.state();
        let mut record = before.record.clone();
        let mut batch = Batch::default();
        let answer = change(&mut record, &mut batch)?;
        let bytes = record.encode();
        batch.put(Key::Site.encode(), bytes.clone());
        let unchanged = Precondition { key: Key::Site.encode(), expected: Some(before.bytes.clone()) };
        let config = match record.config_json == before.record.config_json {
            true => Arc::clone(&before.config),
            false => SiteState::decode(bytes.clone(), record.birth)?.config,
        };
        let after = SiteState { record, config, bytes };
        let (store, state) = (Arc::clone(&self.store), Arc::clone(&self.state));
        // In a task of its own: a client that hangs up ends its request, and must not leave the record behind what is stored.
        let writing = async move {
            let _queue = queue;
            let outcome = store.commit(batch, vec![unchanged]).await;
            let stands = match &outcome {
                Ok(()) => Some(after),
                // After a commit that failed the record may stand as it was or as it should have become.
                Err(_) => match store.get(&Key::Site.encode()).await? {
                    Some(bytes) => Some(SiteState::decode(bytes, before.record.birth)?),
                    None => None,
                },
            };
            if let Some(stands) = stands {
                *state.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(stands);
            }
            outcome.map_err(AppError::from)
        };
        tokio::spawn(writing).await.map_err(AppError::internal)??;
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

    /// Up to `limit` runs from number `from` on, in the order of their making, and the number to go on with.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn runs(&self, from: RunIdx, limit: usize) -> Result<(Vec<Run>, Option<RunIdx>), AppError> {
        let reader = self.reader();
        let mut runs = Vec::new();
        for idx in from..self.state().record.num_runs {
            let run = reader.run(idx).await?;
            if run.record.is_deleted() {
                continue;
            }
            if runs.len() == limit {
                return Ok((runs, Some(idx)));
            }
            runs.push(run);
        }
        Ok((runs, None))
    }

    /// Lets go of the writer of a run that was deleted.
    pub(in crate::app) fn let_go(&self, name: &Name) {
        self.writers.lock().unwrap_or_else(PoisonError::into_inner).remove(name);
    }

    /// Reads and indexes all texts anew when they are next asked about.
    pub(in crate::app) async fn forget_texts(&self) {
        self.texts.forget().await;
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
    pub async fn map_versions(&self) -> Result<Vec<MapVersion>, AppError> {
        let serving = self.state().record.map_version;
        let versions = self.reader().map_versions().await?;
        Ok(versions.into_iter().filter(|version| *version <= serving).collect())
    }

    /// Its jobs, as far as this process knows.
    pub fn jobs(&self) -> &Jobs {
        &self.jobs
    }

    /// What happens in it.
    pub fn events(&self) -> &Arc<Events> {
        &self.events
    }

    /// All texts as they stand, indexed.
    pub(in crate::app) async fn text_segments(&self) -> Result<Vec<Arc<Segment>>, AppError> {
        let segments = self.texts.segments(&self.store, &self.state().record).await?;
        self.text_budget.used(&self.texts);
        Ok(segments)
    }

    /// What it holds, counted over the heads of its runs.
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

/// Opening writes a little; on a full disk it must do without, so that reading goes on.
fn unless_full(error: AppError) -> Result<(), AppError> {
    match error {
        AppError::Storage(StorageError::Full { .. }) => Ok(()),
        error => Err(error),
    }
}
