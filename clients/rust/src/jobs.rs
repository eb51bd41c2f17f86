//! Builds and other long work.

use std::time::Duration;

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{Job, JobState};

/// Pause between two looks at a job.
const LOOK_EVERY: Duration = Duration::from_millis(200);

impl Client {
    /// Builds the map of everything stored and waits for it.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn build_map(&self, site: &str) -> Result<Job, ClientError> {
        let query = Query::default().and("wait", Some(true));
        let job = self.answer(&routes::BUILD_MAP, &[site], &query, Body::Empty).await?;
        self.finished(site, job).await
    }

    /// Begins to build the map; [`Client::job`] tells how far it is.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn start_build(&self, site: &str) -> Result<Job, ClientError> {
        self.answer(&routes::BUILD_MAP, &[site], &Query::default(), Body::Empty).await
    }

    /// A job as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn job(&self, site: &str, id: &str) -> Result<Job, ClientError> {
        self.get(&routes::GET_JOB, &[site, id], &Query::default()).await
    }

    /// Cancels a job; answers it as it ended, or as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn cancel_job(&self, site: &str, id: &str) -> Result<Job, ClientError> {
        self.answer(&routes::CANCEL_JOB, &[site, id], &Query::default(), Body::Empty).await
    }

    /// All jobs that are remembered, the newest first.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn jobs(&self, site: &str) -> Result<Vec<Job>, ClientError> {
        self.all(&routes::LIST_JOBS, &[site], Query::default()).await
    }

    /// Waits until a job is done.
    ///
    /// # Errors
    /// See [`ClientError`]; a job that failed or was cancelled.
    pub async fn finished(&self, site: &str, job: Job) -> Result<Job, ClientError> {
        let mut job = job;
        loop {
            match job.state {
                JobState::Done => return Ok(job),
                JobState::Failed | JobState::Cancelled => {
                    return Err(ClientError::JobFailed {
                        id: job.id,
                        error: job.error.unwrap_or(job.detail),
                    });
                }
                JobState::Queued | JobState::Running => tokio::time::sleep(LOOK_EVERY).await,
            }
            job = self.job(site, &job.id).await?;
        }
    }
}
