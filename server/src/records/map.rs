//! A map version, open for reading.

use std::ops::Range;

use locution_engine::geometry::Pose2;
use locution_engine::mapping::PlaceMatch;
use locution_engine::recording::{PlacedKeyframe, RunTrajectory};
use locution_engine::scan::Scan;
use locution_engine::semantics::{MapRooms, PlaceMap};

use super::codec;
use super::keys::{Key, PartKind, RunIdx};
use super::pieces::{join_pieces, pieces};
use super::reader::SiteReader;
use super::run::Run;
use super::series;
use super::stored::StoredKeyframe;
use super::stored_map::{MapPose, MapRecord, MapRun, MatchPlace, StoredLabel};
use crate::storage::{Batch, StorageError};

/// A map version, with the texts of the generation that serves.
#[derive(Clone)]
pub struct Map {
    pub record: MapRecord,
    reader: SiteReader,
}

/// A run, or a piece of one, at its poses in a map.
#[derive(Clone)]
pub struct PlacedRun {
    /// Its part in the map.
    pub map_run: MapRun,
    /// The run itself; it may have gone on since the map was built.
    pub run: Run,
    /// Poses of its keyframes.
    pub poses: Vec<MapPose>,
}

impl Map {
    /// A version whose record is at hand.
    pub fn new(record: MapRecord, reader: SiteReader) -> Self {
        Self { record, reader }
    }

    /// What it was read with.
    pub fn reader(&self) -> &SiteReader {
        &self.reader
    }

    /// Poses of a run's keyframes.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn poses(&self, run: &MapRun) -> Result<Vec<MapPose>, StorageError> {
        self.part(PartKind::Poses, run.first_pose..run.first_pose + run.num_poses).await
    }

    /// Where a run was at any scan, piece by piece; nowhere when it is not in the map.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of its keyframes is missing.
    pub async fn places_of(&self, run: RunIdx) -> Result<RunPlaces, StorageError> {
        let mut pieces = Vec::new();
        for piece in self.record.pieces_of(run) {
            pieces.push((piece.clone(), self.trajectory(piece).await?));
        }
        Ok(RunPlaces { pieces })
    }

    /// Where a run, or a piece of one, was at any scan of it.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of its keyframes is missing.
    pub async fn trajectory(&self, run: &MapRun) -> Result<RunTrajectory, StorageError> {
        let keyframes = self.reader.run(run.run).await?.stored_keyframes().await?;
        Ok(trajectory_of(&keyframes, &self.poses(run).await?))
    }

    /// Labels of a run's observations.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn labels(&self, run: &MapRun) -> Result<Vec<StoredLabel>, StorageError> {
        self.part(PartKind::Labels, run.first_label..run.first_label + run.num_labels).await
    }

    /// Where and when the stretches of all matches were driven; nothing in versions that do not say.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn match_places(&self) -> Result<Vec<Option<MatchPlace>>, StorageError> {
        match self.record.has_match_places {
            true => self.part(PartKind::MatchPlaces, 0..self.record.num_matches).await,
            false => Ok(Vec::new()),
        }
    }

    async fn part<T: serde::de::DeserializeOwned>(
        &self,
        kind: PartKind,
        range: Range<u64>,
    ) -> Result<Vec<T>, StorageError> {
        let version = self.record.version;
        let key = |first| Key::MapPart(version, kind, first);
        series::read(self.reader.store(), &Key::all_map_parts(version, kind), key, range, usize::MAX).await
    }

    /// All runs that are in a component, or in any.
    pub async fn placed_runs(&self, component: Option<u32>) -> Result<Vec<PlacedRun>, StorageError> {
        let mut placed = Vec::new();
        for map_run in &self.record.runs {
            if map_run.num_poses == 0 || component.is_some_and(|component| component != map_run.component) {
                continue;
            }
            let run = self.reader.run(map_run.run).await?;
            placed.push(PlacedRun { map_run: map_run.clone(), run, poses: self.poses(map_run).await? });
        }
        Ok(placed)
    }

    /// The places of a component; `None` for a component without any.
    pub async fn places(&self, component: u32) -> Result<Option<PlaceMap>, StorageError> {
        let prefix = Key::all_places(self.record.version, component);
        let stored = self.reader.store().scan(&prefix, &[], usize::MAX).await?;
        if stored.is_empty() {
            return Ok(None);
        }
        let json = join_pieces(stored.iter().map(|(_, piece)| piece), "places")?;
        serde_json::from_slice(&json).map(Some).map_err(|error| unreadable("places", &error))
    }

    /// The rooms of all components; `None` in versions of programs that did not know rooms.
    pub async fn rooms(&self) -> Result<Option<MapRooms>, StorageError> {
        let prefix = Key::all_map_parts(self.record.version, PartKind::Rooms);
        let stored = self.reader.store().scan(&prefix, &[], usize::MAX).await?;
        if stored.is_empty() {
            return Ok(None);
        }
        let json = join_pieces(stored.iter().map(|(_, piece)| piece), "rooms")?;
        serde_json::from_slice(&json).map(Some).map_err(|error| unreadable("rooms", &error))
    }

    /// Calls `visit(number, match)` for every match from a number on, until it answers that it has enough.
    pub async fn visit_matches(
        &self,
        from: u64,
        mut visit: impl FnMut(u64, PlaceMatch) -> Visit,
    ) -> Result<(), StorageError> {
        let version = self.record.version;
        let key = |first| Key::Match(version, first);
        let mut outcome = Visit::GoOn;
        let range = from..self.record.num_matches;
        series::for_each_chunk(self.reader.store(), &Key::all_matches(version), key, range, |first, bytes| {
            let chunk: Vec<String> = codec::decode(bytes, "matches")?;
            for (id, json) in (first..).zip(&chunk).filter(|(id, _)| *id >= from) {
                if outcome == Visit::Enough {
                    break;
                }
                outcome = visit(id, parse_match(json)?);
            }
            Ok(chunk.len() as u64)
        })
        .await
    }

    /// One match by its number; `None` when there is none.
    pub async fn a_match(&self, id: u64) -> Result<Option<PlaceMatch>, StorageError> {
        if id >= self.record.num_matches {
            return Ok(None);
        }
        let version = self.record.version;
        let key = |first| Key::Match(version, first);
        let prefix = Key::all_matches(version);
        let json: Vec<String> = series::read(self.reader.store(), &prefix, key, id..id + 1, 1).await?;
        json.first().map(|json| parse_match(json)).transpose()
    }
}

/// Where a run was in a map, piece by piece.
pub struct RunPlaces {
    pieces: Vec<(MapRun, RunTrajectory)>,
}

impl RunPlaces {
    /// The component and the pose in it at a scan at which the run's own motion had brought it to `run_from_robot`;
    /// `None` for scans that are not in the map.
    pub fn at(&self, scan_seq: u64, run_from_robot: &Pose2) -> Option<(u32, Pose2)> {
        let (piece, trajectory) = self.pieces.iter().find(|(piece, _)| piece.scans().contains(&scan_seq))?;
        Some((piece.component, trajectory.at(scan_seq, run_from_robot)?))
    }
}

/// Whether more is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    GoOn,
    Enough,
}

impl PlacedRun {
    /// Where the run was at any scan.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of its keyframes is missing.
    pub async fn trajectory(&self) -> Result<RunTrajectory, StorageError> {
        Ok(trajectory_of(&self.run.stored_keyframes().await?, &self.poses))
    }

    /// The scans of keyframes `range`, in their order.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when one of them is missing.
    pub async fn keyframe_scans(&self, range: Range<usize>) -> Result<Vec<Scan>, StorageError> {
        let Some(poses) = self.poses.get(range).filter(|poses| !poses.is_empty()) else {
            return Ok(Vec::new());
        };
        let (first, last) = (poses[0].scan_seq, poses[poses.len() - 1].scan_seq);
        let scans = self.run.scans(first..last + 1).await?;
        let mut wanted = poses.iter().map(|pose| pose.scan_seq).peekable();
        let is_keyframe = |(sequence, _): &(u64, Scan)| wanted.next_if_eq(sequence).is_some();
        Ok((first..).zip(scans).filter(is_keyframe).map(|(_, scan)| scan).collect())
    }
}

/// Keyframes of other pieces, and those that came after the map was built, have no pose among these.
fn trajectory_of(keyframes: &[StoredKeyframe], poses: &[MapPose]) -> RunTrajectory {
    let first = poses.first().map_or(0, |first| first.scan_seq);
    let of_piece = keyframes.iter().skip_while(|keyframe| keyframe.scan_seq < first);
    let placed = of_piece.zip(poses);
    placed
        .map(|(keyframe, pose)| PlacedKeyframe {
            scan_seq: keyframe.scan_seq,
            run_from_robot: keyframe.run_from_robot,
            map_from_robot: pose.map_from_robot,
        })
        .collect()
}

/// Writes the places of a component into a batch, as JSON in pieces.
///
/// # Errors
/// What the encoder says of places that cannot be written.
pub fn append_places(
    batch: &mut Batch,
    version: u64,
    component: u32,
    places: &PlaceMap,
) -> serde_json::Result<()> {
    for (piece, bytes) in (0..).zip(pieces(&serde_json::to_vec(places)?)) {
        batch.put(Key::places(version, component, piece).encode(), bytes);
    }
    Ok(())
}

/// Writes the rooms of a version into a batch, as JSON in pieces.
///
/// # Errors
/// What the encoder says of rooms that cannot be written.
pub fn append_rooms(batch: &mut Batch, version: u64, rooms: &MapRooms) -> serde_json::Result<()> {
    for (piece, bytes) in (0..).zip(pieces(&serde_json::to_vec(rooms)?)) {
        batch.put(Key::MapPart(version, PartKind::Rooms, piece).encode(), bytes);
    }
    Ok(())
}

/// Matches in chunks, each with its key; as JSON inside, since their evidence grows with the engine.
///
/// # Errors
/// What the encoder says of a match that cannot be written.
pub fn match_chunks(version: u64, matches: &[PlaceMatch]) -> serde_json::Result<Vec<(Key, bytes::Bytes)>> {
    let size = series::NUM_ITEMS_PER_CHUNK_MAX;
    let chunk = |(idx, chunk): (usize, &[PlaceMatch])| {
        let json: serde_json::Result<Vec<String>> = chunk.iter().map(serde_json::to_string).collect();
        Ok((Key::Match(version, (idx * size) as u64), codec::encode(&json?)))
    };
    matches.chunks(size).enumerate().map(chunk).collect()
}

fn parse_match(json: &str) -> Result<PlaceMatch, StorageError> {
    serde_json::from_str(json).map_err(|error| unreadable("a match", &error))
}

fn unreadable(what: &str, error: &serde_json::Error) -> StorageError {
    StorageError::Corrupt { what: format!("{what}: {error}") }
}
