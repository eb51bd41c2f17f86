//! Scans and observations of a run that lie in a window of time and place.
//!
//! Timestamps are whatever a robot sent, in no order that one could search: every scan of the run is looked at.

use std::ops::Range;

use locution_engine::geometry::Pose2;
use locution_engine::scan::Scan;
use locution_engine::text::Observation;

use super::trajectory::{Frame, trajectory};
use crate::app::site::Site;
use crate::app::{AppError, Window};
use crate::records::{MapVersion, Run, RunPlaces};

/// Observations read at once.
const NUM_OBSERVATIONS_PER_STEP: usize = 2_000;

/// In whose coordinates an area is meant.
#[derive(Clone, Copy, Debug)]
pub struct FrameOf {
    pub frame: Frame,
    /// Version of the map, when the frame is that of the map.
    pub version: Option<MapVersion>,
}

/// Items with their numbers, and the number to go on with.
pub type Part<T> = (Vec<(u64, T)>, Option<u64>);

/// Up to `limit` scans in a window, from a sequence number on.
///
/// # Errors
/// [`AppError::NotReady`] in the map frame before the first build; those of the storage.
pub async fn scans_in(
    site: &Site,
    run: &Run,
    window: &Window,
    of: FrameOf,
    from: u64,
    limit: usize,
) -> Result<Part<Scan>, AppError> {
    if window.is_everything() {
        let scans = run.scans(from..from.saturating_add(limit as u64)).await?;
        let end = from + scans.len() as u64;
        return Ok(((from..).zip(scans).collect(), (end < run.head.next_sequence).then_some(end)));
    }
    let poses = trajectory(site, run, of.frame, of.version, None).await?.poses;
    let wanted = poses.iter().filter(|pose| {
        pose.scan_seq >= from && window.holds(pose.timestamp_ns, &pose.frame_from_robot.position())
    });
    let wanted: Vec<u64> = wanted.map(|pose| pose.scan_seq).take(limit.saturating_add(1)).collect();
    let next = wanted.get(limit).copied();
    let mut scans = Vec::new();
    for stretch in stretches(&wanted[..wanted.len().min(limit)]) {
        scans.extend(stretch.clone().zip(run.scans(stretch).await?));
    }
    Ok((scans, next))
}

/// Consecutive numbers as ranges.
fn stretches(numbers: &[u64]) -> impl Iterator<Item = Range<u64>> {
    numbers.chunk_by(|a, b| a + 1 == *b).map(|chunk| chunk[0]..chunk[chunk.len() - 1] + 1)
}

/// Up to `limit` observations in a window, from a number on.
///
/// # Errors
/// [`AppError::NotReady`] in the map frame before the first build; those of the storage.
pub async fn observations_in(
    site: &Site,
    run: &Run,
    window: &Window,
    of: FrameOf,
    from: u64,
    limit: usize,
) -> Result<Part<Observation>, AppError> {
    let in_map = match of.frame {
        Frame::Map if window.area.is_some() => Some(map_trajectory(site, run, of.version).await?),
        _ => None,
    };
    let place = |observation: &Observation| -> Pose2 {
        match (&in_map, of.frame) {
            (Some(trajectory), _) => {
                let own = observation.run_from_robot;
                trajectory.at(observation.scan_seq, &own).map_or(own, |(_, pose)| pose)
            }
            (None, Frame::Odom) => observation.odom_from_robot,
            (None, _) => observation.run_from_robot,
        }
    };
    let mut found = Vec::new();
    let mut next = from;
    while next < run.text.num_observations {
        let page = run.observations(next, NUM_OBSERVATIONS_PER_STEP).await?;
        for (number, observation) in (next..).zip(&page) {
            if !window.holds(observation.timestamp_ns, &place(observation).position()) {
                continue;
            }
            if found.len() == limit {
                return Ok((found, Some(number)));
            }
            found.push((number, observation.clone()));
        }
        next += page.len() as u64;
    }
    Ok((found, None))
}

async fn map_trajectory(site: &Site, run: &Run, version: Option<MapVersion>) -> Result<RunPlaces, AppError> {
    let map = site.map(version).await?;
    if map.record.pieces_of(run.idx).next().is_none() {
        return Err(super::trajectory::not_in(run, &map.record));
    }
    Ok(map.places_of(run.idx).await?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_numbers_are_read_together() {
        let ranges: Vec<Range<u64>> = stretches(&[1, 2, 3, 7, 9, 10]).collect();
        assert_eq!(ranges, [1..4, 7..8, 9..11]);
    }
}
