//! Regions of cells told as rooms and doors.

use std::collections::{BTreeMap, BTreeSet};

use super::config::RoomsConfig;
use super::floor::Floor;
use super::{Door, Room, RoomKind, RoomMap};
use crate::geometry::Point2;
use crate::semantics::outline::{rings, simplified};

/// Numbers the regions in the order of their first cells and measures them.
pub(super) fn describe(
    floor: &Floor,
    origin: Point2,
    clearance: &[f32],
    thickness: &[f32],
    regions: &[u32],
    config: &RoomsConfig,
) -> RoomMap {
    let mut number_of: BTreeMap<u32, u32> = BTreeMap::new();
    let mut cells_of: Vec<Vec<usize>> = Vec::new();
    let mut room_of_cell = vec![0; regions.len()];
    for (cell, &region) in regions.iter().enumerate().filter(|(_, region)| **region != 0) {
        let number = *number_of.entry(region).or_insert_with(|| {
            cells_of.push(Vec::new());
            cells_of.len() as u32
        });
        room_of_cell[cell] = number;
        cells_of[number as usize - 1].push(cell);
    }
    let place = Place { floor, origin };
    let doors = doors(&place, clearance, &room_of_cell, config);
    let rooms = cells_of.iter().zip(0..).map(|(cells, number)| Room {
        kind: kind(floor, thickness, cells, config),
        area_m2: cells.len() as f64 * floor.cell_m2(),
        center: deepest(&place, clearance, cells),
        rings: place.rings(cells),
        neighbors: neighbors(&doors, number),
    });
    RoomMap {
        rooms: rooms.collect(),
        doors,
        width: floor.width,
        resolution_m: floor.resolution_m,
        origin,
        room_of_cell,
    }
}

/// Where the cells lie in the map.
struct Place<'a> {
    floor: &'a Floor,
    origin: Point2,
}

impl Place<'_> {
    fn center_of(&self, cell: usize) -> Point2 {
        let along = |index: usize| (index as f64 + 0.5) * self.floor.resolution_m;
        Point2::new(
            self.origin.x + along(cell % self.floor.width),
            self.origin.y + along(cell / self.floor.width),
        )
    }

    fn rings(&self, cells: &[usize]) -> Vec<Vec<Point2>> {
        let at = |&cell: &usize| ((cell % self.floor.width) as i64, (cell / self.floor.width) as i64);
        let cells: Vec<(i64, i64)> = cells.iter().map(at).collect();
        // A wall is not known better than to a cell, and millimetres are more than enough.
        let whole_mm = |meters: f64| (meters * 1e3).round() / 1e3;
        let in_map = |point: &Point2| {
            Point2::new(whole_mm(self.origin.x + point.x), whole_mm(self.origin.y + point.y))
        };
        let simple =
            |ring: &Vec<Point2>| simplified(ring, self.floor.resolution_m).iter().map(in_map).collect();
        rings(&cells, self.floor.resolution_m).iter().map(simple).collect()
    }
}

fn kind(floor: &Floor, thickness: &[f32], cells: &[usize], config: &RoomsConfig) -> RoomKind {
    let mut widths: Vec<f32> = cells.iter().map(|&cell| thickness[cell]).collect();
    let middle = widths.len() / 2;
    let half_width_m =
        f64::from(*widths.select_nth_unstable_by(middle, f32::total_cmp).1) * floor.resolution_m;
    let length_m = cells.len() as f64 * floor.cell_m2() / (2.0 * half_width_m);
    if half_width_m >= config.hall_radius_m {
        RoomKind::Hall
    } else if length_m >= config.corridor_elongation * 2.0 * half_width_m {
        RoomKind::Corridor
    } else {
        RoomKind::Room
    }
}

/// The cell farthest from any wall, the first of equals.
fn deepest(place: &Place<'_>, clearance: &[f32], cells: &[usize]) -> Point2 {
    let deeper = |best: usize, &cell: &usize| if clearance[cell] > clearance[best] { cell } else { best };
    place.center_of(cells.iter().fold(cells[0], deeper))
}

fn neighbors(doors: &[Door], number: u32) -> Vec<u32> {
    let beyond = |door: &Door| match door.rooms {
        (first, second) if first == number => Some(second),
        (first, second) if second == number => Some(first),
        _ => None,
    };
    doors.iter().filter_map(beyond).collect::<BTreeSet<u32>>().into_iter().collect()
}

/// Every unbroken line along which two rooms touch is an opening.
fn doors(place: &Place<'_>, clearance: &[f32], room_of_cell: &[u32], config: &RoomsConfig) -> Vec<Door> {
    let mut touching: BTreeMap<(u32, u32), BTreeSet<usize>> = BTreeMap::new();
    for (cell, &room) in room_of_cell.iter().enumerate().filter(|(_, room)| **room != 0) {
        for other in place.floor.beside(cell).map(|other| room_of_cell[other]) {
            if other != 0 && other != room {
                touching.entry((room.min(other) - 1, room.max(other) - 1)).or_default().insert(cell);
            }
        }
    }
    let mut doors = Vec::new();
    for (rooms, mut left) in touching {
        while let Some(start) = left.pop_first() {
            let mut line = vec![start];
            let mut next = 0;
            while let Some(&cell) = line.get(next) {
                next += 1;
                line.extend(place.floor.around(cell).filter(|other| left.remove(other)));
            }
            let half_width = line.iter().map(|&cell| clearance[cell]).fold(0.0, f32::max);
            let width_m = 2.0 * f64::from(half_width) * place.floor.resolution_m;
            if width_m < config.door_width_min_m {
                continue;
            }
            let share = 1.0 / line.len() as f64;
            let position = line
                .iter()
                .map(|&cell| place.center_of(cell))
                .fold(Point2::default(), |sum, at| Point2::new(sum.x + share * at.x, sum.y + share * at.y));
            doors.push(Door { position, width_m, rooms });
        }
    }
    doors
}
