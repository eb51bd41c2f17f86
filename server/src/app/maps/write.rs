//! Map versions: written whole into fresh keys, then served; kept for a while, asked for by number.

use locution_engine::mapping::{MatchState, SiteMap};
use locution_engine::semantics::{MapLabels, MapRooms};
use sha2::{Digest as _, Sha256};

use super::channels::held_versions;
use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{
    Digest, Key, Map, MapPose, MapRecord, MapRun, MapVersion, MatchPlace, PartKind, RunIdx, StoredLabel,
    append_places, append_rooms, delete_prefixes, match_chunks, series,
};
use crate::storage::{Batch, SiteStore, StorageError};

/// A commit is closed when its values take more than this.
const COMMIT_BYTES_MAX: usize = 4 << 20;

/// What a map version remembers of a run, or of a piece of one, besides what the engine made of it.
pub struct WrittenRun {
    /// Its number in the site.
    pub run: RunIdx,
    pub name: String,
    pub num_scans: u64,
    /// Sequence number of its first scan.
    pub first_scan: u64,
    /// Number of its first observation among those of the run.
    pub first_observation: u64,
    /// Number of its first keyframe among those of the run.
    pub first_keyframe: u64,
    /// Sequence numbers of its keyframes.
    pub keyframe_seqs: Vec<u64>,
}

/// A version that is ready to be written.
pub struct MapDraft {
    record: MapRecord,
    values: Batch,
}

impl MapDraft {
    /// The next version of a site's map.
    ///
    /// # Errors
    /// [`AppError::Internal`] when a part of the map cannot be written.
    pub fn new(
        site: &Site,
        map: &SiteMap,
        labeled: &MapLabels,
        rooms: &MapRooms,
        match_places: &[Option<MatchPlace>],
        runs: &[WrittenRun],
        made_of: Digest,
    ) -> Result<Self, AppError> {
        let version = site.state().record.map_version + 1;
        let is_verified = |state: &MatchState| *state == MatchState::Verified;
        let mut record = MapRecord {
            version,
            num_components: map.num_components,
            num_matches: map.matches.len() as u64,
            num_verified: map.matches.iter().filter(|found| is_verified(&found.state)).count() as u64,
            has_match_places: true,
            made_of,
            ..MapRecord::default()
        };
        let mut values = Batch::default();
        let (mut first_pose, mut first_label) = (0, 0);
        for ((written, mapped), labels) in runs.iter().zip(&map.runs).zip(&labeled.labels) {
            let seqs = written.keyframe_seqs.iter();
            let poses: Vec<MapPose> = seqs
                .zip(&mapped.map_from_keyframes)
                .map(|(scan_seq, pose)| MapPose { scan_seq: *scan_seq, map_from_robot: *pose })
                .collect();
            series::append(&mut values, &poses, first_pose, |n| Key::MapPart(version, PartKind::Poses, n));
            let labels: Vec<StoredLabel> = labels.iter().map(StoredLabel::from).collect();
            series::append(&mut values, &labels, first_label, |n| Key::MapPart(version, PartKind::Labels, n));
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
                first_scan: written.first_scan,
                first_observation: written.first_observation,
                first_keyframe: written.first_keyframe,
            });
            first_pose += poses.len() as u64;
            first_label += labels.len() as u64;
        }
        for (component, places) in &labeled.places {
            append_places(&mut values, version, *component, places).map_err(AppError::internal)?;
        }
        append_rooms(&mut values, version, rooms).map_err(AppError::internal)?;
        for (key, chunk) in match_chunks(version, &map.matches).map_err(AppError::internal)? {
            values.put(key.encode(), chunk);
        }
        series::append(&mut values, match_places, 0, |n| Key::MapPart(version, PartKind::MatchPlaces, n));
        record.content = content_of(&record, &values);
        Ok(Self { record, values })
    }

    /// Whether a version holds the very same.
    pub fn is_same_as(&self, record: &MapRecord) -> bool {
        self.record.content == record.content
    }

    /// Writes the version into fresh keys; it does not serve yet.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn write(mut self, site: &Site, duration_s: f64) -> Result<Map, AppError> {
        self.record.duration_s = duration_s;
        let store = site.store();
        // What an interrupted build left under this number must not mix with what is written now.
        delete_prefixes(store, &Key::all_of_map(self.record.version)).await?;
        let mut batch = Batch::default();
        for write in self.values.writes {
            batch.writes.push(write);
            commit_when_large(store, &mut batch).await?;
        }
        batch.put(Key::Map(self.record.version).encode(), self.record.encode());
        store.commit(batch, vec![]).await?;
        Ok(Map::new(self.record, site.reader()))
    }
}

/// The digest of a version: of its runs and values, whatever its number and however long it took.
fn content_of(record: &MapRecord, values: &Batch) -> Digest {
    let numbered = MapRecord { version: 0, duration_s: 0.0, made_of: Digest::default(), ..record.clone() };
    let mut hasher = Sha256::new();
    hasher.update(numbered.encode());
    for bytes in values.writes.iter().filter_map(|(_, value)| value.as_ref()) {
        hasher.update((bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    }
    hasher.finalize().into()
}

async fn commit_when_large(store: &dyn SiteStore, batch: &mut Batch) -> Result<(), StorageError> {
    if batch.num_value_bytes() > COMMIT_BYTES_MAX {
        store.commit(std::mem::take(batch), vec![]).await?;
    }
    Ok(())
}

/// Notes that a version is what other input makes, too, so that the next build of it need not find out again.
///
/// # Errors
/// Those of the storage.
pub async fn note_made_of(site: &Site, record: &MapRecord, made_of: Digest) -> Result<(), AppError> {
    let record = MapRecord { made_of, ..record.clone() };
    let mut batch = Batch::default();
    batch.put(Key::Map(record.version).encode(), record.encode());
    Ok(site.store().commit(batch, vec![]).await?)
}

/// Makes a written version the serving one, in one step.
///
/// # Errors
/// Those of the storage.
pub async fn serve_map(site: &Site, version: MapVersion) -> Result<(), AppError> {
    site.change(|record, _| {
        record.map_version = version;
        Ok(())
    })
    .await
}

/// Takes a version from those that can be asked for, unless a channel holds it; no channel can be moved to it afterwards.
async fn hide_unless_held(site: &Site, version: MapVersion) -> Result<bool, AppError> {
    loop {
        let seen = site.state().record.next_decision;
        if held_versions(site).await?.contains(&version) {
            return Ok(false);
        }
        let is_hidden = site
            .change(|record, batch| {
                let is_as_seen = record.next_decision == seen;
                if is_as_seen {
                    batch.delete(Key::Map(version).encode());
                }
                Ok(is_as_seen)
            })
            .await?;
        if is_hidden {
            return Ok(true);
        }
    }
}

/// Drops the oldest versions beyond a number, except those that channels hold.
///
/// # Errors
/// Those of the storage.
pub async fn drop_versions(site: &Site, num_kept: usize) -> Result<(), AppError> {
    let versions = site.map_versions().await?;
    for stale in &versions[..versions.len().saturating_sub(num_kept)] {
        if hide_unless_held(site, *stale).await? {
            delete_prefixes(site.store(), &Key::all_of_map(*stale)).await?;
        }
    }
    Ok(())
}
