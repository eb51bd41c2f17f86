//! Doors on a way, told as a person would: "through the second door on the left".

use std::collections::BTreeMap;

use super::rooms::{ComponentRooms, KnownDoor, RoomKind};
use crate::geometry::{Point2, wrap_angle};

/// The direction in which a door is approached is taken over this much of the way,
const APPROACH_M: f64 = 2.0;
/// which ends so long before the door: the last steps turn towards it. Metres.
const TURN_M: f64 = 1.0;
/// A door within this angle of the way is ahead, radians.
const AHEAD_RAD: f64 = 0.6;
/// Doors farther than this from the way are not beside it, metres.
const BESIDE_M: f64 = 3.5;

/// The rooms of a component, and what people call some of them.
#[derive(Clone, Debug, Default)]
pub struct NamedRooms<'a> {
    /// `None` where rooms are not known.
    pub rooms: Option<&'a ComponentRooms>,
    /// By the id of the room.
    pub names: BTreeMap<u64, String>,
}

impl NamedRooms<'_> {
    /// What a person would say: its name, or what it is.
    pub(super) fn name_of(&self, room: u64) -> String {
        if let Some(name) = self.names.get(&room) {
            return name.clone();
        }
        match self.rooms.and_then(|rooms| rooms.room(room)).map(|room| room.kind) {
            Some(RoomKind::Corridor) => "the corridor".into(),
            Some(RoomKind::Hall) => "the hall".into(),
            _ => "the room".into(),
        }
    }
}

/// A door through which a way goes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Passage {
    pub position: Point2,
    pub text: String,
}

/// The rooms on a way and the doors between them.
pub(super) struct Passages {
    /// The room of each position.
    rooms: Vec<Option<u64>>,
    /// The doors, by the last position before each.
    doors: BTreeMap<usize, Passage>,
}

impl Passages {
    /// Looks up where a way goes; `travel_m` is the way up to each of its points.
    pub fn on_way(named: &NamedRooms<'_>, points: &[Point2], travel_m: &[f64]) -> Self {
        let Some(known) = named.rooms else {
            return Self { rooms: vec![None; points.len()], doors: BTreeMap::new() };
        };
        let rooms = rooms_along(known, points);
        let mut doors = BTreeMap::new();
        let mut entered = 0;
        for last in 0..points.len().saturating_sub(1) {
            let (Some(room), Some(next)) = (rooms[last], rooms[last + 1]) else { continue };
            if room == next {
                continue;
            }
            if let Some(door) = door_between(known, (room, next), &points[last]) {
                let way = Way { points: &points[..=last], travel_m: &travel_m[..=last], entered };
                let which = way.which_door(known, room, door);
                let text = format!("through {which} into {}", named.name_of(next));
                doors.insert(last, Passage { position: door.position, text });
            }
            entered = last + 1;
        }
        Self { rooms, doors }
    }

    pub fn room_at(&self, idx: usize) -> Option<u64> {
        self.rooms[idx]
    }

    /// The door that is passed behind a position.
    pub fn door_after(&self, idx: usize) -> Option<&Passage> {
        self.doors.get(&idx)
    }
}

/// The room of each point; where the way only touches a room, or walls drawn a little too thick hold a point, it stays in
/// the room where it was.
fn rooms_along(known: &ComponentRooms, points: &[Point2]) -> Vec<Option<u64>> {
    let found: Vec<Option<u64>> =
        points.iter().map(|point| known.room_at(point).map(|room| room.id)).collect();
    let mut now = found.iter().copied().flatten().next();
    let mut rooms = Vec::with_capacity(points.len());
    for (idx, room) in found.iter().enumerate() {
        let stays = found.get(idx + 1).is_none_or(|next| next == room);
        if room.is_some() && stays && door_between_any(known, now, *room) {
            now = *room;
        }
        rooms.push(now);
    }
    rooms
}

fn door_between_any(known: &ComponentRooms, from: Option<u64>, to: Option<u64>) -> bool {
    match (from, to) {
        (Some(from), Some(to)) if from != to => known.doors.iter().any(|door| joins(door, (from, to))),
        _ => true,
    }
}

fn joins(door: &KnownDoor, (from, to): (u64, u64)) -> bool {
    door.rooms == (from, to) || door.rooms == (to, from)
}

/// The nearest door between two rooms.
fn door_between<'a>(known: &'a ComponentRooms, rooms: (u64, u64), near: &Point2) -> Option<&'a KnownDoor> {
    let joining = known.doors.iter().filter(|door| joins(door, rooms));
    joining.min_by(|a, b| a.position.distance(near).total_cmp(&b.position.distance(near)))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Ahead,
}

/// The way up to a door, of which the part from `entered` on lies in the room that is left.
struct Way<'a> {
    points: &'a [Point2],
    travel_m: &'a [f64],
    entered: usize,
}

impl Way<'_> {
    fn which_door(&self, known: &ComponentRooms, room: u64, door: &KnownDoor) -> String {
        let end_m = self.travel_m[self.travel_m.len() - 1];
        if end_m - self.travel_m[self.entered] < APPROACH_M {
            return "the door".into();
        }
        let (number, side) = (|| {
            let side = self.side_of(&door.position, self.index_at(end_m - TURN_M))?;
            let came_in = self.points[self.entered];
            let passed = known.doors.iter().filter(|other| {
                let is_of_room = other.rooms.0 == room || other.rooms.1 == room;
                let is_other = other.position.distance(&door.position) > 1e-6;
                is_of_room
                    && is_other
                    && other.position.distance(&came_in) > 1.0
                    && self.is_passed(&other.position, side)
            });
            Some((passed.count() + 1, side))
        })()
        .unwrap_or((1, Side::Ahead));
        match side {
            Side::Ahead => "the door ahead".into(),
            Side::Left => format!("the {} door on the left", ordinal(number)),
            Side::Right => format!("the {} door on the right", ordinal(number)),
        }
    }

    /// Whether a door is left behind on a side.
    fn is_passed(&self, door: &Point2, side: Side) -> bool {
        let end_m = self.travel_m[self.travel_m.len() - 1];
        let distance = |idx: &usize| self.points[*idx].distance(door);
        let beside = (self.entered..self.points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        beside.is_some_and(|idx| {
            distance(&idx) <= BESIDE_M
                && self.travel_m[idx] < end_m - TURN_M
                && self.side_of(door, idx) == Some(side)
        })
    }

    /// The last position up to which no more than a travel was driven, in the room.
    fn index_at(&self, travel_m: f64) -> usize {
        let after = self.travel_m.partition_point(|&travel| travel <= travel_m);
        after.saturating_sub(1).max(self.entered)
    }

    /// On which side a door lies for whoever comes to a position; `None` where no direction can be told.
    fn side_of(&self, door: &Point2, at: usize) -> Option<Side> {
        let from = self.index_at(self.travel_m[at] - APPROACH_M);
        let to = if from == at { (at + 1).min(self.points.len() - 1) } else { at };
        let (dx, dy) = (self.points[to].x - self.points[from].x, self.points[to].y - self.points[from].y);
        if dx.hypot(dy) < 1e-6 {
            return None;
        }
        let bearing = (door.y - self.points[at].y).atan2(door.x - self.points[at].x);
        let turn = wrap_angle(bearing - dy.atan2(dx));
        Some(match turn {
            turn if turn.abs() < AHEAD_RAD => Side::Ahead,
            turn if turn > 0.0 => Side::Left,
            _ => Side::Right,
        })
    }
}

fn ordinal(number: usize) -> String {
    const WORDS: [&str; 10] =
        ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth"];
    WORDS.get(number - 1).map_or_else(|| format!("{number}th"), |word| (*word).to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::rooms::KnownRoom;
    use super::*;

    fn room(id: u64, kind: RoomKind, (x0, y0): (f64, f64), (x1, y1): (f64, f64)) -> KnownRoom {
        let ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| Point2::new(x, y)).to_vec();
        let center = Point2::new((x0 + x1) / 2.0, (y0 + y1) / 2.0);
        KnownRoom {
            id,
            kind,
            area_m2: (x1 - x0) * (y1 - y0),
            center,
            rings: vec![ring],
            neighbors: Vec::new(),
        }
    }

    fn door(x: f64, y: f64, rooms: (u64, u64)) -> KnownDoor {
        KnownDoor { position: Point2::new(x, y), width_m: 0.9, rooms }
    }

    /// A corridor of 20 m along x with two rooms on its left and one on its right.
    fn floor() -> ComponentRooms {
        ComponentRooms {
            component: 0,
            rooms: vec![
                room(0, RoomKind::Corridor, (0.0, 0.0), (20.0, 2.0)),
                room(1, RoomKind::Room, (2.0, 2.0), (8.0, 7.0)),
                room(2, RoomKind::Room, (9.0, 2.0), (16.0, 7.0)),
                room(3, RoomKind::Room, (4.0, -5.0), (12.0, 0.0)),
                room(4, RoomKind::Hall, (20.0, -5.0), (30.0, 5.0)),
            ],
            doors: vec![
                door(5.0, 2.0, (0, 1)),
                door(12.0, 2.0, (0, 2)),
                door(8.0, 0.0, (0, 3)),
                door(20.0, 1.0, (0, 4)),
            ],
        }
    }

    fn told(named: &NamedRooms<'_>, corners: &[(f64, f64)]) -> Vec<String> {
        let mut points = Vec::new();
        for pair in corners.windows(2) {
            let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
            let num = (dx.hypot(dy) / 0.5).ceil() as usize;
            let share = |step: usize| step as f64 / num as f64;
            points
                .extend((0..num).map(|s| Point2::new(pair[0].0 + share(s) * dx, pair[0].1 + share(s) * dy)));
        }
        let mut travel_m = vec![0.0];
        for pair in points.windows(2) {
            travel_m.push(travel_m[travel_m.len() - 1] + pair[0].distance(&pair[1]));
        }
        let passages = Passages::on_way(named, &points, &travel_m);
        (0..points.len()).filter_map(|idx| passages.door_after(idx)).map(|door| door.text.clone()).collect()
    }

    #[test]
    fn doors_are_counted_on_the_side_on_which_they_are() {
        let floor = floor();
        let mut named = NamedRooms { rooms: Some(&floor), names: BTreeMap::new() };
        let second = [(0.5, 1.0), (12.0, 1.0), (12.0, 5.0)];
        assert_eq!(told(&named, &second), ["through the second door on the left into the room"]);
        let right = [(0.5, 1.0), (8.0, 1.0), (8.0, -3.0)];
        assert_eq!(told(&named, &right), ["through the first door on the right into the room"]);
        named.names.insert(2, "Kitchen".into());
        let back = [(19.0, 1.0), (12.0, 1.0), (12.0, 5.0)];
        assert_eq!(told(&named, &back), ["through the first door on the right into Kitchen"]);
        let ahead = [(0.5, 1.0), (25.0, 1.0)];
        assert_eq!(told(&named, &ahead), ["through the door ahead into the hall"]);
        let out = [(12.0, 3.5), (12.0, 1.0), (18.0, 1.0)];
        assert_eq!(told(&named, &out), ["through the door into the corridor"]);
    }

    #[test]
    fn a_way_that_only_touches_a_room_stays_where_it_is() {
        let floor = floor();
        let named = NamedRooms { rooms: Some(&floor), names: BTreeMap::new() };
        assert!(told(&named, &[(0.5, 1.8), (4.9, 1.8), (5.0, 2.1), (5.3, 1.8), (10.0, 1.8)]).is_empty());
        assert!(told(&NamedRooms::default(), &[(0.5, 1.0), (25.0, 1.0)]).is_empty());
    }
}
