//! Rooms of a whole map, with ids that outlive it.
//!
//! A room keeps the id of the room that it shares most floor with in the map before. Where that floor lies now is told by
//! the keyframes that both maps hold, so ids survive whatever moves, turns or joins the frames of the components.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::{RoomKind, RoomMap, RoomsConfig, find_rooms};
use crate::geometry::{Point2, Pose2};
use crate::mapping::{RunRecord, SiteMap};
use crate::occupancy::{GridMap, OccupancyConfig, TiledOccupancy};
use crate::semantics::anchors::{MovedPose, carry_point};
use crate::semantics::outline::is_inside;

/// Edge of a cell of the grids that are divided, metres.
const RESOLUTION_M: f64 = 0.1;
/// Grids are coarser rather than larger than this, which bounds memory and time.
const NUM_CELLS_MAX: usize = 6_000_000;
/// Beams are followed this far, as in served grids, metres.
const RANGE_LIMIT_M: f64 = 20.0;
/// Distance between two points of a room's floor by which it is known again, metres.
const SAMPLE_M: f64 = 0.4;
/// Of the smaller of two rooms at least this share lies in the other when they are the same.
const SAME_SHARE_MIN: f64 = 0.5;
/// Floor farther than this from any keyframe is not carried into another map, metres.
const CARRY_REACH_M: f64 = 20.0;

/// A room with the id by which it is known in all versions of a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnownRoom {
    /// Unique in the site, never used again.
    pub id: u64,
    /// What it is by its shape.
    pub kind: RoomKind,
    /// Free floor in it, small obstacles included, square metres.
    pub area_m2: f64,
    /// The position in it that is farthest from any wall.
    pub center: Point2,
    /// Its outer border, counter-clockwise, then those of what stands in it, clockwise; each closed implicitly.
    pub rings: Vec<Vec<Point2>>,
    /// Ids of the rooms that an opening joins it to, ascending.
    pub neighbors: Vec<u64>,
}

impl KnownRoom {
    /// Whether a point lies on its floor.
    pub fn holds(&self, point: &Point2) -> bool {
        is_inside(&self.rings, point)
    }

    /// Points of its floor, evenly spread.
    fn samples(&self) -> Vec<Point2> {
        let border = || self.rings.first().into_iter().flatten();
        let bounds = |of: fn(&Point2) -> f64| {
            let values = border().map(of);
            values.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)))
        };
        let ((left, right), (bottom, top)) = (bounds(|point| point.x), bounds(|point| point.y));
        let steps = |from: f64, to: f64| {
            let num = ((to - from) / SAMPLE_M).ceil().max(0.0) as usize;
            (0..num).map(move |step| from + (step as f64 + 0.5) * SAMPLE_M)
        };
        let points = steps(bottom, top).flat_map(|y| steps(left, right).map(move |x| Point2::new(x, y)));
        points.filter(|point| self.holds(point)).collect()
    }
}

/// An opening between two rooms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnownDoor {
    /// Its middle.
    pub position: Point2,
    /// Diameter of the largest disc that passes through it, metres.
    pub width_m: f64,
    /// Ids of the rooms that it joins.
    pub rooms: (u64, u64),
}

/// The rooms of one component of a map, in its frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ComponentRooms {
    /// The component.
    pub component: u32,
    /// In the order of their ids.
    pub rooms: Vec<KnownRoom>,
    /// Between rooms of this component.
    pub doors: Vec<KnownDoor>,
}

impl ComponentRooms {
    /// The room that holds a point.
    pub fn room_at(&self, point: &Point2) -> Option<&KnownRoom> {
        self.rooms.iter().find(|room| room.holds(point))
    }

    /// A room by its id.
    pub fn room(&self, id: u64) -> Option<&KnownRoom> {
        self.rooms.iter().find(|room| room.id == id)
    }
}

/// The rooms of all components of a map.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapRooms {
    /// Ascending.
    pub components: Vec<ComponentRooms>,
    /// The id that the next room that nobody has seen before gets.
    pub next_id: u64,
}

/// The map before: its rooms, and where it had the keyframes of each run, by their scans.
#[derive(Clone, Debug, Default)]
pub struct RoomsBefore {
    /// Its rooms.
    pub rooms: MapRooms,
    /// For each run the component and the poses, in the order of scans.
    pub runs: Vec<(u32, Vec<(u64, Pose2)>)>,
}

impl MapRooms {
    /// Divides every component of a map into rooms; those that the map before had keep their ids.
    pub fn of(runs: &[RunRecord<'_>], map: &SiteMap, config: &RoomsConfig, before: &RoomsBefore) -> Self {
        let driven = |run_idx: &usize| !map.runs[*run_idx].map_from_keyframes.is_empty();
        let components: BTreeSet<u32> =
            (0..runs.len()).filter(driven).map(|run_idx| map.runs[run_idx].component).collect();
        let divided: Vec<(u32, RoomMap)> = components
            .into_iter()
            .filter_map(|component| Some((component, find_rooms(&grid_of(runs, map, component)?, config))))
            .collect();
        let mut next_id = before.rooms.next_id;
        let mut kept = kept_ids(&divided, before, &moves_between(runs, map, before));
        let mut known = Self::default();
        for (component, found) in &divided {
            let ids: Vec<u64> = (0..found.rooms.len() as u32)
                .map(|number| {
                    kept.remove(&(*component, number)).unwrap_or_else(|| {
                        next_id += 1;
                        next_id - 1
                    })
                })
                .collect();
            known.components.push(numbered(*component, found, &ids));
        }
        known.next_id = next_id;
        known
    }

    /// The rooms of a component.
    pub fn component(&self, component: u32) -> Option<&ComponentRooms> {
        self.components.iter().find(|rooms| rooms.component == component)
    }
}

fn numbered(component: u32, found: &RoomMap, ids: &[u64]) -> ComponentRooms {
    let id = |number: u32| ids[number as usize];
    let mut rooms: Vec<KnownRoom> = found
        .rooms
        .iter()
        .zip(ids)
        .map(|(room, own)| {
            let mut neighbors: Vec<u64> = room.neighbors.iter().map(|number| id(*number)).collect();
            neighbors.sort_unstable();
            let (kind, area_m2, center) = (room.kind, room.area_m2, room.center);
            KnownRoom { id: *own, kind, area_m2, center, rings: room.rings.clone(), neighbors }
        })
        .collect();
    rooms.sort_by_key(|room| room.id);
    let doors = found.doors.iter().map(|door| KnownDoor {
        position: door.position,
        width_m: door.width_m,
        rooms: (id(door.rooms.0), id(door.rooms.1)),
    });
    ComponentRooms { component, rooms, doors: doors.collect() }
}

/// The grid of a component; `None` when its scans saw nothing.
fn grid_of(runs: &[RunRecord<'_>], map: &SiteMap, component: u32) -> Option<GridMap> {
    let config = OccupancyConfig {
        resolution_m: RESOLUTION_M,
        range_limit_m: RANGE_LIMIT_M,
        no_return_clear_m: 0.0,
        ..OccupancyConfig::default()
    };
    let mut occupancy = TiledOccupancy::new(config).ok()?;
    for (run, mapped) in runs.iter().zip(&map.runs).filter(|(_, mapped)| mapped.component == component) {
        for (keyframe, pose) in run.keyframes.iter().zip(&mapped.map_from_keyframes) {
            occupancy.add_scan(run.geometry, &keyframe.ranges_m, pose);
        }
    }
    let mut grid = GridMap::of_occupancy(&occupancy)?;
    while grid.cells().len() > NUM_CELLS_MAX {
        grid = grid.halved();
    }
    Some(grid)
}

/// How a keyframe moved from the map before into this one, and into which component.
#[derive(Clone, Copy)]
struct Moved {
    component: u32,
    pose: MovedPose,
}

/// Keyframes that both maps hold, by component before and squares of the map before.
type Moves = BTreeMap<(u32, i64, i64), Vec<Moved>>;

/// Edge of those squares, metres.
const SQUARE_M: f64 = 4.0;

fn square_of(component: u32, point: &Point2) -> (u32, i64, i64) {
    (component, (point.x / SQUARE_M).floor() as i64, (point.y / SQUARE_M).floor() as i64)
}

fn moves_between(runs: &[RunRecord<'_>], map: &SiteMap, before: &RoomsBefore) -> Moves {
    let mut moves = Moves::new();
    for ((run, mapped), (component, poses)) in runs.iter().zip(&map.runs).zip(&before.runs) {
        for (keyframe, to) in run.keyframes.iter().zip(&mapped.map_from_keyframes) {
            if let Ok(idx) = poses.binary_search_by_key(&keyframe.scan_seq, |(scan_seq, _)| *scan_seq) {
                let from = poses[idx].1;
                let moved = Moved { component: mapped.component, pose: MovedPose { from, to: *to } };
                moves.entry(square_of(*component, &from.position())).or_default().push(moved);
            }
        }
    }
    moves
}

/// Where a point of the map before lies now, as the nearest keyframe says.
fn carry(moves: &Moves, component: u32, point: &Point2) -> Option<(u32, Point2)> {
    let (_, column, row) = square_of(component, point);
    let reach = (CARRY_REACH_M / SQUARE_M).ceil() as i64;
    let mut best: Option<(f64, &Moved)> = None;
    for ring in 0..=reach {
        for (dx, dy) in (-ring..=ring).flat_map(|dx| (-ring..=ring).map(move |dy| (dx, dy))) {
            if dx.abs().max(dy.abs()) != ring {
                continue;
            }
            for moved in moves.get(&(component, column + dx, row + dy)).into_iter().flatten() {
                let away_m = moved.pose.from.position().distance(point);
                if best.is_none_or(|(least_m, _)| away_m < least_m) {
                    best = Some((away_m, moved));
                }
            }
        }
        // A ring farther out begins this far away.
        if best.is_some_and(|(least_m, _)| least_m <= ring as f64 * SQUARE_M) {
            break;
        }
    }
    let (_, moved) = best?;
    Some((moved.component, carry_point(point, &[moved.pose])?))
}

/// Ids of rooms that were known before, by component and number of the rooms as they are divided now.
fn kept_ids(divided: &[(u32, RoomMap)], before: &RoomsBefore, moves: &Moves) -> BTreeMap<(u32, u32), u64> {
    let sample_m2 = SAMPLE_M * SAMPLE_M;
    let mut shared: Vec<(usize, u64, (u32, u32))> = Vec::new();
    for rooms in &before.rooms.components {
        for room in &rooms.rooms {
            let samples = room.samples();
            let mut votes: BTreeMap<(u32, u32), usize> = BTreeMap::new();
            for (component, point) in samples.iter().filter_map(|point| carry(moves, rooms.component, point))
            {
                let found = divided.iter().find(|(of, _)| *of == component);
                if let Some(number) = found.and_then(|(_, found)| found.room_at(&point)) {
                    *votes.entry((component, number)).or_default() += 1;
                }
            }
            for (now, num_shared) in votes {
                let area_m2 = divided.iter().find(|(of, _)| *of == now.0);
                let area_m2 = area_m2.map_or(0.0, |(_, found)| found.rooms[now.1 as usize].area_m2);
                let smaller = (samples.len() as f64).min(area_m2 / sample_m2);
                if num_shared as f64 >= SAME_SHARE_MIN * smaller {
                    shared.push((num_shared, room.id, now));
                }
            }
        }
    }
    shared.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut given: BTreeSet<u64> = BTreeSet::new();
    let mut kept = BTreeMap::new();
    for (_, id, now) in shared {
        if !given.contains(&id) && !kept.contains_key(&now) {
            given.insert(id);
            kept.insert(now, id);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::{Keyframe, MappedRun};
    use crate::scan::ScanGeometry;

    /// Two rooms side by side with a door between, seen by a laser all around that stands in each.
    fn geometry() -> ScanGeometry {
        ScanGeometry {
            num_ranges: 360,
            angle_min_rad: 0.0,
            angle_increment_rad: std::f64::consts::PI / 180.0,
            range_max_m: 30.0,
            robot_from_laser: Pose2::identity(),
        }
    }

    fn world() -> GridMap {
        let mut grid = GridMap::unknown(122, 52, 0.1, Point2::default());
        for (column, row) in (0..122).flat_map(|column| (0..52).map(move |row| (column, row))) {
            let is_wall = column == 0 || column == 121 || row == 0 || row == 51;
            let is_wall = is_wall || ((60..62).contains(&column) && !(20..30).contains(&row));
            let state = if is_wall {
                crate::occupancy::CellState::Occupied
            } else {
                crate::occupancy::CellState::Free
            };
            grid.set(column, row, state);
        }
        grid
    }

    fn keyframes(poses: &[Pose2]) -> Vec<Keyframe> {
        let (grid, geometry) = (world(), geometry());
        let range_m = |pose: &Pose2, beam: usize| {
            let way = pose.theta + geometry.beam_angle_rad(beam);
            crate::occupancy::cast_ray(&grid, &pose.position(), way, 30.0) as f32
        };
        let keyframe = |(seq, pose): (u64, &Pose2)| Keyframe {
            scan_seq: 10 * seq,
            timestamp_ns: 0,
            odom_from_robot: *pose,
            run_from_robot: *pose,
            motion_covariance: [[0.0; 3]; 3],
            ranges_m: (0..geometry.num_ranges).map(|beam| range_m(pose, beam)).collect(),
        };
        (0..).zip(poses).map(keyframe).collect()
    }

    fn drive(from: f64, to: f64) -> Vec<Pose2> {
        (0..=20).map(|step| Pose2::new(from + (to - from) * f64::from(step) / 20.0, 2.5, 0.0)).collect()
    }

    fn rooms_of(runs: &[(Vec<Keyframe>, Vec<Pose2>)], before: &RoomsBefore) -> (MapRooms, RoomsBefore) {
        let geometry = geometry();
        let records: Vec<RunRecord<'_>> = runs
            .iter()
            .map(|(keyframes, _)| RunRecord {
                geometry: &geometry,
                observations: &[],
                words: &[],
                keyframes,
                area: None,
            })
            .collect();
        let mapped =
            runs.iter().map(|(_, poses)| MappedRun { component: 0, map_from_keyframes: poses.clone() });
        let map = SiteMap { runs: mapped.collect(), num_components: 1, ..SiteMap::default() };
        let rooms = MapRooms::of(&records, &map, &RoomsConfig::default(), before);
        let poses = |(keyframes, poses): &(Vec<Keyframe>, Vec<Pose2>)| {
            (0, keyframes.iter().map(|keyframe| keyframe.scan_seq).zip(poses.iter().copied()).collect())
        };
        (rooms.clone(), RoomsBefore { rooms, runs: runs.iter().map(poses).collect() })
    }

    #[test]
    fn ids_survive_a_map_that_grows_and_turns() {
        let left = drive(1.0, 5.0);
        let (first, before) = rooms_of(&[(keyframes(&left), left.clone())], &RoomsBefore::default());
        let rooms = &first.component(0).unwrap().rooms;
        assert!(!rooms.is_empty() && first.next_id == rooms.len() as u64);
        let old = first.component(0).unwrap().room_at(&Point2::new(3.0, 2.5)).unwrap().id;

        // A second robot sees the other room, and the whole map is turned and shifted meanwhile.
        let shift = Pose2::new(-7.0, 4.0, 1.1);
        let turned = |poses: &[Pose2]| poses.iter().map(|pose| shift.compose(pose)).collect::<Vec<_>>();
        let right = drive(2.0, 11.0);
        let both = [(keyframes(&left), turned(&left)), (keyframes(&right), turned(&right))];
        let (second, _) = rooms_of(&both, &before);
        let at = |x: f64| {
            let point = shift.transform_point(&Point2::new(x, 2.5));
            second.component(0).unwrap().room_at(&point).unwrap()
        };
        assert_eq!(at(3.0).id, old);
        assert_ne!(at(9.0).id, old);
        assert!(at(3.0).neighbors.contains(&at(9.0).id), "{second:?}");
        let ids: BTreeSet<u64> = second.component(0).unwrap().rooms.iter().map(|room| room.id).collect();
        assert_eq!(ids.len(), second.component(0).unwrap().rooms.len());

        // Of nothing but what it was, a map keeps every id and every byte.
        let again = rooms_of(&[(keyframes(&left), left.clone())], &before);
        assert_eq!(again.0, first);
    }
}
