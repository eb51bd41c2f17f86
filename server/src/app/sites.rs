//! Sites: made, found, described, deleted.

use std::sync::{Arc, PoisonError};

use locution_engine::config::EngineConfig;

use super::site::Site;
use super::{App, AppError, Name};
use crate::records::{Key, SiteRecord, codec};
use crate::storage::{Batch, Precondition};

/// Indexes the texts of a site in the background, so that the first question need not wait for it.
fn index_texts(site: &Arc<Site>) {
    let site = Arc::clone(site);
    tokio::spawn(async move {
        if let Err(error) = site.text_segments().await {
            tracing::warn!(site = %site.name(), %error, "the texts cannot be indexed");
        }
    });
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
        let site = Arc::new(Site::open(name, store).await?);
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
