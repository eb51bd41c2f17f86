//! Map versions: written whole into fresh keys, then served; kept for a while, asked for by number.

use locution_engine::mapping::{MatchState, SiteMap};
use locution_engine::semantics::MapLabels;

use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{
    Key, Map, MapPose, MapRecord, MapRun, MapVersion, PartKind, RunIdx, StoredLabel, append_places, codec,
    delete_prefixes, match_chunks, series,
};
use crate::storage::{Batch, SiteStore, StorageError};

/// A commit is closed when its values take more than this.
const COMMIT_BYTES_MAX: usize = 4 << 20;

/// What a map version remembers of a run, besides what the engine made of it.
pub struct WrittenRun {
    /// Its number in the site.
    pub run: RunIdx,
    /// Its name.
    pub name: String,
    /// Scans it had.
    pub num_scans: u64,
    /// Sequence numbers of its keyframes.
    pub keyframe_seqs: Vec<u64>,
}

/// Writes a version into fresh keys; it does not serve yet.
///
/// # Errors
/// Those of the storage.
pub async fn write_map(
    site: &Site,
    map: &SiteMap,
    labeled: &MapLabels,
    runs: &[WrittenRun],
    duration_s: f64,
) -> Result<Map, AppError> {
    let store = site.store();
    let version = site.state().record.map_version + 1;
    // What an interrupted build left under this number must not mix with what is written now.
    delete_prefixes(store, &Key::all_of_map(version)).await?;
    let is_verified = |state: &MatchState| *state == MatchState::Verified;
    let mut record = MapRecord {
        version,
        num_components: map.num_components,
        runs: Vec::new(),
        num_matches: map.matches.len() as u64,
        num_verified: map.matches.iter().filter(|found| is_verified(&found.state)).count() as u64,
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
        series::append(&mut batch, &poses, first_pose, |n| Key::MapPart(version, PartKind::Poses, n));
        let labels: Vec<StoredLabel> = labels.iter().map(StoredLabel::from).collect();
        series::append(&mut batch, &labels, first_label, |n| Key::MapPart(version, PartKind::Labels, n));
        let steps = poses.windows(2).map(|two| two[0].map_from_robot.distance(&two[1].map_from_robot));
        record.runs.push(MapRun {
            run: written.run,
            name: written.name.clone(),
            component: mapped.component,
            first_pose,
            num_poses: poses.len() as u64,
            first_label,
            num_labels: labels.len() as u64,
            num_scans: written.num_scans,
            length_m: steps.sum(),
        });
        first_pose += poses.len() as u64;
        first_label += labels.len() as u64;
        commit_when_large(store, &mut batch).await?;
    }
    for (component, places) in &labeled.places {
        append_places(&mut batch, version, *component, places).map_err(AppError::internal)?;
        commit_when_large(store, &mut batch).await?;
    }
    for (key, chunk) in match_chunks(version, &map.matches).map_err(AppError::internal)? {
        batch.put(key.encode(), chunk);
        commit_when_large(store, &mut batch).await?;
    }
    batch.put(Key::Map(version).encode(), codec::encode(&record));
    store.commit(batch, vec![]).await?;
    Ok(Map::new(record, site.reader()))
}

async fn commit_when_large(store: &dyn SiteStore, batch: &mut Batch) -> Result<(), StorageError> {
    if batch.num_value_bytes() > COMMIT_BYTES_MAX {
        store.commit(std::mem::take(batch), vec![]).await?;
    }
    Ok(())
}

/// Makes a written version the serving one, in one step, and drops versions beyond those kept.
///
/// # Errors
/// Those of the storage.
pub async fn serve_map(site: &Site, version: MapVersion, num_kept: usize) -> Result<(), AppError> {
    site.change(|record, _| {
        record.map_version = version;
        Ok(())
    })
    .await?;
    let versions = site.map_versions().await?;
    for stale in &versions[..versions.len().saturating_sub(num_kept)] {
        delete_prefixes(site.store(), &Key::all_of_map(*stale)).await?;
    }
    Ok(())
}
