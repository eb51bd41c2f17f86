//! Building the map of a site in the background: load a snapshot, let the engine map it, write a version, serve it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use locution_engine::config::EngineConfig;
use locution_engine::geometry::Pose2;
use locution_engine::mapping::{
    Channel, Decision, Evidence, Interval, Keyframe, MappedRun, MatchState, Piece, PlaceMatch,
    RejectionReason, RunRecord, SiteMap, SitePieces, place_observations,
};
use locution_engine::semantics::{MapLabels, MapRooms, RoomsBefore};
use locution_engine::text::{Observation, Word};
use sha2::{Digest as _, Sha256};

use super::founded::{MadeFrom, founded_map};
use crate::app::maps::{
    MapDraft, WrittenRun, drop_versions, keep_annotations, note_made_of, rooms_before, serve_map,
};
use crate::app::runs::{end_deletions, pending_deletions};
use crate::app::site::{BuildStage, Progress, Site, SiteEvent};
use crate::app::{App, AppError, on_blocking_thread};
use crate::records::{
    Digest, JobKind, Map, MapRecord, MatchPlace, Run, RunIdx, SiteRecord, StretchPlace, codec,
};

/// A run with everything the map builder reads.
struct LoadedRun {
    run: Run,
    observations: Vec<Observation>,
    words: Vec<Word>,
    keyframes: Vec<Keyframe>,
    cuts: Vec<u64>,
}

impl LoadedRun {
    async fn load(run: Run) -> Result<Self, AppError> {
        let observations = run.all_observations().await?;
        let words = run.words_after(&[]).await?;
        let keyframes = run.keyframes().await?;
        let cuts = run.cuts().await?.iter().map(|cut| cut.scan_seq).collect();
        Ok(Self { run, observations, words, keyframes, cuts })
    }

    fn as_record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: &self.run.record.geometry,
            observations: &self.observations,
            words: &self.words,
            keyframes: &self.keyframes,
            area: self.run.record.area.as_deref(),
        }
    }
}

impl App {
    /// Builds a new map version of everything stored now, and serves it.
    pub(in crate::app) async fn build(
        self: &Arc<Self>,
        site: &Arc<Site>,
        progress: &Arc<Progress>,
    ) -> Result<String, AppError> {
        let started = Instant::now();
        self.enforce_retention(site).await?;
        let deleted = pending_deletions(site).await?;
        self.renew_texts(site, progress).await?;
        progress.at(BuildStage::Reading, 0.0)?;
        let state = site.state();
        let snapshot = site.snapshot().await?;
        let mut runs = Vec::new();
        for run in 0..state.record.num_runs {
            runs.push(snapshot.run(run).await?);
        }
        let decisions: Vec<Decision> =
            snapshot.decisions().await?.into_iter().map(|(_, decision)| decision).collect();
        let made_of = digest_of(&state.record, &runs, &decisions);
        let serving = match site.map(None).await {
            Err(AppError::NotReady { .. }) => None,
            map => Some(map?),
        };
        if let Some(map) = serving.as_ref().filter(|map| map.record.made_of == made_of) {
            return self.stands(site, map, &deleted, progress).await;
        }
        let num_runs = runs.len();
        let mut loaded = Vec::new();
        for run in runs {
            loaded.push(LoadedRun::load(run).await?);
            progress.at(BuildStage::Reading, loaded.len() as f64 / num_runs as f64)?;
        }
        drop(snapshot);
        let written = written_runs(&loaded);
        let named: Vec<(RunIdx, u64)> = written.iter().map(|piece| (piece.run, piece.first_scan)).collect();
        let before = match &serving {
            Some(serving) => rooms_before(serving, &named).await?,
            None => RoomsBefore::default(),
        };
        let made = map_runs(site, Arc::clone(&state.config), loaded, decisions, before, progress).await?;
        progress.at(BuildStage::Writing, 0.0)?;
        let draft = made.as_draft(site, &written, made_of)?;
        drop(made);
        if let Some(map) = serving.as_ref().filter(|map| draft.is_same_as(&map.record)) {
            note_made_of(site, &map.record, made_of).await?;
            return self.stands(site, map, &deleted, progress).await;
        }
        let map = draft.write(site, started.elapsed().as_secs_f64()).await?;
        if let Some(serving) = &serving {
            keep_annotations(site, serving, &deleted).await?;
        }
        serve_map(site, map.record.version).await?;
        tell_of(site, &map);
        self.tidy_up(site, &map, &deleted, progress).await?;
        let record = &map.record;
        let num_before = serving.map_or(0, |serving| serving.record.num_verified);
        metrics::counter!("locution_closures_total")
            .increment(record.num_verified.saturating_sub(num_before));
        metrics::histogram!("locution_build_seconds").record(started.elapsed().as_secs_f64());
        Ok(format!(
            "map version {}: {num_runs} runs in {} components, {} of {} matches verified, {:.1} s",
            record.version, record.num_components, record.num_verified, record.num_matches, record.duration_s
        ))
    }

    /// Ends a build that changes nothing: the version that serves goes on to serve, and pushes no older one out.
    async fn stands(
        self: &Arc<Self>,
        site: &Arc<Site>,
        map: &Map,
        deleted: &[RunIdx],
        progress: &Progress,
    ) -> Result<String, AppError> {
        self.tidy_up(site, map, deleted, progress).await?;
        Ok(format!("map version {} stands: nothing has changed", map.record.version))
    }

    /// What follows once a version serves: whatever need not be kept goes, and questions by example are prepared.
    async fn tidy_up(
        self: &Arc<Self>,
        site: &Arc<Site>,
        map: &Map,
        deleted: &[RunIdx],
        progress: &Progress,
    ) -> Result<(), AppError> {
        let retention = site.state().record.retention;
        let num_kept =
            retention.num_versions.map_or(self.config().builds.num_versions_kept, |num| num as usize);
        drop_versions(site, num_kept).await?;
        end_deletions(site, deleted).await?;
        // In the job, which is in the background already: nothing must hold the storage after the server has stopped.
        progress.tell(BuildStage::Preparing, 0.0);
        self.place_index(site, map).await?;
        Ok(())
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

/// Tells those who watch of a version that begins to serve.
fn tell_of(site: &Site, map: &Map) {
    let MapRecord { version, num_components, num_matches, num_verified, .. } = map.record;
    site.events().tell(SiteEvent::Version { version, num_components });
    site.events().tell(SiteEvent::Matches { version, num_matches, num_verified });
}

/// The pieces of all runs, as far as the map builder reads them.
fn pieces_of(runs: &[LoadedRun]) -> SitePieces<'_> {
    let records: Vec<RunRecord<'_>> = runs.iter().map(LoadedRun::as_record).collect();
    let cuts: Vec<Vec<u64>> = runs.iter().map(|run| run.cuts.clone()).collect();
    SitePieces::new(&records, &cuts)
}

fn written_runs(runs: &[LoadedRun]) -> Vec<WrittenRun> {
    let written = |piece: &Piece<'_>| {
        let LoadedRun { run, keyframes, .. } = &runs[piece.run_idx as usize];
        let held = piece.keyframes.start as usize..piece.keyframes.end as usize;
        WrittenRun {
            run: run.idx,
            name: run.record.name.clone(),
            num_scans: piece.scans.end.min(run.head.next_sequence) - piece.scans.start,
            first_scan: piece.scans.start,
            first_observation: u64::from(piece.observations.start),
            first_keyframe: u64::from(piece.keyframes.start),
            keyframe_seqs: keyframes[held].iter().map(|keyframe| keyframe.scan_seq).collect(),
        }
    };
    pieces_of(runs).pieces().iter().map(written).collect()
}

/// Numbers components anew, those of runs that drove first: component 0 is what is shown unless another is asked for, and
/// must not be that of a run that has sent nothing or was deleted.
fn number_driven_first(runs: &[RunRecord<'_>], map: &mut SiteMap) {
    let mut numbers = BTreeMap::new();
    for is_driven in [true, false] {
        for (_, mapped) in runs.iter().zip(&map.runs).filter(|(run, _)| run.keyframes.is_empty() != is_driven)
        {
            let next = numbers.len() as u32;
            numbers.entry(mapped.component).or_insert(next);
        }
        if is_driven {
            map.num_components = numbers.len() as u32;
        }
    }
    for mapped in &mut map.runs {
        mapped.component = numbers[&mapped.component];
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

/// What the engine makes of runs.
struct MadeMap {
    map: SiteMap,
    labels: MapLabels,
    match_places: Vec<Option<MatchPlace>>,
    rooms: MapRooms,
}

impl MadeMap {
    fn as_draft(&self, site: &Site, runs: &[WrittenRun], made_of: Digest) -> Result<MapDraft, AppError> {
        MapDraft::new(site, &self.map, &self.labels, &self.rooms, &self.match_places, runs, made_of)
    }
}

/// Where and when the stretches of all matches were driven.
fn match_places(runs: &[RunRecord<'_>], map: &SiteMap) -> Vec<Option<MatchPlace>> {
    let poses: Vec<Vec<Pose2>> =
        runs.iter().zip(&map.runs).map(|(run, mapped)| place_observations(run, mapped)).collect();
    let place = |stretch: &Interval| {
        let run_idx = stretch.run_idx as usize;
        let observations = runs.get(run_idx)?.observations;
        let time_ns = |observation: u32| Some(observations.get(observation as usize)?.timestamp_ns);
        let middle = stretch.first + stretch.last.saturating_sub(stretch.first) / 2;
        Some(StretchPlace {
            timestamps_ns: (time_ns(stretch.first)?, time_ns(stretch.last)?),
            component: map.runs.get(run_idx)?.component,
            map_from_middle: *poses.get(run_idx)?.get(middle as usize)?,
        })
    };
    let of_match = |found: &PlaceMatch| {
        Some(MatchPlace { earlier: place(&found.earlier)?, later: place(&found.later)? })
    };
    map.matches.iter().map(of_match).collect()
}

/// The digest of everything that a map is made of, the program included.
fn digest_of(site: &SiteRecord, runs: &[Run], decisions: &[Decision]) -> Digest {
    let mut hasher = Sha256::new();
    hasher.update(env!("CARGO_PKG_VERSION"));
    hasher.update(codec::encode(&(&site.config_json, site.generation)));
    for run in runs {
        hasher.update(codec::encode(&(run.idx, &run.record.name, &run.head, &run.text.num_words)));
        hasher.update(codec::encode(&(run.text.num_observations, run.text.num_keyframes)));
    }
    decisions.iter().for_each(|decision| hasher.update(codec::encode(decision)));
    hasher.finalize().into()
}

/// The digest of everything that the first runs of a site amount to.
fn digest_of_settled(site: &SiteRecord, runs: &[Run], decisions: &[Decision]) -> Digest {
    let is_within = |decision: &&Decision| {
        let runs_of_it = [decision.earlier.run_idx, decision.later.run_idx];
        // A confirmation settles a match, wherever it is; a veto shapes the map.
        !decision.is_same_place && runs_of_it.iter().all(|run| (*run as usize) < runs.len())
    };
    let within: Vec<Decision> = decisions.iter().filter(is_within).copied().collect();
    digest_of(site, runs, &within)
}

/// The engine's part, with what the builds before have already registered.
async fn map_runs(
    site: &Arc<Site>,
    config: Arc<EngineConfig>,
    runs: Vec<LoadedRun>,
    decisions: Vec<Decision>,
    before: RoomsBefore,
    progress: &Arc<Progress>,
) -> Result<MadeMap, AppError> {
    if runs.iter().all(|run| run.keyframes.is_empty()) {
        let num_pieces = runs.iter().map(|run| run.cuts.len() + 1).sum();
        let nowhere = MappedRun::default();
        let map = SiteMap { runs: vec![nowhere; num_pieces], ..SiteMap::default() };
        let labels = MapLabels { labels: vec![Vec::new(); num_pieces], places: Vec::new() };
        let rooms = MapRooms { next_id: before.rooms.next_id, ..MapRooms::default() };
        return Ok(MadeMap { map, labels, match_places: Vec::new(), rooms });
    }
    let mut memory = site.remembered.take(site.store()).await?;
    let (progress, site) = (Arc::clone(progress), Arc::clone(site));
    let site_record = site.state().record.clone();
    on_blocking_thread(move || {
        let pieces = pieces_of(&runs);
        let records = pieces.records();
        let told_of_pieces = pieces.decisions(&decisions);
        let stored: Vec<Run> = runs.iter().map(|run| run.run.clone()).collect();
        let settled_digest = |num_pieces: usize| {
            let num_runs = pieces.pieces()[..num_pieces].last().map_or(0, |last| last.run_idx as usize + 1);
            digest_of_settled(&site_record, &stored[..num_runs], &decisions)
        };
        let from = MadeFrom {
            config: &config,
            runs: &records,
            decisions: &told_of_pieces,
            settled_digest: &settled_digest,
        };
        let outcome = founded_map(&mut memory, &from, &progress);
        // Also when the job was given up meanwhile: whoever goes on takes it up.
        site.remembered.give_back(memory);
        let mut map = outcome?;
        progress.at(BuildStage::Weighing, 0.0)?;
        number_driven_first(&records, &mut map);
        map.matches.append(&mut map.refused);
        keep_vetoed_visible(&mut map, &told_of_pieces);
        progress.at(BuildStage::Weighing, 0.5)?;
        let labels = MapLabels::of(&records, &map, &config.semantics);
        let match_places = match_places(&records, &map);
        pieces.tell_of_runs(&mut map);
        let rooms = MapRooms::of(&records, &map, &config.semantics.rooms, &before);
        Ok(MadeMap { map, labels, match_places, rooms })
    })
    .await?
}
