//! Sites: made, found, described, deleted.

use std::sync::{Arc, PoisonError};

use futures::future::join_all;
use futures::{StreamExt, stream};
use locution_engine::config::EngineConfig;
use rand::TryRng;
use rand::rngs::SysRng;

use super::site::{JobInfo, Site};
use super::{App, AppError, Name};
use crate::records::{JobKind, Key, Retention, SiteRecord};
use crate::storage::{Batch, Precondition};

/// Sites that are opened at once when all are asked for.
const NUM_OPENED_AT_ONCE: usize = 8;

/// A site in a list.
pub struct ListedSite {
    /// Its name.
    pub name: Name,
    /// The site, or why it cannot be opened.
    pub site: Result<Arc<Site>, AppError>,
}

/// Nothing but chance tells a site from another of the same name.
pub(super) fn new_birth() -> Result<u64, AppError> {
    SysRng.try_next_u64().map_err(AppError::internal)
}

/// Those who wait for a site to be opened, so that it is opened once; sites do not wait for each other.
struct OpeningQueue<'a> {
    app: &'a App,
    name: &'a Name,
    turns: Arc<tokio::sync::Mutex<()>>,
}

impl<'a> OpeningQueue<'a> {
    fn of(app: &'a App, name: &'a Name) -> Self {
        let mut queues = app.opening_sites.lock().unwrap_or_else(PoisonError::into_inner);
        let turns = Arc::clone(queues.entry(name.clone()).or_default());
        Self { app, name, turns }
    }
}

impl Drop for OpeningQueue<'_> {
    fn drop(&mut self) {
        let mut queues = self.app.opening_sites.lock().unwrap_or_else(PoisonError::into_inner);
        // The table and this guard hold it, and nobody can join while the table is locked.
        if Arc::strong_count(&self.turns) == 2 {
            queues.remove(self.name);
        }
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
        self.check_here(name)?;
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
            birth: new_birth()?,
            num_deleted_runs: 0,
            retention: Retention::default(),
        };
        let store = self.storage.open(name.as_str()).await?;
        let mut batch = Batch::default();
        batch.put(Key::Site.encode(), record.encode());
        store.commit(batch, vec![Precondition { key: Key::Site.encode(), expected: None }]).await?;
        self.site(name).await
    }

    /// Refuses what another server serves.
    pub(super) fn check_here(&self, name: &Name) -> Result<(), AppError> {
        match self.serves.get() {
            Some(serves) if !serves(name.as_str()) => Err(AppError::Elsewhere),
            _ => Ok(()),
        }
    }

    /// An existing site.
    ///
    /// # Errors
    /// [`AppError::NotFound`]; [`AppError::Elsewhere`] when another server serves it.
    pub async fn site(self: &Arc<Self>, name: &Name) -> Result<Arc<Site>, AppError> {
        self.check_here(name)?;
        if let Some(site) = self.open_site(name) {
            return Ok(site);
        }
        let queue = OpeningQueue::of(self, name);
        let _turn = queue.turns.lock().await;
        match self.open_site(name) {
            Some(site) => Ok(site),
            None => self.open_stored_site(name).await,
        }
    }

    /// A site that this process has open. One whose handle has ended, since another server took the site over or the
    /// store did not answer, is let go; asking for it again opens it anew.
    fn open_site(&self, name: &Name) -> Option<Arc<Site>> {
        let mut sites = self.sites.lock().unwrap_or_else(PoisonError::into_inner);
        let site = sites.get(name)?;
        if !site.store().is_over() {
            return Some(Arc::clone(site));
        }
        tracing::warn!(site = %name, "this process has lost the site");
        site.stop.cancel();
        sites.remove(name);
        None
    }

    /// Closes the sites that this server has open and is not to keep, since another one will serve them.
    pub async fn let_go(&self, is_kept: impl Fn(&str) -> bool) {
        let gone: Vec<(Name, Arc<Site>)> = {
            let mut sites = self.sites.lock().unwrap_or_else(PoisonError::into_inner);
            sites.extract_if(|name, _| !is_kept(name.as_str())).collect()
        };
        let close = gone.into_iter().map(|(name, site)| async move {
            site.stop.cancel();
            if let Err(error) = self.storage.release(name.as_str()).await {
                tracing::warn!(site = %name, %error, "a site that moves away was not closed in order");
            }
        });
        join_all(close).await;
    }

    /// Names of all sites of the storage, in order, whoever serves them.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn site_names(&self) -> Result<Vec<Name>, AppError> {
        let names = self.storage.list().await?;
        // A directory whose name no site can have is not ours.
        Ok(names.iter().filter_map(|name| Name::new(name, "site").ok()).collect())
    }

    async fn open_stored_site(self: &Arc<Self>, name: &Name) -> Result<Arc<Site>, AppError> {
        // Opening makes what does not exist, so a request for an unknown site must not get that far.
        if !self.storage.contains(name.as_str()).await? {
            return Err(AppError::not_found("site", name));
        }
        let store = self.storage.open(name.as_str()).await?;
        let site =
            Site::open(name, store, Arc::clone(&self.text_budget), self.stop.child_token(), new_birth()?)
                .await?;
        let site = Arc::new(site);
        self.sites.lock().unwrap_or_else(PoisonError::into_inner).insert(name.clone(), Arc::clone(&site));
        if let Err(error) = self.check_here(name) {
            // It moved away while it was opened.
            self.let_go(|site| site != name.as_str()).await;
            return Err(error);
        }
        self.work_on(&site);
        index_texts(&site);
        Ok(site)
    }

    /// All sites of this server that `is_wanted`, by name, those that cannot be opened left out.
    ///
    /// # Errors
    /// Those of the storage as a whole.
    pub async fn sites(
        self: &Arc<Self>,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<Arc<Site>>, AppError> {
        let listed = self.listed_sites(is_wanted).await?;
        Ok(listed.into_iter().filter_map(|listed| listed.site.ok()).collect())
    }

    /// All sites of this server that `is_wanted`, by name; of those that cannot be opened, why not.
    ///
    /// # Errors
    /// Those of the storage as a whole.
    pub async fn listed_sites(
        self: &Arc<Self>,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Vec<ListedSite>, AppError> {
        let mut names = self.site_names().await?;
        names.retain(|name| is_wanted(name.as_str()) && self.check_here(name).is_ok());
        let listed = stream::iter(names).map(|name| async move {
            match self.site(&name).await {
                // Deleted or moved between the listing and now, or its making was cut short.
                Err(AppError::NotFound { .. } | AppError::Elsewhere) => None,
                site => Some(ListedSite { name, site }),
            }
        });
        Ok(listed.buffered(NUM_OPENED_AT_ONCE).filter_map(async |listed| listed).collect().await)
    }

    /// Changes how a site is mapped and asked, and how much of it is kept; answers the job that makes a map accordingly,
    /// when something changed and there is a map.
    ///
    /// # Errors
    /// [`AppError::Invalid`] for a configuration that cannot work, and for another translator: the texts of a site are
    /// written by one.
    pub async fn change_site(
        self: &Arc<Self>,
        site: &Arc<Site>,
        config: Option<EngineConfig>,
        retention: Option<Retention>,
    ) -> Result<Option<JobInfo>, AppError> {
        let state = site.state();
        if let Some(config) = &config {
            config.validate()?;
            if config.translator != state.config.translator {
                let problem = "a site keeps the translator that its texts are written by; make another site for another";
                return Err(AppError::invalid("config.translator", problem));
            }
        }
        let config = config.filter(|config| *config != *state.config);
        let retention = retention.filter(|retention| *retention != state.record.retention);
        if config.is_none() && retention.is_none() {
            return Ok(None);
        }
        let config_json = config.map(|config| serde_json::to_string(&config)).transpose();
        let config_json = config_json.map_err(AppError::internal)?;
        site.change(|record, _| {
            record.config_json = config_json.unwrap_or_else(|| record.config_json.clone());
            record.retention = retention.unwrap_or(record.retention);
            Ok(())
        })
        .await?;
        self.forget_served(site).await;
        if state.record.map_version == 0 {
            self.enforce_retention(site).await?;
            return Ok(None);
        }
        Ok(Some(self.queue_job(site, JobKind::Build).await?))
    }

    /// Forgets a site and everything in it.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn delete_site(self: &Arc<Self>, name: &Name) -> Result<(), AppError> {
        let _queue = self.making_sites.lock().await;
        match self.site(name).await {
            Ok(site) => site.stop.cancel(),
            Err(error @ (AppError::NotFound { .. } | AppError::Elsewhere)) => return Err(error),
            // A site that cannot be opened can still be deleted.
            Err(_) => {}
        }
        self.sites.lock().unwrap_or_else(PoisonError::into_inner).remove(name);
        Ok(self.storage.delete(name.as_str()).await?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ServerConfig;
    use crate::storage::{MemoryStorage, Storage};

    #[tokio::test(flavor = "multi_thread")]
    async fn indexes_that_nobody_asks_for_make_way_and_come_back() {
        use crate::app::ask::find_words;
        let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::default());
        let mut config = ServerConfig::default();
        config.limits.text_index_bytes_max = 1;
        config.builds.is_automatic = false;
        let app = Arc::new(App::new(config, storage));
        let mut sites = Vec::new();
        for name in ["a", "b"] {
            let (site, _) = app.make_site(&Name::new(name, "site").unwrap(), None).await.unwrap();
            crate::app::faults::drive(&app, &site, &Name::new("r", "run").unwrap(), 240).await;
            sites.push(site);
        }
        let pattern = [locution_engine::index::WordPattern::default()];
        let ask = async |site: &Arc<Site>| format!("{:?}", find_words(site, &pattern, 9).await.unwrap());
        let answer = ask(&sites[0]).await;
        assert!(answer.contains("fit") && sites[0].num_index_bytes() > 0);
        ask(&sites[1]).await;
        assert_eq!(sites[0].num_index_bytes(), 0, "it made way for the other");
        assert!(sites[1].num_index_bytes() > 0, "whoever was asked last stays");
        assert_eq!(ask(&sites[0]).await, answer);
    }

    #[tokio::test]
    async fn a_site_made_again_is_another_one_and_a_reopened_one_the_same() {
        let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::default());
        let app = Arc::new(App::new(ServerConfig::default(), Arc::clone(&storage)));
        let name = Name::new("s", "site").unwrap();
        let (first, _) = app.make_site(&name, None).await.unwrap();
        let reopened = Arc::new(App::new(ServerConfig::default(), storage));
        let again = reopened.site(&name).await.unwrap();
        assert_eq!(again.state().record.birth, first.state().record.birth);
        app.delete_site(&name).await.unwrap();
        let (second, _) = app.make_site(&name, None).await.unwrap();
        assert_ne!(second.state().record.birth, first.state().record.birth);
    }
}
