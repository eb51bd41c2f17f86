//! Sites: made, found, described, deleted.

use std::collections::HashMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use bytes::Bytes;
use locution_engine::config::EngineConfig;
use locution_engine::mapping::RegistrationMemo;
use locution_engine::text::Quantizer;

use super::jobs::Jobs;
use super::records::{RunHead, SiteRecord, TextHead};
use super::run_writer::RunWriter;
use super::site_texts::SiteTexts;
use super::{App, AppError, Name};
use crate::storage::keys::{Generation, Key};
use crate::storage::{Batch, Precondition, SiteStore, StorageError, codec};

/// An open site.
pub struct Site {
    name: Name,
    store: Arc<dyn SiteStore>,
    state: RwLock<Arc<SiteState>>,
    pub(super) writers: Mutex<HashMap<Name, Arc<RunWriter>>>,
    /// Held while the record is changed, so that changes of one process queue up instead of conflicting.
    changing: tokio::sync::Mutex<()>,
    pub(super) making_runs: tokio::sync::Mutex<()>,
    /// Held for reading while scans are appended, for writing while another text generation begins to serve.
    pub(super) serving: tokio::sync::RwLock<()>,
    pub(super) jobs: Jobs,
    pub(super) build_requests: AtomicU64,
    /// Registrations that earlier builds computed.
    pub(super) memo: Mutex<RegistrationMemo>,
    pub(super) texts: SiteTexts,
}

/// The site's record as last read or written.
#[derive(Clone, Debug)]
pub struct SiteState {
    /// The record.
    pub record: SiteRecord,
    /// The engine's configuration in it.
    pub config: Arc<EngineConfig>,
    bytes: Bytes,
}

impl SiteState {
    fn decode(bytes: Bytes) -> Result<Self, StorageError> {
        let record: SiteRecord = codec::decode(&bytes, "the record of the site")?;
        let config = stored_config(&record.config_json).map_err(|error| StorageError::Corrupt {
            what: format!("the configuration of the site: {error}"),
        })?;
        Ok(Self { record, config: Arc::new(config), bytes })
    }

    /// How the texts of the serving generation are written.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn text_config(&self) -> Result<TextConfig, StorageError> {
        let parse = |json: &String| {
            serde_json::from_str(json).map_err(|error| StorageError::Corrupt {
                what: format!("the partition of densities: {error}"),
            })
        };
        let quantizer = self.record.quantizer_json.as_ref().map(parse).transpose()?;
        Ok(TextConfig { engine: Arc::clone(&self.config), quantizer })
    }
}

/// A site's configuration as it was stored; sections that configured no part of the server, and that sites of older
/// versions hold, are passed over.
fn stored_config(json: &str) -> Result<EngineConfig, serde_json::Error> {
    const RETIRED: [&str; 3] = ["density_field", "density_model", "particle_filter"];
    let mut config: serde_json::Value = serde_json::from_str(json)?;
    if let Some(localization) = config.get_mut("localization").and_then(serde_json::Value::as_object_mut) {
        localization.retain(|section, _| !RETIRED.contains(&section.as_str()));
    }
    serde_json::from_value(config)
}

/// All that decides what text a run becomes.
#[derive(Clone, Debug)]
pub struct TextConfig {
    /// The site's configuration.
    pub engine: Arc<EngineConfig>,
    /// The partition of densities that the generation is written with, when it is not the configured one.
    pub quantizer: Option<Quantizer>,
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
    /// Its name.
    pub fn name(&self) -> &Name {
        &self.name
    }

    /// Its storage.
    pub fn store(&self) -> &Arc<dyn SiteStore> {
        &self.store
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
    pub(super) async fn serve_generation(
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

/// Indexes the texts of a site in the background, so that the first question need not wait for it.
fn index_texts(site: &Arc<Site>) {
    let site = Arc::clone(site);
    tokio::spawn(async move {
        if let Err(error) = site.text_segments().await {
            tracing::warn!(site = %site.name(), %error, "the texts cannot be indexed");
        }
    });
}

fn decode_all<T: serde::de::DeserializeOwned>(values: &[Option<Bytes>]) -> Result<Vec<T>, StorageError> {
    values.iter().flatten().map(|bytes| codec::decode(bytes, "the head of a run")).collect()
}

impl App {
    /// Makes a site or finds it as it stands; true when it was made.
    ///
    /// # Errors
    /// [`AppError::Invalid`] for a configuration that cannot work, [`AppError::Exists`] when the site stands with
    /// another one.
    pub async fn make_site(
        self: &Arc<Self>,
        name: &Name,
        config: Option<EngineConfig>,
    ) -> Result<(Arc<Site>, bool), AppError> {
        if let Some(config) = &config {
            config.validate()?;
        }
        let _queue = self.making_sites.lock().await;
        match self.site(name).await {
            Ok(site) => {
                let state = site.state();
                if config.is_some_and(|config| config != *state.config) {
                    let detail = format!("the site `{name}` stands with another configuration");
                    return Err(AppError::Exists { detail });
                }
                Ok((site, false))
            }
            Err(AppError::NotFound { .. }) => {
                Ok((self.create_site(name, config.unwrap_or_default()).await?, true))
            }
            Err(error) => Err(error),
        }
    }

    async fn create_site(self: &Arc<Self>, name: &Name, config: EngineConfig) -> Result<Arc<Site>, AppError> {
        let record = SiteRecord {
            config_json: serde_json::to_string(&config).map_err(AppError::internal)?,
            num_runs: 0,
            generation: 0,
            quantizer_json: None,
            map_version: 0,
            next_job: 1,
            next_decision: 1,
        };
        let store = self.storage.open(name.as_str()).await?;
        let mut batch = Batch::default();
        batch.put(Key::Site.encode(), codec::encode(&record));
        store.commit(batch, vec![Precondition { key: Key::Site.encode(), expected: None }]).await?;
        self.site(name).await
    }

    /// An existing site.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn site(self: &Arc<Self>, name: &Name) -> Result<Arc<Site>, AppError> {
        if let Some(site) = self.sites.lock().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(Arc::clone(site));
        }
        let _queue = self.opening_sites.lock().await;
        if let Some(site) = self.sites.lock().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(Arc::clone(site));
        }
        // Opening makes what does not exist, so a request for an unknown site must not get that far.
        if !self.storage.list().await?.iter().any(|known| known == name.as_str()) {
            return Err(AppError::not_found("site", name));
        }
        let store = self.storage.open(name.as_str()).await?;
        let bytes = store.get(&Key::Site.encode()).await?.ok_or_else(|| AppError::not_found("site", name))?;
        let site = Arc::new(Site {
            name: name.clone(),
            store,
            state: RwLock::new(Arc::new(SiteState::decode(bytes)?)),
            writers: Mutex::default(),
            changing: tokio::sync::Mutex::default(),
            making_runs: tokio::sync::Mutex::default(),
            serving: tokio::sync::RwLock::default(),
            jobs: Jobs::default(),
            build_requests: AtomicU64::new(0),
            memo: Mutex::default(),
            texts: SiteTexts::default(),
        });
        site.load_jobs().await?;
        self.sites.lock().unwrap_or_else(PoisonError::into_inner).insert(name.clone(), Arc::clone(&site));
        self.work_on(&site);
        index_texts(&site);
        Ok(site)
    }

    /// All sites that `is_wanted`, by name.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn sites(
        self: &Arc<Self>,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<Arc<Site>>, AppError> {
        let mut sites = Vec::new();
        for name in self.storage.list().await? {
            if !is_wanted(&name) {
                continue;
            }
            match self.site(&Name::new(&name, "site")?).await {
                Ok(site) => sites.push(site),
                // Deleted between the listing and now, or its making was cut short.
                Err(AppError::NotFound { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(sites)
    }

    /// Forgets a site and everything in it.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn delete_site(self: &Arc<Self>, name: &Name) -> Result<(), AppError> {
        let _queue = self.making_sites.lock().await;
        self.site(name).await?;
        self.sites.lock().unwrap_or_else(PoisonError::into_inner).remove(name);
        Ok(self.storage.delete(name.as_str()).await?)
    }
}
