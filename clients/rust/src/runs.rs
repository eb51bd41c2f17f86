//! Sites, runs and what was read from them.

use reqwest::Method;

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::types::{NewRun, Observation, RunStatus, SiteStatus, Trajectory, Word};

impl Client {
    /// Makes a site, or finds it as it stands. `config` is the engine's, whole or in part.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 when it stands with another configuration.
    pub async fn put_site(
        &self,
        site: &str,
        config: Option<&serde_json::Value>,
    ) -> Result<SiteStatus, ClientError> {
        let body = match config {
            Some(config) => serde_json::json!({ "config": config }),
            None => serde_json::json!({}),
        };
        self.json(Method::PUT, &format!("/v1/sites/{site}"), Body::json(&body)?).await
    }

    /// A site as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn site(&self, site: &str) -> Result<SiteStatus, ClientError> {
        self.json(Method::GET, &format!("/v1/sites/{site}"), Body::Empty).await
    }

    /// Deletes a site with everything in it.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn delete_site(&self, site: &str) -> Result<(), ClientError> {
        self.send(Method::DELETE, &format!("/v1/sites/{site}"), "application/json", Body::Empty)
            .await
            .map(drop)
    }

    /// Makes a run, or finds it as it stands.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 when it stands with another geometry.
    pub async fn put_run(&self, site: &str, run: &str, new_run: &NewRun) -> Result<RunStatus, ClientError> {
        self.json(Method::PUT, &format!("/v1/sites/{site}/runs/{run}"), Body::json(new_run)?).await
    }

    /// A run as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn run(&self, site: &str, run: &str) -> Result<RunStatus, ClientError> {
        self.json(Method::GET, &format!("/v1/sites/{site}/runs/{run}"), Body::Empty).await
    }

    /// All runs of a site.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn runs(&self, site: &str) -> Result<Vec<RunStatus>, ClientError> {
        self.all_pages(&format!("/v1/sites/{site}/runs")).await
    }

    /// Says that no more scans will come, so that delayed observations and pending words are written.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn finish_run(&self, site: &str, run: &str) -> Result<(), ClientError> {
        let path = format!("/v1/sites/{site}/runs/{run}/finish");
        self.send(Method::POST, &path, "application/json", Body::Empty).await.map(drop)
    }

    /// All observations of a run.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn observations(&self, site: &str, run: &str) -> Result<Vec<Observation>, ClientError> {
        self.all_pages(&format!("/v1/sites/{site}/runs/{run}/observations")).await
    }

    /// All words of a run, of one level or of all.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn words(&self, site: &str, run: &str, level: Option<u8>) -> Result<Vec<Word>, ClientError> {
        let query = level.map_or(String::new(), |level| format!("?level={level}"));
        self.all_pages(&format!("/v1/sites/{site}/runs/{run}/words{query}")).await
    }

    /// A pose for every scan of a run in frame `map`, `run` or `odom`.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn trajectory(&self, site: &str, run: &str, frame: &str) -> Result<Trajectory, ClientError> {
        let path = format!("/v1/sites/{site}/runs/{run}/trajectory?frame={frame}");
        self.json(Method::GET, &path, Body::Empty).await
    }
}
