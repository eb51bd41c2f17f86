//! Works on the jobs of sites: one at a time and in order for a site, so many at once over all sites.
//!
//! A job that has had its turn while those of other sites wait ends its attempt; what it has registered is kept, so that
//! it goes on from there when its turn comes again.

use std::sync::Arc;
use std::time::Duration;

use super::turns::Turn;
use crate::app::site::{Ending, JobInfo, Progress, Site, SiteEvent};
use crate::app::{App, AppError};
use crate::records::{JobKind, JobRecord, JobState, Key, codec};

/// A job that has to end is waited for so long; then it is left to itself.
const PATIENCE: Duration = Duration::from_secs(1);

impl App {
    /// Queues a job and sees that it is worked on. One of the same kind that still waits will do.
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
        tell_of(site, id);
        self.work_on(site);
        site.jobs().get(id)
    }

    /// Cancels a job, and answers when it has ended or a while has passed; one that has ended stays as it is.
    ///
    /// # Errors
    /// [`AppError::NotFound`]; those of the storage.
    pub async fn cancel_job(&self, site: &Site, id: u64) -> Result<JobInfo, AppError> {
        if let Some(cancelled) = site.jobs().cancel(id)? {
            site.jobs().store(site.store(), &cancelled).await?;
            site.jobs().tell_ended();
            tell_of(site, id);
        }
        match tokio::time::timeout(2 * PATIENCE, site.jobs().ended(id)).await {
            Ok(ended) => ended,
            Err(_) => site.jobs().get(id),
        }
    }

    /// Sees that the jobs of a site are worked on.
    pub(in crate::app) fn work_on(self: &Arc<Self>, site: &Arc<Site>) {
        if site.jobs().begin_work() {
            let (app, site) = (Arc::clone(self), Arc::clone(site));
            self.working.spawn(async move { app.work(&site).await });
        }
    }

    async fn work(self: Arc<Self>, site: &Arc<Site>) {
        while let Some((job, progress)) = site.jobs().next() {
            if let Err(error) = self.run_job(site, job.id, &progress).await {
                if !matches!(error, AppError::Stopping) {
                    // The job could not even be marked: the storage is gone.
                    tracing::warn!(site = %site.name(), %error, "jobs of this site stop");
                }
                site.jobs().stop_work();
                return;
            }
        }
    }

    /// Works on a job, in several turns when others wait, until it has ended.
    async fn run_job(
        self: &Arc<Self>,
        site: &Arc<Site>,
        id: u64,
        progress: &Arc<Progress>,
    ) -> Result<(), AppError> {
        let mut begun = None;
        let mut num_given_up = 0;
        let outcome = loop {
            let turn = tokio::select! {
                turn = self.turns.take(num_given_up) => turn?,
                () = progress.ended() => break Err(AppError::Stopping),
            };
            if begun.is_none() {
                begun = site.jobs().begin(id);
                let Some(job) = &begun else { return Ok(()) };
                site.jobs().store(site.store(), job).await?;
                tell_of(site, id);
            }
            progress.go_on();
            let outcome = self.attempt(site, progress, &turn).await;
            progress.pause();
            if matches!(outcome, Err(AppError::Stopping)) && progress.ending() == Some(Ending::GivesWay) {
                num_given_up += 1;
                continue;
            }
            break outcome;
        };
        let Some(job) = begun else {
            // One that waited for its first turn stands in storage as it should.
            return if progress.ending() == Some(Ending::Stopping) {
                Err(AppError::Stopping)
            } else {
                Ok(())
            };
        };
        end_job(site, job, progress, outcome).await
    }

    /// Works on a job until it is done, has to end, or somebody else should have the turn.
    async fn attempt(
        self: &Arc<Self>,
        site: &Arc<Site>,
        progress: &Arc<Progress>,
        turn: &Turn<'_>,
    ) -> Result<String, AppError> {
        let (app, for_task, for_progress) = (Arc::clone(self), Arc::clone(site), Arc::clone(progress));
        // A task of its own, so that a panic in the engine becomes a failed job.
        let mut work = tokio::spawn(async move { app.build(&for_task, &for_progress).await });
        let mut is_over = std::pin::pin!(turn.is_over());
        let mut gives_way = false;
        loop {
            tokio::select! {
                outcome = &mut work => return outcome.unwrap_or_else(|error| Err(AppError::internal(error))),
                () = &mut is_over, if !gives_way => {
                    progress.give_way();
                    gives_way = true;
                }
                () = progress.ended() => {
                    let outcome = tokio::time::timeout(PATIENCE, &mut work).await;
                    return outcome.map_or_else(
                        |_| {
                            work.abort();
                            Err(AppError::Stopping)
                        },
                        |outcome| outcome.unwrap_or_else(|error| Err(AppError::internal(error))),
                    );
                }
            }
        }
    }
}

/// Tells those who watch where a job is.
fn tell_of(site: &Site, id: u64) {
    if let Ok(job) = site.jobs().get(id) {
        site.events().tell(SiteEvent::Job(job));
    }
}

/// Stores what became of a job.
async fn end_job(
    site: &Site,
    mut job: JobRecord,
    progress: &Progress,
    outcome: Result<String, AppError>,
) -> Result<(), AppError> {
    let ending = progress.ending();
    let mut is_stopping = false;
    match (outcome, ending) {
        (Ok(detail), _) => {
            (job.state, job.detail) = (JobState::Done, detail);
            site.jobs().note_times(progress.times());
        }
        (Err(AppError::Stopping), Some(Ending::Cancelled)) => {
            job.state = JobState::Cancelled;
            job.detail = format!("cancelled while {}", progress.detail());
        }
        (Err(AppError::Stopping), _) => {
            // It begins anew at the next start, and this was no failure.
            job.state = JobState::Queued;
            job.num_attempts -= 1;
            is_stopping = true;
        }
        (Err(error), _) => {
            tracing::warn!(site = %site.name(), job = job.id, %error, "a job failed");
            metrics::counter!("locution_jobs_failed_total").increment(1);
            job.state = JobState::Failed;
            job.detail = progress.detail().into();
            job.error = Some(error.to_string());
        }
    }
    let outcome = site.jobs().store(site.store(), &job).await;
    site.jobs().tell_ended();
    tell_of(site, job.id);
    if !is_stopping {
        return outcome;
    }
    // Of a deleted site nothing can be stored, and need not be.
    if outcome.is_ok()
        && let Err(error) = site.remembered.store(site.store()).await
    {
        tracing::warn!(site = %site.name(), %error, "what was mapped is computed again after the next start");
    }
    Err(AppError::Stopping)
}
