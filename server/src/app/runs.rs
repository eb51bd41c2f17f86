//! Runs: made, found, listed.

use std::sync::{Arc, PoisonError};

use locution_engine::scan::ScanGeometry;

use super::records::{RunHead, StoredRun, TextHead};
use super::run_writer::RunWriter;
use super::site::Site;
use super::translation::RunTranslator;
use super::{App, AppError, Name};
use crate::storage::keys::{Key, RunIdx};
use crate::storage::{Reader, StorageError, codec};

/// What a client says of a run before it sends scans.
#[derive(Clone, Debug, PartialEq)]
pub struct NewRun {
    /// The robot, when there is more to say than the run's name.
    pub robot: Option<String>,
    /// The laser, checked.
    pub geometry: ScanGeometry,
}

/// A run and how far it has come.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Position among the site's runs.
    pub idx: RunIdx,
    /// What it is.
    pub run: Arc<StoredRun>,
    /// How far the recording has come.
    pub head: RunHead,
    /// How far the text has come.
    pub text: TextHead,
}

impl App {
    /// Makes a run or finds it as it stands; true when it was made.
    ///
    /// # Errors
    /// [`AppError::Exists`] when the run stands with another geometry or robot, [`AppError::Invalid`] when the site
    /// is full.
    pub async fn make_run(&self, site: &Site, name: &Name, new: NewRun) -> Result<(RunInfo, bool), AppError> {
        match site.run(name).await {
            Ok(info) if info.run.geometry == new.geometry && info.run.robot == new.robot => Ok((info, false)),
            Ok(_) => {
                let detail = format!("the run `{name}` stands with another geometry or robot");
                Err(AppError::Exists { detail })
            }
            Err(AppError::NotFound { .. }) => {
                // A laser that no translator takes is refused here, not at the first batch.
                let text_config = site.state().text_config()?;
                RunTranslator::new(&text_config.engine, &new.geometry, text_config.quantizer)?;
                self.create_run(site, name, new).await
            }
            Err(error) => Err(error),
        }
    }

    async fn create_run(&self, site: &Site, name: &Name, new: NewRun) -> Result<(RunInfo, bool), AppError> {
        let num_runs_max = self.config().limits.num_runs_per_site_max;
        let run = StoredRun { name: name.to_string(), robot: new.robot, geometry: new.geometry };
        let create = |record: &mut super::records::SiteRecord, batch: &mut crate::storage::Batch| {
            if record.num_runs >= num_runs_max {
                return Err(AppError::invalid(
                    "run",
                    format!("the site holds {num_runs_max} runs, its limit"),
                ));
            }
            let idx = record.num_runs;
            record.num_runs += 1;
            batch.put(Key::RunName(run.name.clone()).encode(), codec::encode(&idx));
            batch.put(Key::Run(idx).encode(), codec::encode(&run));
            batch.put(Key::RunHead(idx).encode(), codec::encode(&RunHead::default()));
            Ok(())
        };
        let made = site.create_unless_named(name, create).await?;
        Ok((site.run(name).await?, made))
    }
}

impl Site {
    /// Runs `create` unless a run of the name was made meanwhile; true when it ran.
    async fn create_unless_named(
        &self,
        name: &Name,
        create: impl FnOnce(&mut super::records::SiteRecord, &mut crate::storage::Batch) -> Result<(), AppError>,
    ) -> Result<bool, AppError> {
        let _queue = self.making_runs.lock().await;
        if self.run_idx(name).await?.is_some() {
            return Ok(false);
        }
        self.change(create).await?;
        Ok(true)
    }

    async fn run_idx(&self, name: &Name) -> Result<Option<RunIdx>, StorageError> {
        let bytes = self.store().get(&Key::RunName(name.to_string()).encode()).await?;
        bytes.map(|bytes| codec::decode(&bytes, "the number of a run")).transpose()
    }

    /// A run by its name.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn run(&self, name: &Name) -> Result<RunInfo, AppError> {
        match self.run_idx(name).await? {
            Some(idx) => Ok(read_run(&**self.store(), self.generation(), idx).await?),
            None => Err(AppError::not_found("run", name)),
        }
    }

    /// Up to `limit` runs from number `from` on, in the order of their making.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn runs(&self, from: RunIdx, limit: usize) -> Result<Vec<RunInfo>, AppError> {
        let end =
            self.state().record.num_runs.min(from.saturating_add(u32::try_from(limit).unwrap_or(u32::MAX)));
        let mut runs = Vec::new();
        for idx in from..end {
            runs.push(read_run(&**self.store(), self.generation(), idx).await?);
        }
        Ok(runs)
    }

    /// The one writer of a run.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub(super) async fn writer(
        &self,
        name: &Name,
        num_batches_max: usize,
    ) -> Result<Arc<RunWriter>, AppError> {
        if let Some(writer) = self.writers.lock().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(Arc::clone(writer));
        }
        let info = self.run(name).await?;
        let writer = Arc::new(RunWriter::new(info.idx, info.run, num_batches_max));
        let mut writers = self.writers.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(Arc::clone(writers.entry(name.clone()).or_insert(writer)))
    }
}

/// Reads a run with its heads.
///
/// # Errors
/// Those of the storage; [`StorageError::Corrupt`] when a counted run is missing.
pub async fn read_run(reader: &dyn Reader, generation: u32, idx: RunIdx) -> Result<RunInfo, StorageError> {
    let keys = [Key::Run(idx), Key::RunHead(idx), Key::TextHead(generation, idx)].map(|key| key.encode());
    let values = reader.multi_get(&keys).await?;
    let missing = || StorageError::Corrupt { what: format!("run {idx} is missing") };
    let run = codec::decode(values[0].as_ref().ok_or_else(missing)?, "a run")?;
    let head = codec::decode(values[1].as_ref().ok_or_else(missing)?, "the head of a run")?;
    let text = values[2].as_ref().map(|bytes| codec::decode(bytes, "the head of a text")).transpose()?;
    Ok(RunInfo { idx, run: Arc::new(run), head, text: text.unwrap_or_default() })
}
