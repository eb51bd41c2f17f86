//! Building the map of a site in the background: load a snapshot, let the engine map it, write a version, serve it.

use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use locution_engine::config::EngineConfig;
use locution_engine::mapping::{
    Channel, Decision, Evidence, Keyframe, MappedRun, MatchState, PlaceMatch, RejectionReason, RunRecord,
    SiteMap, map_site, weigh_texts,
};
use locution_engine::semantics::MapLabels;
use locution_engine::text::{Observation, Word};

use crate::app::maps::{WrittenRun, serve_map, write_map};
use crate::app::site::{Progress, Site};
use crate::app::{App, AppError, on_blocking_thread};
use crate::records::{JobKind, Run};

/// Remembered registrations beyond this are forgotten, so that memory stays bounded.
const NUM_REMEMBERED_MAX: usize = 500_000;

/// A run with everything the map builder reads.
struct LoadedRun {
    run: Run,
    observations: Vec<Observation>,
    words: Vec<Word>,
    keyframes: Vec<Keyframe>,
}

impl LoadedRun {
    async fn load(run: Run) -> Result<Self, AppError> {
        let observations = run.all_observations().await?;
        let words = run.words_after(&[]).await?;
        let keyframes = run.keyframes().await?;
        Ok(Self { run, observations, words, keyframes })
    }

    fn as_record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: &self.run.record.geometry,
            observations: &self.observations,
            words: &self.words,
            keyframes: &self.keyframes,
        }
    }
}

impl App {
    /// Builds a new map version of everything stored now, and serves it.
    pub(in crate::app) async fn build(
        self: &Arc<Self>,
        site: &Arc<Site>,
        progress: &Progress,
    ) -> Result<String, AppError> {
        let started = Instant::now();
        self.renew_texts(site, progress).await?;
        progress.at(0.0, "reading the runs");
        let state = site.state();
        let snapshot = site.snapshot().await?;
        let mut runs = Vec::new();
        for run in 0..state.record.num_runs {
            runs.push(LoadedRun::load(snapshot.run(run).await?).await?);
            progress.at(0.1 * f64::from(run + 1) / f64::from(state.record.num_runs), "reading the runs");
        }
        drop(snapshot);
        progress.at(0.1, "matching places and optimising the graph");
        let decisions = site.reader().decisions().await?.into_iter().map(|(_, decision)| decision).collect();
        let written: Vec<WrittenRun> = runs.iter().map(written_run).collect();
        let (map, labels) = map_runs(site, Arc::clone(&state.config), runs, decisions).await?;
        progress.at(0.9, "writing the map");
        let duration_s = started.elapsed().as_secs_f64();
        let map = write_map(site, &map, &labels, &written, duration_s).await?;
        serve_map(site, map.record.version, self.config().builds.num_versions_kept).await?;
        // In the job, which is in the background already: nothing must hold the storage after the server has stopped.
        progress.at(0.95, "preparing questions by example");
        self.place_index(site, &map).await?;
        let record = &map.record;
        metrics::histogram!("locution_build_seconds").record(started.elapsed().as_secs_f64());
        Ok(format!(
            "map version {}: {} runs in {} components, {} of {} matches verified, {:.1} s",
            record.version,
            record.runs.len(),
            record.num_components,
            record.num_verified,
            record.num_matches,
            record.duration_s
        ))
    }

    /// Builds after some quiet, so that runs which finish together share one build.
    pub(in crate::app) fn build_soon(self: &Arc<Self>, site: &Arc<Site>) {
        if !self.config().builds.is_automatic {
            return;
        }
        let ticket = site.build_requests.fetch_add(1, Ordering::Relaxed) + 1;
        let (app, site) = (Arc::clone(self), Arc::clone(site));
        tokio::spawn(async move {
            tokio::time::sleep(Duration::from_secs_f64(app.config().builds.settle_s)).await;
            if site.build_requests.load(Ordering::Relaxed) == ticket
                && let Err(error) = app.queue_job(&site, JobKind::Build).await
            {
                tracing::warn!(site = %site.name(), %error, "the automatic build could not be queued");
            }
        });
    }
}

fn written_run(run: &LoadedRun) -> WrittenRun {
    WrittenRun {
        run: run.run.idx,
        name: run.run.record.name.clone(),
        num_scans: run.run.head.next_sequence,
        keyframe_seqs: run.keyframes.iter().map(|keyframe| keyframe.scan_seq).collect(),
    }
}

/// A vetoed pair of places that the map no longer brings together stays listed, so that it can be taken back.
fn keep_vetoed_visible(map: &mut SiteMap, decisions: &[Decision]) {
    for decision in decisions.iter().filter(|decision| !decision.is_same_place) {
        if map.matches.iter().any(|found| decision.is_about(found)) {
            continue;
        }
        map.matches.push(PlaceMatch {
            earlier: decision.earlier,
            later: decision.later,
            direction: decision.direction,
            channel: Channel::Spatial,
            evidence: Evidence::default(),
            probability: 0.0,
            state: MatchState::Rejected(RejectionReason::Vetoed),
        });
    }
}

/// The engine's part, with what the builds before have already registered.
async fn map_runs(
    site: &Arc<Site>,
    config: Arc<EngineConfig>,
    runs: Vec<LoadedRun>,
    decisions: Vec<Decision>,
) -> Result<(SiteMap, MapLabels), AppError> {
    if runs.iter().all(|run| run.keyframes.is_empty()) {
        let nowhere = MappedRun::default();
        let map = SiteMap { runs: vec![nowhere; runs.len()], ..SiteMap::default() };
        let labels = MapLabels { labels: vec![Vec::new(); runs.len()], places: Vec::new() };
        return Ok((map, labels));
    }
    let mut memo = std::mem::take(&mut *site.memo.lock().unwrap_or_else(PoisonError::into_inner));
    let (memo, outcome) = on_blocking_thread(move || {
        let records: Vec<RunRecord<'_>> = runs.iter().map(LoadedRun::as_record).collect();
        let outcome = map_site(&config.mapping, &records, &decisions, &mut memo).map(|mut map| {
            weigh_texts(&records, &mut map, &config.matching);
            map.matches.append(&mut map.refused);
            keep_vetoed_visible(&mut map, &decisions);
            let labels = MapLabels::of(&records, &map, &config.semantics);
            (map, labels)
        });
        (memo, outcome)
    })
    .await?;
    if memo.len() <= NUM_REMEMBERED_MAX {
        *site.memo.lock().unwrap_or_else(PoisonError::into_inner) = memo;
    }
    outcome.map_err(AppError::internal)
}
