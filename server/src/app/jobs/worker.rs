//! Works on the jobs of sites: one at a time and in order for a site, so many at once over all sites.

use std::sync::Arc;

use crate::app::site::{JobInfo, Progress, Site};
use crate::app::{App, AppError};
use crate::records::{JobKind, JobRecord, JobState, Key, codec};

impl App {
    /// Queues a job and sees that it is worked on. One of the same kind that still waits will do.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn queue_job(self: &Arc<Self>, site: &Arc<Site>, kind: JobKind) -> Result<JobInfo, AppError> {
        if let Some(waiting) = site.jobs().waiting(kind) {
            return Ok(waiting);
        }
        let record = site
            .change(|site_record, batch| {
                let id = site_record.next_job;
                site_record.next_job += 1;
                let detail = "waiting for its turn".into();
                let record =
                    JobRecord { id, kind, state: JobState::Queued, num_attempts: 0, detail, error: None };
                batch.put(Key::Job(id).encode(), codec::encode(&record));
                Ok(record)
            })
            .await?;
        let id = record.id;
        site.jobs().insert(record);
        self.work_on(site);
        site.jobs().get(id)
    }

    /// Sees that the jobs of a site are worked on.
    pub(in crate::app) fn work_on(self: &Arc<Self>, site: &Arc<Site>) {
        if site.jobs().begin_work() {
            let (app, site) = (Arc::clone(self), Arc::clone(site));
            tokio::spawn(async move { app.work(&site).await });
        }
    }

    async fn work(self: Arc<Self>, site: &Arc<Site>) {
        while let Some((job, progress)) = site.jobs().next() {
            if let Err(error) = self.run_job(site, job, &progress).await {
                // The job could not even be marked: the storage is gone or the site was deleted.
                tracing::warn!(site = %site.name(), %error, "jobs of this site stop");
                site.jobs().stop_work();
                return;
            }
        }
    }

    async fn run_job(
        self: &Arc<Self>,
        site: &Arc<Site>,
        mut job: JobRecord,
        progress: &Arc<Progress>,
    ) -> Result<(), AppError> {
        let _turn = self.job_slots.acquire().await.map_err(AppError::internal)?;
        job.state = JobState::Running;
        job.num_attempts += 1;
        site.jobs().store(site.store(), &job).await?;
        let (app, for_task, for_progress) = (Arc::clone(self), Arc::clone(site), Arc::clone(progress));
        let kind = job.kind;
        // A task of its own, so that a panic in the engine becomes a failed job.
        let work = tokio::spawn(async move {
            match kind {
                JobKind::Build => app.build(&for_task, &for_progress).await,
            }
        });
        match work.await.unwrap_or_else(|error| Err(AppError::internal(error))) {
            Ok(detail) => (job.state, job.detail) = (JobState::Done, detail),
            Err(error) => {
                tracing::warn!(site = %site.name(), job = job.id, %error, "a job failed");
                job.state = JobState::Failed;
                job.detail = progress.detail();
                job.error = Some(error.to_string());
            }
        }
        let outcome = site.jobs().store(site.store(), &job).await;
        site.jobs().tell_ended();
        outcome
    }
}
