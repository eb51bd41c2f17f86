//! Map versions: written whole into fresh keys, then served; kept for a while, asked for by number.

use std::sync::Arc;

use locution_engine::geometry::Pose2;
use locution_engine::mapping::{PlaceMatch, SiteMap};
use locution_engine::scan::Scan;
use serde::{Deserialize, Serialize};

use super::labels::{LabeledMap, StoredLabel};
use super::matches::StoredMatches;
use super::places::append_places;
use super::records::StoredRun;
use super::runs::read_run;
use super::scans::read_scans;
use super::series;
use super::site::Site;
use super::{App, AppError};
use crate::storage::keys::{Key, MapVersion, RunIdx};
use crate::storage::{Batch, StorageError, codec};

/// Poses stand under this kind of map part.
const POSES: u8 = 1;
/// Labels of observations stand under this one.
const LABELS: u8 = 2;
/// A commit is closed when its values take more than this.
const COMMIT_BYTES_MAX: usize = 4 << 20;
/// Keys deleted in one commit.
const NUM_KEYS_PER_DELETION: usize = 1_000;

/// `Key::Map`: what a version is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRecord {
    /// Its number.
    pub version: MapVersion,
    /// Parts of the map that nothing connects.
    pub num_components: u32,
    /// Runs, in the order of the site.
    pub runs: Vec<MapRun>,
    /// Matches, whatever became of them.
    pub num_matches: u64,
    /// Matches that hold the map together.
    pub num_verified: u64,
    /// Seconds that building took.
    pub duration_s: f64,
}

/// A run in a map version.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRun {
    /// Its number in the site.
    pub run: RunIdx,
    /// Its name.
    pub name: String,
    /// The frame of its poses; runs of one component share it.
    pub component: u32,
    /// Number of its first keyframe among the version's poses.
    pub first_pose: u64,
    /// Number of its keyframes.
    pub num_poses: u64,
    /// Number of its first observation among the version's labels.
    pub first_label: u64,
    /// Number of its observations.
    pub num_labels: u64,
    /// Scans it had when the map was built.
    pub num_scans: u64,
    /// Metres driven, along the optimised keyframes.
    pub length_m: f64,
}

/// The pose of a keyframe in the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapPose {
    /// Sequence number of its scan.
    pub scan_seq: u64,
    /// Where the robot was.
    pub map_from_robot: Pose2,
}

/// Everything a renderer needs of a run.
#[derive(Clone, Debug)]
pub struct PlacedRun {
    /// The run in the map.
    pub map_run: MapRun,
    /// The run itself.
    pub run: Arc<StoredRun>,
    /// Poses of its keyframes.
    pub poses: Vec<MapPose>,
}

impl Site {
    /// A version of the map, the serving one unless said.
    ///
    /// # Errors
    /// [`AppError::NotReady`] before the first build, [`AppError::NotFound`] for a version that is not kept.
    pub async fn map(&self, version: Option<MapVersion>) -> Result<MapRecord, AppError> {
        let serving = self.state().record.map_version;
        if serving == 0 {
            let detail = "no map has been built yet: finish a run or POST to …/builds".into();
            return Err(AppError::NotReady { detail });
        }
        let version = version.unwrap_or(serving);
        // A version above the serving one is still being written.
        let bytes = match version <= serving {
            true => self.store().get(&Key::Map(version).encode()).await?,
            false => None,
        };
        let bytes = bytes.ok_or_else(|| AppError::not_found("map version", version))?;
        Ok(codec::decode(&bytes, "a map version")?)
    }

    /// Numbers of the versions that are kept, oldest first.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn map_versions(&self) -> Result<Vec<MapVersion>, AppError> {
        let serving = self.state().record.map_version;
        let entries = self.store().scan(&Key::all_maps(), &[], usize::MAX).await?;
        let versions = entries.iter().filter_map(|(key, _)| Key::last_u64(key));
        Ok(versions.filter(|version| *version <= serving).collect())
    }

    /// Poses of a run's keyframes in a version.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn map_poses(&self, map: &MapRecord, run: &MapRun) -> Result<Vec<MapPose>, AppError> {
        let prefix = Key::all_map_parts(map.version, POSES);
        let key = |first| Key::MapPart(map.version, POSES, first);
        let range = run.first_pose..run.first_pose + run.num_poses;
        Ok(series::read(&**self.store(), &prefix, key, range, usize::MAX).await?)
    }

    /// Labels of a run's observations in a version.
    ///
    /// # Errors
    /// Those of the storage.
    pub(super) async fn stored_labels(
        &self,
        map: &MapRecord,
        run: &MapRun,
    ) -> Result<Vec<StoredLabel>, AppError> {
        let prefix = Key::all_map_parts(map.version, LABELS);
        let key = |first| Key::MapPart(map.version, LABELS, first);
        let range = run.first_label..run.first_label + run.num_labels;
        Ok(series::read(&**self.store(), &prefix, key, range, usize::MAX).await?)
    }

    /// All runs of a version that are in a component, or all.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn placed_runs(
        &self,
        map: &MapRecord,
        component: Option<u32>,
    ) -> Result<Vec<PlacedRun>, AppError> {
        let mut placed = Vec::new();
        for map_run in &map.runs {
            if map_run.num_poses == 0 || component.is_some_and(|component| component != map_run.component) {
                continue;
            }
            let run = read_run(&**self.store(), self.generation(), map_run.run).await?.run;
            let poses = self.map_poses(map, map_run).await?;
            placed.push(PlacedRun { map_run: map_run.clone(), run, poses });
        }
        Ok(placed)
    }

    /// The scans of keyframes `range` of a placed run, in their order.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn keyframe_scans(
        &self,
        placed: &PlacedRun,
        range: std::ops::Range<usize>,
    ) -> Result<Vec<Scan>, AppError> {
        let Some(poses) = placed.poses.get(range).filter(|poses| !poses.is_empty()) else {
            return Ok(Vec::new());
        };
        let (first, last) = (poses[0].scan_seq, poses[poses.len() - 1].scan_seq);
        let geometry = &placed.run.geometry;
        let scans = read_scans(&**self.store(), placed.map_run.run, geometry, first..last + 1).await?;
        let mut wanted = poses.iter().map(|pose| pose.scan_seq).peekable();
        let is_keyframe = |(sequence, _): &(u64, Scan)| wanted.next_if_eq(sequence).is_some();
        Ok((first..).zip(scans).filter(is_keyframe).map(|(_, scan)| scan).collect())
    }

    /// Writes a version into fresh keys; it does not serve yet.
    pub(super) async fn write_map(
        &self,
        map: &SiteMap,
        labeled: &LabeledMap,
        runs: &[WrittenRun],
        duration_s: f64,
    ) -> Result<MapRecord, AppError> {
        let version = self.state().record.map_version + 1;
        // What an interrupted build left under this number must not mix with what is written now.
        self.delete_prefixes(&Key::all_of_map(version)).await?;
        let mut record = MapRecord {
            version,
            num_components: map.num_components,
            runs: Vec::new(),
            num_matches: map.matches.len() as u64,
            num_verified: map.matches.iter().filter(|found| is_verified(found)).count() as u64,
            duration_s,
        };
        let mut batch = Batch::default();
        let (mut first_pose, mut first_label) = (0, 0);
        for ((written, mapped), labels) in runs.iter().zip(&map.runs).zip(&labeled.labels) {
            let poses: Vec<MapPose> = written
                .keyframe_seqs
                .iter()
                .zip(&mapped.map_from_keyframes)
                .map(|(scan_seq, pose)| MapPose { scan_seq: *scan_seq, map_from_robot: *pose })
                .collect();
            series::append(&mut batch, &poses, first_pose, |n| Key::MapPart(version, POSES, n));
            series::append(&mut batch, labels, first_label, |n| Key::MapPart(version, LABELS, n));
            record.runs.push(MapRun {
                run: written.run,
                name: written.name.clone(),
                component: mapped.component,
                first_pose,
                num_poses: poses.len() as u64,
                first_label,
                num_labels: labels.len() as u64,
                num_scans: written.num_scans,
                length_m: poses
                    .windows(2)
                    .map(|two| two[0].map_from_robot.distance(&two[1].map_from_robot))
                    .sum(),
            });
            first_pose += poses.len() as u64;
            first_label += labels.len() as u64;
            self.commit_when_large(&mut batch).await?;
        }
        for (component, places) in &labeled.places {
            append_places(&mut batch, version, *component, places)?;
            self.commit_when_large(&mut batch).await?;
        }
        for chunk in StoredMatches::chunks(&map.matches)? {
            batch.put(Key::Match(version, chunk.first).encode(), chunk.bytes);
            self.commit_when_large(&mut batch).await?;
        }
        batch.put(Key::Map(version).encode(), codec::encode(&record));
        self.store().commit(batch, vec![]).await?;
        Ok(record)
    }

    async fn commit_when_large(&self, batch: &mut Batch) -> Result<(), StorageError> {
        if batch.num_value_bytes() > COMMIT_BYTES_MAX {
            self.store().commit(std::mem::take(batch), vec![]).await?;
        }
        Ok(())
    }

    /// Makes a written version the serving one, in one step, and drops versions beyond those kept.
    pub(super) async fn serve_map(&self, version: MapVersion, num_kept: usize) -> Result<(), AppError> {
        self.change(|record, _| {
            record.map_version = version;
            Ok(())
        })
        .await?;
        let versions = self.map_versions().await?;
        for stale in &versions[..versions.len().saturating_sub(num_kept)] {
            self.delete_prefixes(&Key::all_of_map(*stale)).await?;
        }
        Ok(())
    }

    /// Deletes everything under some prefixes, in steps.
    pub(super) async fn delete_prefixes(&self, prefixes: &[Vec<u8>]) -> Result<(), StorageError> {
        for prefix in prefixes {
            loop {
                let entries = self.store().scan(prefix, &[], NUM_KEYS_PER_DELETION).await?;
                if entries.is_empty() {
                    break;
                }
                let mut batch = Batch::default();
                entries.iter().for_each(|(key, _)| batch.delete(key.to_vec()));
                self.store().commit(batch, vec![]).await?;
            }
        }
        Ok(())
    }
}

/// What `Site::write_map` is told of a run.
pub(super) struct WrittenRun {
    pub run: RunIdx,
    pub name: String,
    pub num_scans: u64,
    pub keyframe_seqs: Vec<u64>,
}

fn is_verified(found: &PlaceMatch) -> bool {
    found.state == locution_engine::mapping::MatchState::Verified
}

impl App {
    /// Versions kept per site.
    pub(super) fn num_versions_kept(&self) -> usize {
        self.config().builds.num_versions_kept
    }
}
