//! Questions by example: where in the serving map was a short recording made, or was it not made here?
//!
//! What such a question reads of a map version — profiles of everything driven, surfaces and free space of every
//! component — is prepared at the end of the job that builds the version, and kept while there is room. A version that is
//! not kept is prepared when it is asked about.

use std::sync::{Arc, Mutex, PoisonError};

use locution_engine::config::EngineConfig;
use locution_engine::geometry::Pose2;
use locution_engine::recall::{
    Example, ExampleAnswer, PlaceIndex, PlaceIndexBuilder, PlacedDrive, RecallConfig, settle,
};
use locution_engine::scan::ScanGeometry;
use lru::LruCache;

use crate::app::runs::NewBatch;
use crate::app::site::Site;
use crate::app::{App, AppError, forget_where, on_blocking_thread};
use crate::records::{Map, MapRun, ReadingRules};

/// Memory for prepared maps of all sites; the one asked about last is kept whatever it takes.
const NUM_BYTES_KEPT_MAX: usize = 512 << 20;
/// Keyframes read and drawn at once.
const NUM_KEYFRAMES_PER_STEP: usize = 500;

/// Birth of the site and map version.
type IndexKey = (u64, u64);

/// Prepared maps, the latest used first.
pub struct PlaceIndexes {
    kept: Mutex<LruCache<IndexKey, Arc<PlaceIndex>>>,
    /// Held while one is prepared: two questions must not prepare the same.
    preparing: tokio::sync::Mutex<()>,
}

impl Default for PlaceIndexes {
    fn default() -> Self {
        Self { kept: Mutex::new(LruCache::unbounded()), preparing: tokio::sync::Mutex::default() }
    }
}

impl PlaceIndexes {
    fn get(&self, key: &IndexKey) -> Option<Arc<PlaceIndex>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).get(key).cloned()
    }

    /// Forgets the maps of a site, by its birth.
    pub(in crate::app) fn forget(&self, birth: u64) {
        forget_where(&mut self.kept.lock().unwrap_or_else(PoisonError::into_inner), |key| key.0 == birth);
    }

    /// Keeps an index instead of older ones of its site, and lets go of the least used ones when they take too much.
    fn put(&self, key: IndexKey, index: Arc<PlaceIndex>) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let is_stale = |known: &IndexKey| known.0 == key.0 && known.1 < key.1;
        forget_where(&mut kept, is_stale);
        kept.put(key, index);
        let num_bytes = |kept: &LruCache<IndexKey, Arc<PlaceIndex>>| {
            kept.iter().map(|(_, index)| index.num_bytes()).sum::<usize>()
        };
        while kept.len() > 1 && num_bytes(&kept) > NUM_BYTES_KEPT_MAX {
            kept.pop_lru();
        }
    }
}

/// The answer of a site.
#[derive(Clone, Debug)]
pub struct ExampleInfo {
    /// The site.
    pub site: String,
    /// The map version looked in.
    pub map_version: u64,
    /// Metres that it drives.
    pub travel_m: f64,
    /// The runs of the map, or their pieces, by the number that the answer calls them, with the number of the first
    /// observation.
    pub runs: Vec<(String, u64)>,
    /// What is said of the recording.
    pub answer: ExampleAnswer,
}

impl App {
    /// Places of a short recording that is not stored, in each of some sites; the likeliest site first. Sites without a
    /// map are passed over, unless there is but one.
    ///
    /// # Errors
    /// Those of the storage; [`AppError::Invalid`] for scans that cannot be; [`AppError::NotReady`] for a single site
    /// without a map.
    pub async fn find_example(
        &self,
        sites: &[Arc<Site>],
        (geometry, readings): (&ScanGeometry, &ReadingRules),
        batch: NewBatch,
    ) -> Result<Vec<ExampleInfo>, AppError> {
        let step_max_m = self.config().limits.odometry_step_max_m;
        let scans = Arc::new(batch.checked((geometry, readings), 0, None, step_max_m)?);
        let (mut answers, mut found_by_site) = (Vec::new(), Vec::new());
        let mut config = RecallConfig::default();
        for site in sites {
            let map = match site.map(None).await {
                Err(AppError::NotReady { .. }) if sites.len() > 1 => continue,
                map => map?,
            };
            let index = self.place_index(site, &map).await?;
            let engine = Arc::clone(&site.state().config);
            config = engine.recall.clone();
            let (geometry, scans) = (geometry.clone(), Arc::clone(&scans));
            let looking = on_blocking_thread(move || {
                let example = Example::read(&engine.translator, &geometry, &scans, &engine.recall)?;
                let travel_m = example.as_ref().map_or(0.0, Example::travel_m);
                let found = example.map(|example| index.find(&example, &engine.recall));
                Ok((travel_m, found.unwrap_or_default()))
            });
            let (travel_m, found) = looking.await?.map_err(invalid_geometry)?;
            found_by_site.push(found);
            answers.push(ExampleInfo {
                site: site.name().to_string(),
                map_version: map.record.version,
                travel_m,
                runs: map.record.runs.iter().map(|run| (run.name.clone(), run.first_observation)).collect(),
                answer: ExampleAnswer::default(),
            });
        }
        for (info, answer) in answers.iter_mut().zip(settle(found_by_site, &config)) {
            info.answer = answer;
        }
        let best = |info: &ExampleInfo| info.answer.places.first().map_or(0.0, |place| place.probability);
        answers.sort_by(|a, b| best(b).total_cmp(&best(a)));
        Ok(answers)
    }

    /// What questions by example read of a map version.
    ///
    /// # Errors
    /// Those of the storage.
    pub(in crate::app) async fn place_index(
        &self,
        site: &Site,
        map: &Map,
    ) -> Result<Arc<PlaceIndex>, AppError> {
        let key = (site.birth(), map.record.version);
        if let Some(index) = self.place_indexes.get(&key) {
            return Ok(index);
        }
        let _turn = self.place_indexes.preparing.lock().await;
        if let Some(index) = self.place_indexes.get(&key) {
            return Ok(index);
        }
        let config = Arc::clone(&site.state().config);
        let index = Arc::new(prepare(map, &config).await?);
        self.place_indexes.put(key, Arc::clone(&index));
        Ok(index)
    }
}

/// A laser that the engine refuses, said of the field that the client sent.
pub(super) fn invalid_geometry(error: locution_engine::config_error::ConfigError) -> AppError {
    AppError::invalid(error.field, error.problem)
}

async fn prepare(map: &Map, config: &EngineConfig) -> Result<PlaceIndex, AppError> {
    let mut builder = PlaceIndexBuilder::new(&config.recall);
    for map_run in &map.record.runs {
        builder = add_drive(map, map_run, builder).await?;
    }
    for placed in map.placed_runs(None).await? {
        for first in (0..placed.poses.len()).step_by(NUM_KEYFRAMES_PER_STEP) {
            let range = first..placed.poses.len().min(first + NUM_KEYFRAMES_PER_STEP);
            let scans = placed.keyframe_scans(range.clone()).await?;
            let (poses, geometry) = (placed.poses[range].to_vec(), placed.run.record.geometry.clone());
            let component = placed.map_run.component;
            builder = on_blocking_thread(move || {
                for (pose, scan) in poses.iter().zip(&scans) {
                    builder.add_scan(component, &geometry, &pose.map_from_robot, &scan.ranges_m);
                }
                builder
            })
            .await?;
        }
    }
    on_blocking_thread(move || builder.finish()).await
}

/// Adds the text of a run as far as the map version knows it; a run outside the map adds nothing but its number.
async fn add_drive(
    map: &Map,
    map_run: &MapRun,
    mut builder: PlaceIndexBuilder,
) -> Result<PlaceIndexBuilder, AppError> {
    let run = map.reader().run(map_run.run).await?;
    let observations = run.observations(map_run.first_observation, map_run.num_labels as usize).await?;
    let trajectory = map.trajectory(map_run).await?;
    let component = map_run.component;
    on_blocking_thread(move || {
        let placed: Vec<Pose2> = observations
            .iter()
            .map_while(|there| trajectory.at(there.scan_seq, &there.run_from_robot))
            .collect();
        let known = &observations[..placed.len()];
        builder.add_run(known, PlacedDrive { component, map_from_observations: placed });
        builder
    })
    .await
}
