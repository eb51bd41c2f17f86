//! Matches, builds and maps.

use reqwest::Method;

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::types::{Job, LabeledStretch, PlaceMatch};

impl Client {
    /// All matches of a site that pass the filter, a query such as `state=verified` or nothing.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn matches(&self, site: &str, filter: &str) -> Result<Vec<PlaceMatch>, ClientError> {
        let query = if filter.is_empty() { String::new() } else { format!("?{filter}") };
        self.all_pages(&format!("/v1/sites/{site}/matches{query}")).await
    }

    /// Builds the map of everything stored and waits for it.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn build_map(&self, site: &str) -> Result<Job, ClientError> {
        let path = format!("/v1/sites/{site}/builds?wait=true");
        let job: Job = self.json(Method::POST, &path, Body::Empty).await?;
        self.finished(site, job).await
    }

    /// Begins to build the map; [`Client::job`] tells how far it is.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn start_build(&self, site: &str) -> Result<Job, ClientError> {
        self.json(Method::POST, &format!("/v1/sites/{site}/builds"), Body::Empty).await
    }

    /// A job as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn job(&self, site: &str, job: &Job) -> Result<Job, ClientError> {
        let id = match &job.id {
            serde_json::Value::String(id) => id.clone(),
            other => other.to_string(),
        };
        self.json(Method::GET, &format!("/v1/sites/{site}/jobs/{id}"), Body::Empty).await
    }

    /// Waits until a job is done.
    ///
    /// # Errors
    /// See [`ClientError`]; a job that failed.
    pub async fn finished(&self, site: &str, job: Job) -> Result<Job, ClientError> {
        let mut job = job;
        loop {
            match job.state.as_str() {
                "done" => return Ok(job),
                "failed" => {
                    let error = job.error.or(job.detail).unwrap_or_default();
                    return Err(ClientError::JobFailed { kind: job.kind, error });
                }
                _ => tokio::time::sleep(std::time::Duration::from_millis(200)).await,
            }
            job = self.job(site, &job).await?;
        }
    }

    /// The map as its JSON document.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn map(&self, site: &str) -> Result<serde_json::Value, ClientError> {
        self.json(Method::GET, &format!("/v1/sites/{site}/map"), Body::Empty).await
    }

    /// All labelled stretches of driving.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn labels(&self, site: &str) -> Result<Vec<LabeledStretch>, ClientError> {
        self.all_pages(&format!("/v1/sites/{site}/labels")).await
    }
}
