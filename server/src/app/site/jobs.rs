//! Long work as resources: queued, running, done, failed or cancelled, with progress, across restarts.
//!
//! A job that is stored as queued or running when the server starts was interrupted: it begins anew, because jobs are
//! pure functions of what is stored, unless it was interrupted too often, and then it failed and says so.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;

use super::progress::{Progress, StageTimes};
use crate::app::AppError;
use crate::records::{JobKind, JobRecord, JobState, Key, codec};
use crate::storage::{Batch, SiteStore};

/// A job that was interrupted this often is not begun again.
const NUM_ATTEMPTS_MAX: u32 = 3;
/// Ended jobs kept per site.
const NUM_ENDED_KEPT: usize = 100;

/// A job as it stands, with its progress.
#[derive(Clone, Debug)]
pub struct JobInfo {
    pub record: JobRecord,
    /// From 0 to 1.
    pub progress: f64,
    /// Time that it will still take, when that can be told.
    pub left: Option<Duration>,
}

/// The jobs of a site that are known to this process.
pub struct Jobs {
    table: Mutex<JobTable>,
    ended: Notify,
    /// Set when the site is deleted or the server stops.
    stop: CancellationToken,
}

#[derive(Default)]
struct JobTable {
    jobs: BTreeMap<u64, (JobRecord, Arc<Progress>)>,
    is_working: bool,
    /// What the stages of the last build took.
    times: StageTimes,
}

impl JobTable {
    fn queued(&self) -> Option<(JobRecord, Arc<Progress>)> {
        self.jobs.values().find(|(job, _)| job.state == JobState::Queued).cloned()
    }
}

impl Jobs {
    /// Reads the jobs of earlier processes; what they left unfinished is queued again or failed.
    pub async fn load(store: &dyn SiteStore, stop: CancellationToken) -> Result<Self, AppError> {
        let jobs = Self { table: Mutex::default(), ended: Notify::new(), stop };
        let mut batch = Batch::default();
        for (_, bytes) in store.scan(&Key::all_jobs(), &[], usize::MAX).await? {
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
            jobs.insert(record);
        }
        if !batch.writes.is_empty() {
            store.commit(batch, vec![]).await.map_err(AppError::from).or_else(super::unless_full)?;
        }
        Ok(jobs)
    }

    /// A job by its number.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub fn get(&self, id: u64) -> Result<JobInfo, AppError> {
        let table = self.table();
        let (record, progress) = table.jobs.get(&id).ok_or_else(|| AppError::not_found("job", id))?;
        Ok(info(record, progress))
    }

    /// How many jobs wait and how many run.
    pub fn num_jobs(&self) -> (usize, usize) {
        let table = self.table();
        let num = |state| table.jobs.values().filter(|(job, _)| job.state == state).count();
        (num(JobState::Queued), num(JobState::Running))
    }

    /// All jobs, the newest first.
    pub fn all(&self) -> Vec<JobInfo> {
        self.table().jobs.values().rev().map(|(record, progress)| info(record, progress)).collect()
    }

    /// Returns once a job has ended.
    ///
    /// # Errors
    /// [`AppError::NotFound`]; [`AppError::Stopping`] when the site is deleted or the server stops before.
    pub async fn ended(&self, id: u64) -> Result<JobInfo, AppError> {
        loop {
            let ended = self.ended.notified();
            let job = self.get(id)?;
            if has_ended(&job.record) {
                return Ok(job);
            }
            tokio::select! {
                () = ended => {}
                () = self.stop.cancelled() => return Err(AppError::Stopping),
            }
        }
    }

    /// Cancels a job: one that waits is over at once and answered, to be stored; one that runs ends at its next step.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub fn cancel(&self, id: u64) -> Result<Option<JobRecord>, AppError> {
        let mut table = self.table();
        let (record, progress) = table.jobs.get_mut(&id).ok_or_else(|| AppError::not_found("job", id))?;
        progress.cancel();
        if record.state != JobState::Queued {
            return Ok(None);
        }
        record.state = JobState::Cancelled;
        record.detail = "cancelled before it began".into();
        Ok(Some(record.clone()))
    }

    /// Begins a job whose turn has come; none when it was cancelled meanwhile.
    pub fn begin(&self, id: u64) -> Option<JobRecord> {
        let mut table = self.table();
        let (record, _) = table.jobs.get_mut(&id).filter(|(job, _)| job.state == JobState::Queued)?;
        record.state = JobState::Running;
        record.num_attempts += 1;
        Some(record.clone())
    }

    /// Notes what the stages of a build took, for the progress of the next.
    pub fn note_times(&self, times: StageTimes) {
        self.table().times = times;
    }

    /// A job of a kind that waits for its turn.
    pub fn waiting(&self, kind: JobKind) -> Option<JobInfo> {
        let waiting = self.table().queued().filter(|(job, _)| job.kind == kind);
        waiting.map(|(record, progress)| info(&record, &progress))
    }

    /// Takes up a job that was just stored.
    pub fn insert(&self, record: JobRecord) {
        let mut table = self.table();
        let progress = Progress::new(table.times, self.stop.clone());
        table.jobs.insert(record.id, (record, Arc::new(progress)));
    }

    /// Makes the caller the one that works on the jobs; false when there is one, or nothing to do.
    pub fn begin_work(&self) -> bool {
        let mut table = self.table();
        let begins = !table.is_working && table.queued().is_some();
        table.is_working |= begins;
        begins
    }

    /// The next job to work on; with `None` the work has ended.
    pub fn next(&self) -> Option<(JobRecord, Arc<Progress>)> {
        let mut table = self.table();
        let next = table.queued();
        table.is_working = next.is_some();
        next
    }

    /// Stops the work with jobs still queued.
    pub fn stop_work(&self) {
        self.table().is_working = false;
    }

    /// Stores how far a job is, and forgets the oldest of too many ended ones.
    pub async fn store(&self, store: &dyn SiteStore, record: &JobRecord) -> Result<(), AppError> {
        if let Some((known, _)) = self.table().jobs.get_mut(&record.id) {
            known.clone_from(record);
        }
        let mut batch = Batch::default();
        batch.put(Key::Job(record.id).encode(), codec::encode(record));
        for stale in self.forget_old_jobs() {
            batch.delete(Key::Job(stale).encode());
        }
        Ok(store.commit(batch, vec![]).await?)
    }

    /// Wakes those who wait for a job to end.
    pub fn tell_ended(&self) {
        self.ended.notify_waiters();
    }

    fn forget_old_jobs(&self) -> Vec<u64> {
        let mut table = self.table();
        let surplus = table.jobs.len().saturating_sub(NUM_ENDED_KEPT);
        let stale: Vec<u64> = table
            .jobs
            .values()
            .filter(|(job, _)| has_ended(job))
            .map(|(job, _)| job.id)
            .take(surplus)
            .collect();
        table.jobs.retain(|id, _| !stale.contains(id));
        stale
    }

    fn table(&self) -> std::sync::MutexGuard<'_, JobTable> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn has_ended(job: &JobRecord) -> bool {
    matches!(job.state, JobState::Done | JobState::Failed | JobState::Cancelled)
}

fn info(record: &JobRecord, progress: &Progress) -> JobInfo {
    let mut record = record.clone();
    let (mut share, mut left) = (progress.share(), None);
    match record.state {
        JobState::Done => share = 1.0,
        JobState::Running => (record.detail, left) = (progress.detail().into(), progress.left()),
        _ => {}
    }
    JobInfo { record, progress: share, left }
}

#[cfg(test)]
mod tests {
    use super::super::progress::Ending;
    use super::*;
    use crate::storage::{MemoryStorage, Storage};

    fn job(id: u64, state: JobState, num_attempts: u32) -> JobRecord {
        JobRecord { id, kind: JobKind::Build, state, num_attempts, detail: String::new(), error: None }
    }

    async fn stored(jobs: &[JobRecord]) -> Arc<dyn SiteStore> {
        let store = MemoryStorage::default().open("site").await.unwrap();
        let mut batch = Batch::default();
        jobs.iter().for_each(|job| batch.put(Key::Job(job.id).encode(), codec::encode(job)));
        store.commit(batch, vec![]).await.unwrap();
        store
    }

    async fn loaded(store: &dyn SiteStore) -> Jobs {
        Jobs::load(store, CancellationToken::new()).await.unwrap()
    }

    fn states(jobs: &Jobs) -> Vec<(u64, JobState)> {
        jobs.all().iter().map(|job| (job.record.id, job.record.state)).collect()
    }

    #[tokio::test]
    async fn what_was_interrupted_begins_anew_until_it_was_interrupted_too_often() {
        let store = stored(&[
            job(1, JobState::Done, 1),
            job(2, JobState::Running, NUM_ATTEMPTS_MAX),
            job(3, JobState::Running, 1),
            job(4, JobState::Queued, 0),
        ])
        .await;
        let expected =
            [(4, JobState::Queued), (3, JobState::Queued), (2, JobState::Failed), (1, JobState::Done)];
        let jobs = loaded(&*store).await;
        assert_eq!(states(&jobs), expected);
        assert!(jobs.get(2).unwrap().record.error.unwrap().contains("interrupted 3 times"));
        assert_eq!(states(&loaded(&*store).await), expected, "it is stored, too");
    }

    #[tokio::test]
    async fn jobs_are_worked_on_by_one_and_in_order() {
        let store = stored(&[job(7, JobState::Queued, 0), job(8, JobState::Queued, 0)]).await;
        let jobs = loaded(&*store).await;
        assert!(jobs.begin_work());
        assert!(!jobs.begin_work(), "somebody works already");
        for id in [7, 8] {
            let (mut next, _) = jobs.next().unwrap();
            assert_eq!(next.id, id);
            next.state = JobState::Done;
            jobs.store(&*store, &next).await.unwrap();
        }
        assert!(jobs.next().is_none());
        assert!(!jobs.begin_work(), "nothing is left to do");
        jobs.insert(job(9, JobState::Queued, 0));
        assert!(jobs.begin_work());
    }

    #[tokio::test]
    async fn a_waiting_job_that_is_cancelled_never_begins_and_a_running_one_is_told() {
        let store = stored(&[job(1, JobState::Queued, 0), job(2, JobState::Queued, 0)]).await;
        let jobs = loaded(&*store).await;
        let (first, progress) = jobs.next().unwrap();
        assert_eq!(jobs.begin(first.id).unwrap().num_attempts, 1);
        let cancelled = jobs.cancel(2).unwrap().unwrap();
        assert_eq!(cancelled.state, JobState::Cancelled);
        assert!(jobs.begin(2).is_none(), "it was cancelled before its turn came");
        assert_eq!(jobs.ended(2).await.unwrap().record.state, JobState::Cancelled);
        assert!(jobs.cancel(1).unwrap().is_none(), "it runs");
        assert_eq!(progress.ending(), Some(Ending::Cancelled));
        assert!(matches!(jobs.cancel(3), Err(AppError::NotFound { .. })));
    }

    #[tokio::test]
    async fn nobody_waits_for_a_job_of_a_site_that_ends() {
        let store = stored(&[job(1, JobState::Queued, 0)]).await;
        let stop = CancellationToken::new();
        let jobs = Jobs::load(&*store, stop.clone()).await.unwrap();
        let (outcome, ()) = tokio::join!(jobs.ended(1), async { stop.cancel() });
        assert!(matches!(outcome, Err(AppError::Stopping)));
    }

    #[tokio::test]
    async fn the_oldest_of_too_many_ended_jobs_are_forgotten_and_no_others() {
        let mut all = vec![job(1, JobState::Queued, 0)];
        all.extend((2..=NUM_ENDED_KEPT as u64 + 2).map(|id| job(id, JobState::Done, 1)));
        let store = stored(&all).await;
        let jobs = loaded(&*store).await;
        let newest = job(NUM_ENDED_KEPT as u64 + 3, JobState::Done, 1);
        jobs.insert(newest.clone());
        jobs.store(&*store, &newest).await.unwrap();
        assert_eq!(jobs.all().len(), NUM_ENDED_KEPT);
        assert!(jobs.get(1).is_ok(), "it waits");
        assert!(jobs.get(2).is_err() && jobs.get(newest.id).is_ok());
        assert_eq!(states(&loaded(&*store).await), states(&jobs));
    }
}
