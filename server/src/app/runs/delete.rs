//! Runs are forgotten, with all their traces.
//!
//! ```text
//! one commit: no name, an empty run in its place, no decisions about it ─► scans and texts go ─► a build: a version
//! without it serves, versions that hold it go
//! ```
//!
//! The first commit makes the run unknown; a note beside it stays until the last trace is gone, so that whatever
//! interrupts the work, the next build ends it. The number of a run is never used again: maps and decisions name it.

use std::sync::Arc;

use crate::app::site::{JobInfo, RunChange, Site, SiteEvent};
use crate::app::{App, AppError, Name};
use crate::records::{JobKind, Key, Run, RunHead, RunIdx, RunRecord, codec, delete_prefixes};
use crate::storage::Batch;

impl App {
    /// Forgets a run; answers the job that makes a map without it, when there is a map.
    ///
    /// # Errors
    /// [`AppError::NotFound`]; those of the storage.
    pub async fn delete_run(
        self: &Arc<Self>,
        site: &Arc<Site>,
        name: &Name,
    ) -> Result<Option<JobInfo>, AppError> {
        let (app, for_task, name) = (Arc::clone(self), Arc::clone(site), name.clone());
        // A task of its own: a client that hangs up must not stop it half way.
        let work = tokio::spawn(async move { app.forget_run(&for_task, &name).await });
        work.await.map_err(AppError::internal)??;
        if site.state().record.map_version == 0 {
            end_deletions(site, &pending_deletions(site).await?).await?;
            return Ok(None);
        }
        Ok(Some(self.queue_job(site, JobKind::Build).await?))
    }

    /// Deletes finished runs, the oldest first, until no more is kept than the site wants.
    pub(in crate::app) async fn enforce_retention(
        self: &Arc<Self>,
        site: &Arc<Site>,
    ) -> Result<(), AppError> {
        let state = site.state();
        let retention = state.record.retention;
        let num_runs_max = retention.num_runs.unwrap_or(u32::MAX) as usize;
        let num_scans_max = retention.num_scans.unwrap_or(u64::MAX);
        if (num_runs_max, num_scans_max) == (u32::MAX as usize, u64::MAX) {
            return Ok(());
        }
        let runs = site.runs(0, usize::MAX).await?.0;
        for name in surplus(&runs, num_runs_max, num_scans_max) {
            tracing::info!(site = %site.name(), run = name, "a run is deleted, since no more are to be kept");
            self.forget_run(site, &Name::new(&name, "run")?).await?;
        }
        Ok(())
    }

    async fn forget_run(&self, site: &Site, name: &Name) -> Result<(), AppError> {
        let writer = site.writer(name, self.config().limits.num_batches_per_run_max).await?;
        let _generation = site.serving.read().await;
        // Waits for the batch under way; whatever queued behind it finds a finished run.
        let mut slot = writer.state.lock().await;
        *slot = None;
        let _making = site.making_runs.lock().await;
        let run = writer.idx;
        make_unknown(site, run, name).await?;
        site.let_go(name);
        site.forget_texts().await;
        purge(site, run).await?;
        self.forget_served(site).await;
        site.events().tell(SiteEvent::Run { run: name.to_string(), change: RunChange::Deleted });
        Ok(())
    }
}

/// Puts an empty run in the place of one, and a note that traces of it may be left.
async fn make_unknown(site: &Site, run: RunIdx, name: &Name) -> Result<(), AppError> {
    let decisions = site.reader().decisions().await?;
    let about = decisions
        .into_iter()
        .filter(|(_, decision)| [decision.earlier.run_idx, decision.later.run_idx].contains(&run));
    let about: Vec<u64> = about.map(|(number, _)| number).collect();
    site.change(|record, batch| {
        record.num_deleted_runs += 1;
        batch.delete(Key::RunName(name.to_string()).encode());
        batch.put(Key::Run(run).encode(), codec::encode(&RunRecord::deleted()));
        let head = RunHead { is_finished: true, ..RunHead::default() };
        batch.put(Key::RunHead(run).encode(), codec::encode(&head));
        batch.delete(Key::TextHead(record.generation, run).encode());
        batch.put(Key::DeletedRun(run).encode(), codec::encode(&()));
        about.iter().for_each(|number| batch.delete(Key::Decision(*number).encode()));
        Ok(())
    })
    .await
}

/// Names of the finished runs that are too many, the oldest first.
fn surplus(runs: &[Run], num_runs_max: usize, num_scans_max: u64) -> Vec<String> {
    let mut num_runs = runs.len();
    let mut num_scans: u64 = runs.iter().map(|run| run.head.next_sequence).sum();
    let mut names = Vec::new();
    // The latest run stays, whatever it holds.
    for run in runs.iter().take(runs.len().saturating_sub(1)).filter(|run| run.head.is_finished) {
        if num_runs <= num_runs_max && num_scans <= num_scans_max {
            break;
        }
        num_runs -= 1;
        num_scans -= run.head.next_sequence;
        names.push(run.record.name.clone());
    }
    names
}

/// Runs that were deleted and may have left traces; what is left of their scans and texts goes.
pub(in crate::app) async fn pending_deletions(site: &Site) -> Result<Vec<RunIdx>, AppError> {
    let notes = site.store().scan(&Key::all_deleted_runs(), &[], usize::MAX).await?;
    let runs: Vec<RunIdx> = notes.iter().filter_map(|(key, _)| Key::deleted_run(key)).collect();
    for run in &runs {
        purge(site, *run).await?;
    }
    Ok(runs)
}

/// Drops map versions that hold deleted runs, now that one without them serves, and the notes of what is done.
pub(in crate::app) async fn end_deletions(site: &Site, runs: &[RunIdx]) -> Result<(), AppError> {
    if runs.is_empty() {
        return Ok(());
    }
    let reader = site.reader();
    for version in site.map_versions().await? {
        let Some(map) = reader.map(version).await? else { continue };
        let holds =
            |run: &RunIdx| map.record.runs.iter().any(|known| known.run == *run && !known.name.is_empty());
        if runs.iter().any(holds) {
            delete_prefixes(site.store(), &Key::all_of_map(version)).await?;
        }
    }
    let mut batch = Batch::default();
    runs.iter().for_each(|run| batch.delete(Key::DeletedRun(*run).encode()));
    Ok(site.store().commit(batch, vec![]).await?)
}

/// Deletes scans and texts of a run, of the generations that there may be.
async fn purge(site: &Site, run: RunIdx) -> Result<(), AppError> {
    let serving = site.generation();
    let mut prefixes = vec![Key::all_scans(run)];
    for generation in serving.saturating_sub(1)..=serving + 1 {
        prefixes.extend(Key::all_of_text(generation, run));
    }
    Ok(delete_prefixes(site.store(), &prefixes).await?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ServerConfig;
    use crate::records::Retention;
    use crate::storage::{MemoryStorage, Storage};

    /// Every key and value, those of jobs and of the site's own record left out.
    async fn everything(site: &Site) -> Vec<(Vec<u8>, Vec<u8>)> {
        let entries = site.store().scan(&[], &[], usize::MAX).await.unwrap();
        let entries = entries.into_iter().filter(|(key, _)| key[0] != 0x31 && key[0] != 0x01);
        entries.map(|(key, value)| (key.to_vec(), value.to_vec())).collect()
    }

    async fn ended(site: &Site, job: Option<JobInfo>) {
        let id = job.unwrap().record.id;
        site.jobs().ended(id).await.unwrap();
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn nothing_of_a_deleted_run_is_left() {
        let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::default());
        let mut config = ServerConfig::default();
        config.builds.is_automatic = false;
        let app = Arc::new(App::new(config, storage));
        let (site, secret) = (Name::new("s", "site").unwrap(), Name::new("secret-run", "run").unwrap());
        let (site, _) = app.make_site(&site, None).await.unwrap();
        let kept = Name::new("kept", "run").unwrap();
        crate::app::faults::drive(&app, &site, &kept, 240).await;
        crate::app::faults::drive(&app, &site, &secret, 240).await;
        let job = app.queue_job(&site, JobKind::Build).await.unwrap();
        ended(&site, Some(job)).await;
        ended(&site, app.delete_run(&site, &secret).await.unwrap()).await;

        let left = everything(&site).await;
        let is_about = |key: &[u8]| match key[0] {
            0x05 => key[1..5] == [0, 0, 0, 1],
            0x10..=0x15 => key[5..9] == [0, 0, 0, 1],
            _ => false,
        };
        assert!(left.iter().all(|(key, _)| !is_about(key)), "scans and texts are gone");
        assert!(!left.iter().any(|(key, _)| key[0] == 0x06), "no note is left");
        let names = |bytes: &[u8]| bytes.windows(10).any(|window| window == b"secret-run");
        assert!(left.iter().all(|(key, value)| !names(key) && !names(value)), "its name is nowhere");
        assert_eq!(site.map_versions().await.unwrap(), [2], "versions that hold it are gone");
        assert_eq!(site.map(None).await.unwrap().placed_runs(None).await.unwrap().len(), 1);
        assert!(matches!(site.run(&secret).await, Err(AppError::NotFound { .. })));
        let info = site.info().await.unwrap();
        assert_eq!((info.num_runs(), info.num_scans), (1, 240));
        // Its name is free, its number is not.
        crate::app::faults::drive(&app, &site, &secret, 40).await;
        assert_eq!(site.run(&secret).await.unwrap().idx, 2);
        let listed = site.runs(0, usize::MAX).await.unwrap().0;
        assert_eq!(
            listed.iter().map(|run| run.record.name.as_str()).collect::<Vec<_>>(),
            ["kept", "secret-run"]
        );
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_build_ends_what_interrupted_the_forgetting() {
        let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::default());
        let app = Arc::new(App::new(ServerConfig::default(), storage));
        let (site, _) = app.make_site(&Name::new("s", "site").unwrap(), None).await.unwrap();
        let run = Name::new("r", "run").unwrap();
        crate::app::faults::drive(&app, &site, &run, 80).await;
        // As a power cut behind the first commit would leave it.
        make_unknown(&site, 0, &run).await.unwrap();
        assert!(!site.store().scan(&Key::all_scans(0), &[], 1).await.unwrap().is_empty());
        let job = app.queue_job(&site, JobKind::Build).await.unwrap();
        ended(&site, Some(job)).await;
        assert!(site.store().scan(&Key::all_scans(0), &[], 1).await.unwrap().is_empty());
        assert!(site.store().scan(&Key::all_deleted_runs(), &[], 1).await.unwrap().is_empty());
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn no_more_is_kept_than_the_site_wants() {
        let storage: Arc<dyn Storage> = Arc::new(MemoryStorage::default());
        let app = Arc::new(App::new(ServerConfig::default(), storage));
        let (site, _) = app.make_site(&Name::new("s", "site").unwrap(), None).await.unwrap();
        for run in ["a", "b", "c", "d"] {
            crate::app::faults::drive(&app, &site, &Name::new(run, "run").unwrap(), 40).await;
        }
        let left = async |retention| {
            site.change(|record, _| {
                record.retention = retention;
                Ok(())
            })
            .await
            .unwrap();
            app.enforce_retention(&site).await.unwrap();
            let runs = site.runs(0, usize::MAX).await.unwrap().0;
            runs.iter().map(|run| run.record.name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(left(Retention { num_runs: Some(3), ..Retention::default() }).await, ["b", "c", "d"]);
        assert_eq!(left(Retention { num_scans: Some(90), ..Retention::default() }).await, ["c", "d"]);
        assert_eq!(left(Retention { num_scans: Some(1), ..Retention::default() }).await, ["d"]);
    }
}
