//! Reading what a run holds: pages for clients, everything for the map builder.

use locution_engine::mapping::Keyframe;
use locution_engine::scan::Scan;
use locution_engine::text::{Observation, Word};

use super::records::StoredKeyframe;
use super::runs::RunInfo;
use super::scans::read_scans;
use super::series;
use crate::storage::keys::{Generation, Key};
use crate::storage::{Reader, StorageError};

/// Up to `limit` observations from number `from` on.
///
/// # Errors
/// Those of the storage.
pub async fn read_observations(
    reader: &dyn Reader,
    generation: Generation,
    info: &RunInfo,
    from: u64,
    limit: usize,
) -> Result<Vec<Observation>, StorageError> {
    let prefix = Key::all_observations(generation, info.idx);
    let key = |first| Key::Observations(generation, info.idx, first);
    series::read(reader, &prefix, key, from..info.text.num_observations, limit).await
}

/// Up to `limit` words of one level from number `from` on.
///
/// # Errors
/// Those of the storage.
pub async fn read_words(
    reader: &dyn Reader,
    generation: Generation,
    info: &RunInfo,
    level: u8,
    from: u64,
    limit: usize,
) -> Result<Vec<Word>, StorageError> {
    let num_words = info.text.num_words.get(usize::from(level)).copied().unwrap_or(0);
    let prefix = Key::all_words(generation, info.idx, level);
    let key = |first| Key::Words(generation, info.idx, level, first);
    series::read(reader, &prefix, key, from..num_words, limit).await
}

/// Up to `limit` scans from a sequence number on.
///
/// # Errors
/// Those of the storage.
pub async fn read_run_scans(
    reader: &dyn Reader,
    info: &RunInfo,
    from: u64,
    limit: usize,
) -> Result<Vec<Scan>, StorageError> {
    let end = info.head.next_sequence.min(from.saturating_add(limit as u64));
    if from >= end {
        return Ok(Vec::new());
    }
    read_scans(reader, info.idx, &info.run.geometry, from..end).await
}

/// All keyframes of a run as stored, without their readings.
///
/// # Errors
/// Those of the storage.
pub async fn read_stored_keyframes(
    reader: &dyn Reader,
    generation: Generation,
    info: &RunInfo,
) -> Result<Vec<StoredKeyframe>, StorageError> {
    let prefix = Key::all_keyframes(generation, info.idx);
    let key = |first| Key::Keyframes(generation, info.idx, first);
    series::read(reader, &prefix, key, 0..info.text.num_keyframes, usize::MAX).await
}

/// All keyframes of a run, joined with the scans that they were made from.
///
/// # Errors
/// Those of the storage.
pub async fn read_keyframes(
    reader: &dyn Reader,
    generation: Generation,
    info: &RunInfo,
) -> Result<Vec<Keyframe>, StorageError> {
    const NUM_SCANS_PER_READ: u64 = 2_048;
    let stored = read_stored_keyframes(reader, generation, info).await?;
    let mut keyframes = Vec::with_capacity(stored.len());
    let mut pending = stored.into_iter().peekable();
    while let Some(first) = pending.peek().map(|keyframe| keyframe.scan_seq) {
        let end = info.head.next_sequence.min(first + NUM_SCANS_PER_READ);
        let mut scans = read_scans(reader, info.idx, &info.run.geometry, first..end).await?;
        if scans.is_empty() {
            return Err(StorageError::Corrupt { what: format!("the keyframe of scan {first} has no scan") });
        }
        while let Some(keyframe) = pending.next_if(|keyframe| keyframe.scan_seq < end) {
            let scan = &mut scans[(keyframe.scan_seq - first) as usize];
            keyframes.push(Keyframe {
                scan_seq: keyframe.scan_seq,
                timestamp_ns: scan.timestamp_ns,
                odom_from_robot: scan.odom_from_robot,
                run_from_robot: keyframe.run_from_robot,
                motion_covariance: keyframe.motion_covariance,
                ranges_m: std::mem::take(&mut scan.ranges_m),
            });
        }
    }
    Ok(keyframes)
}
