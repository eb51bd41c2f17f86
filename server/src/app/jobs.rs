//! Long work as resources: queued, running, done or failed, with progress, across restarts.
//!
//! A site works on one job at a time, in order; over all sites only so many run at once. A job that is stored as
//! queued or running when the server starts was interrupted: it begins anew, because jobs are pure functions of what
//! is stored, unless it was interrupted too often, and then it failed and says so.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use tokio::sync::Notify;

use super::site::Site;
use super::{App, AppError};
use crate::storage::keys::Key;
use crate::storage::{Batch, codec};

/// A job that was interrupted this often is not begun again.
const NUM_ATTEMPTS_MAX: u32 = 3;
/// Ended jobs kept per site.
const NUM_ENDED_KEPT: usize = 100;

/// What a job does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JobKind {
    /// Builds the map of everything stored, after writing the texts anew when their partition is outdated.
    Build,
}

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JobState {
    /// It waits for its turn.
    Queued,
    /// It is at work.
    Running,
    /// It did what it should.
    Done,
    /// It did not.
    Failed,
}

/// `Key::Job`: a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// Its number in the site.
    pub id: u64,
    /// What it does.
    pub kind: JobKind,
    /// How far it is.
    pub state: JobState,
    /// How often it was begun.
    pub num_attempts: u32,
    /// What it is at, or what came of it.
    pub detail: String,
    /// Why it failed.
    pub error: Option<String>,
}

/// A job as it stands, with its progress.
#[derive(Clone, Debug)]
pub struct JobInfo {
    /// Its record.
    pub record: JobRecord,
    /// From 0 to 1.
    pub progress: f64,
}

/// How a job tells where it is, from any thread.
#[derive(Debug, Default)]
pub struct Progress {
    permille: AtomicU32,
    detail: Mutex<String>,
}

impl Progress {
    /// Says what is being done, and how much of the whole was done before, from 0 to 1.
    pub fn at(&self, share: f64, detail: &str) {
        self.permille.store((share.clamp(0.0, 1.0) * 1000.0) as u32, Ordering::Relaxed);
        detail.clone_into(&mut self.detail.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn share(&self) -> f64 {
        f64::from(self.permille.load(Ordering::Relaxed)) / 1000.0
    }

    fn detail(&self) -> String {
        self.detail.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The jobs of a site that are known to this process.
#[derive(Default)]
pub struct Jobs {
    table: Mutex<JobTable>,
    ended: Notify,
}

#[derive(Default)]
struct JobTable {
    jobs: BTreeMap<u64, (JobRecord, Arc<Progress>)>,
    is_working: bool,
}

impl Jobs {
    fn table(&self) -> std::sync::MutexGuard<'_, JobTable> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl JobTable {
    fn queued(&self) -> Option<(JobRecord, Arc<Progress>)> {
        self.jobs.values().find(|(job, _)| job.state == JobState::Queued).cloned()
    }
}

impl Site {
    /// A job by its number.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub fn job(&self, id: u64) -> Result<JobInfo, AppError> {
        let table = self.jobs.table();
        let (record, progress) = table.jobs.get(&id).ok_or_else(|| AppError::not_found("job", id))?;
        Ok(info(record, progress))
    }

    /// All jobs, the newest first.
    pub fn jobs(&self) -> Vec<JobInfo> {
        self.jobs.table().jobs.values().rev().map(|(record, progress)| info(record, progress)).collect()
    }

    /// Returns once a job has ended.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn job_ended(&self, id: u64) -> Result<JobInfo, AppError> {
        loop {
            let ended = self.jobs.ended.notified();
            let job = self.job(id)?;
            if matches!(job.record.state, JobState::Done | JobState::Failed) {
                return Ok(job);
            }
            ended.await;
        }
    }

    /// Reads the jobs of earlier processes; what they left unfinished is queued again or failed.
    pub(super) async fn load_jobs(&self) -> Result<(), AppError> {
        let entries = self.store().scan(&Key::all_jobs(), &[], usize::MAX).await?;
        let mut batch = Batch::default();
        for (_, bytes) in entries {
            let mut record: JobRecord = codec::decode(&bytes, "a job")?;
            if matches!(record.state, JobState::Queued | JobState::Running) {
                record.state = JobState::Queued;
                record.detail = "interrupted, waiting to begin anew".into();
                if record.num_attempts >= NUM_ATTEMPTS_MAX {
                    record.state = JobState::Failed;
                    record.error = Some(format!("interrupted {} times", record.num_attempts));
                }
                batch.put(Key::Job(record.id).encode(), codec::encode(&record));
            }
            self.jobs.table().jobs.insert(record.id, (record, Arc::default()));
        }
        if !batch.writes.is_empty() {
            self.store().commit(batch, vec![]).await?;
        }
        Ok(())
    }

    async fn store_job(&self, record: &JobRecord) -> Result<(), AppError> {
        if let Some((known, _)) = self.jobs.table().jobs.get_mut(&record.id) {
            known.clone_from(record);
        }
        let mut batch = Batch::default();
        batch.put(Key::Job(record.id).encode(), codec::encode(record));
        for stale in self.forget_old_jobs() {
            batch.delete(Key::Job(stale).encode());
        }
        Ok(self.store().commit(batch, vec![]).await?)
    }

    fn forget_old_jobs(&self) -> Vec<u64> {
        let mut table = self.jobs.table();
        let surplus = table.jobs.len().saturating_sub(NUM_ENDED_KEPT);
        let is_ended = |job: &JobRecord| matches!(job.state, JobState::Done | JobState::Failed);
        let stale: Vec<u64> = table
            .jobs
            .values()
            .filter(|(job, _)| is_ended(job))
            .map(|(job, _)| job.id)
            .take(surplus)
            .collect();
        table.jobs.retain(|id, _| !stale.contains(id));
        stale
    }
}

fn info(record: &JobRecord, progress: &Progress) -> JobInfo {
    let mut record = record.clone();
    let mut share = progress.share();
    match record.state {
        JobState::Done => share = 1.0,
        JobState::Running => record.detail = progress.detail(),
        _ => {}
    }
    JobInfo { record, progress: share }
}

impl App {
    /// Queues a job and sees that it is worked on. One of the same kind that still waits will do.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn queue_job(self: &Arc<Self>, site: &Arc<Site>, kind: JobKind) -> Result<JobInfo, AppError> {
        let waiting = site.jobs.table().queued().filter(|(job, _)| job.kind == kind);
        if let Some((record, progress)) = waiting {
            return Ok(info(&record, &progress));
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
        site.jobs.table().jobs.insert(record.id, (record.clone(), Arc::default()));
        self.work_on(site);
        site.job(record.id)
    }

    /// Sees that the jobs of a site are worked on.
    pub(super) fn work_on(self: &Arc<Self>, site: &Arc<Site>) {
        let mut table = site.jobs.table();
        if table.is_working || table.queued().is_none() {
            return;
        }
        table.is_working = true;
        drop(table);
        let (app, site) = (Arc::clone(self), Arc::clone(site));
        tokio::spawn(async move { app.work(&site).await });
    }

    async fn work(self: Arc<Self>, site: &Arc<Site>) {
        loop {
            let next = {
                let mut table = site.jobs.table();
                let next = table.queued();
                table.is_working = next.is_some();
                next
            };
            let Some((job, progress)) = next else { return };
            if let Err(error) = self.run_job(site, job, &progress).await {
                // The job could not even be marked: the storage is gone or the site was deleted.
                tracing::warn!(site = %site.name(), %error, "jobs of this site stop");
                site.jobs.table().is_working = false;
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
        site.store_job(&job).await?;
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
        let outcome = site.store_job(&job).await;
        site.jobs.ended.notify_waiters();
        outcome
    }
}
