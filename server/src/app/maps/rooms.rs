//! Rooms of a map and what people call them.

use std::collections::BTreeMap;

use locution_engine::semantics::{MapRooms, RoomsBefore};

use super::annotations::annotations;
use crate::app::AppError;
use crate::records::{Map, RunIdx};

/// Annotations of this kind name the room in which they lie.
const ROOM_KIND: &str = "room";

/// The rooms of all components.
///
/// # Errors
/// [`AppError::NotReady`] for a version of a program that did not know rooms.
pub async fn rooms(map: &Map) -> Result<MapRooms, AppError> {
    map.rooms().await?.ok_or_else(|| AppError::NotReady {
        detail: "this version of the map was built before there were rooms: build another".to_owned(),
    })
}

/// What people call rooms, by their ids; of several names the one that was given last.
///
/// # Errors
/// Those of the storage.
pub async fn names_of_rooms(map: &Map) -> Result<BTreeMap<u64, String>, AppError> {
    let Some(rooms) = map.rooms().await? else { return Ok(BTreeMap::new()) };
    let mut names = BTreeMap::new();
    for placed in annotations(map, None, Some(ROOM_KIND)).await? {
        let Some((component, shape)) = &placed.place else { continue };
        let room = rooms.component(*component).and_then(|rooms| rooms.room_at(&shape.middle()));
        if let Some(room) = room {
            names.insert(room.id, placed.annotation.name);
        }
    }
    Ok(names)
}

/// What the next version, which is made of these pieces of runs, needs of this one so that rooms keep their ids: a
/// piece is told by its run and its first scan.
///
/// # Errors
/// Those of the storage.
pub async fn rooms_before(map: &Map, pieces: &[(RunIdx, u64)]) -> Result<RoomsBefore, AppError> {
    let mut runs = Vec::new();
    for (run, first_scan) in pieces {
        let known =
            (map.record.runs.iter().rev()).find(|old| old.run == *run && old.first_scan <= *first_scan);
        let Some(known) = known else {
            runs.push((0, Vec::new()));
            continue;
        };
        let poses = map.poses(known).await?;
        runs.push((known.component, poses.iter().map(|pose| (pose.scan_seq, pose.map_from_robot)).collect()));
    }
    Ok(RoomsBefore { rooms: map.rooms().await?.unwrap_or_default(), runs })
}
