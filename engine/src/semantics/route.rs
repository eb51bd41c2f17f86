//! Routes over driven ground, told as a person would: "along the corridor 18 m, left at the corner".

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use serde::{Deserialize, Serialize};

use super::label::PlaceLabel;
use super::passages::{NamedRooms, Passages};
use super::places::PlaceMap;
use crate::geometry::{Point2, wrap_angle};

/// Turns below this are straight on.
const STRAIGHT_RAD: f64 = 0.6;
/// Turns above this lead back.
const BACK_RAD: f64 = 2.4;
/// Directions are taken over this much of the route before and after a place, metres.
const CHORD_M: f64 = 2.0;

/// Which way a place is left, seen from how it was entered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// Hardly any turn.
    Straight,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Where one came from.
    Back,
}

impl Turn {
    /// The kind of a turn in radians, left positive.
    pub fn of(turn_rad: f64) -> Self {
        match turn_rad.abs() {
            size if size < STRAIGHT_RAD => Self::Straight,
            size if size > BACK_RAD => Self::Back,
            _ if turn_rad > 0.0 => Self::Left,
            _ => Self::Right,
        }
    }
}

/// One place on a route.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RouteStep {
    /// Number of the place.
    pub place: u32,
    /// Its label.
    pub label: PlaceLabel,
    /// Way through it, metres.
    pub length_m: f64,
    /// How it is left.
    pub turn: Turn,
    /// Id of the room in which it lies, where rooms are known.
    pub room: Option<u64>,
    /// Middle of the door through which the room is left at the end of the step.
    pub door: Option<Point2>,
    /// What a person would say.
    pub text: String,
}

/// A way from one position to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// Metres.
    pub length_m: f64,
    /// Positions on the way.
    pub points: Vec<Point2>,
    /// Places on the way, in order.
    pub steps: Vec<RouteStep>,
    /// The steps in one sentence.
    pub description: String,
}

/// The shortest way over driven ground between the spots nearest to two positions (Dijkstra); `None` when no way
/// is known or a position is farther than `reach_m` from any driven ground. A step ends where a place or a room ends.
pub fn route(
    map: &PlaceMap,
    rooms: &NamedRooms<'_>,
    from: &Point2,
    to: &Point2,
    reach_m: f64,
) -> Option<Route> {
    let start = nearest(map, from, reach_m)?;
    let goal = nearest(map, to, reach_m)?;
    let path = shortest_path(map, start, goal)?;
    let points: Vec<Point2> = path.iter().map(|&spot| map.spots[spot].position).collect();
    let mut travel_m = vec![0.0];
    for pair in points.windows(2) {
        travel_m.push(travel_m[travel_m.len() - 1] + pair[0].distance(&pair[1]));
    }
    let passages = Passages::on_way(rooms, &points, &travel_m);
    let place_of = |idx: usize| map.spots[path[idx]].place;
    let mut steps: Vec<RouteStep> = Vec::new();
    let mut first = 0;
    for last in 0..path.len() {
        let place = place_of(first);
        let door = passages.door_after(last);
        if last + 1 < path.len() && place_of(last + 1) == place && door.is_none() {
            continue;
        }
        let label = map.places[place as usize].label;
        // The way across a border belongs half to either side.
        let begin_m = if first == 0 { 0.0 } else { (travel_m[first - 1] + travel_m[first]) / 2.0 };
        let end_m = travel_m.get(last + 1).map_or(travel_m[last], |next| (travel_m[last] + next) / 2.0);
        let turn = Turn::of(turn_between(&points, &travel_m, first, last));
        let length_m = end_m - begin_m;
        let is_end = last + 1 == path.len();
        let is_entered = steps.last().is_some_and(|step| step.door.is_some());
        let room = passages.room_at(last);
        let mut text = match room.filter(|_| is_end && is_entered) {
            Some(room) => format!("{} m into {}", length_m.round().max(1.0), rooms.name_of(room)),
            None => phrase(label, length_m, turn, first == 0, is_end),
        };
        if let Some(door) = door {
            text = format!("{text}, {}", door.text);
        }
        let door = door.map(|door| door.position);
        steps.push(RouteStep { place, label, length_m, turn, room, door, text });
        first = last + 1;
    }
    let description = steps.iter().map(|step| step.text.as_str()).collect::<Vec<_>>().join(", ");
    Some(Route { length_m: travel_m[travel_m.len() - 1], points, steps, description })
}

fn phrase(label: PlaceLabel, length_m: f64, turn: Turn, is_start: bool, is_end: bool) -> String {
    let meters = length_m.round().max(1.0);
    let way = match turn {
        Turn::Straight => "straight on",
        Turn::Left => "left",
        Turn::Right => "right",
        Turn::Back => "back",
    };
    match label {
        PlaceLabel::Corridor => format!("along the corridor {meters} m"),
        PlaceLabel::Hall if !is_end => format!("{way} through the hall {meters} m"),
        PlaceLabel::DeadEnd if is_end => "into the room".into(),
        PlaceLabel::DeadEnd if is_start => "out of the room".into(),
        PlaceLabel::DeadEnd => format!("through the room {meters} m"),
        _ if is_end => format!("to the {label}"),
        _ if is_start => format!("from the {label}"),
        _ => format!("{way} at the {label}"),
    }
}

fn nearest(map: &PlaceMap, to: &Point2, reach_m: f64) -> Option<usize> {
    let distance = |spot: usize| map.spots[spot].position.distance(to);
    (0..map.spots.len())
        .filter(|&spot| distance(spot) <= reach_m)
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
}

/// Spots from start to goal; lengths are compared in whole tenths of millimetres, ties by number.
fn shortest_path(map: &PlaceMap, start: usize, goal: usize) -> Option<Vec<usize>> {
    let mut best: Vec<u64> = vec![u64::MAX; map.spots.len()];
    let mut came_from: Vec<usize> = vec![usize::MAX; map.spots.len()];
    let mut waiting = BinaryHeap::from([(Reverse(0), Reverse(start))]);
    best[start] = 0;
    while let Some((Reverse(so_far), Reverse(spot))) = waiting.pop() {
        if spot == goal {
            break;
        }
        if so_far > best[spot] {
            continue;
        }
        for &next in &map.spots[spot].neighbors {
            let next = next as usize;
            let step_m = map.spots[spot].position.distance(&map.spots[next].position);
            let total = so_far + (step_m * 1e4) as u64;
            if total < best[next] {
                best[next] = total;
                came_from[next] = spot;
                waiting.push((Reverse(total), Reverse(next)));
            }
        }
    }
    if best[goal] == u64::MAX {
        return None;
    }
    let mut path = vec![goal];
    while path[path.len() - 1] != start {
        path.push(came_from[path[path.len() - 1]]);
    }
    path.reverse();
    Some(path)
}

/// From the direction in which a stretch of the route is entered to that in which it is left.
fn turn_between(points: &[Point2], travel_m: &[f64], first: usize, last: usize) -> f64 {
    let before = travel_m.partition_point(|&travel| travel < travel_m[first] - CHORD_M);
    let after = travel_m.partition_point(|&travel| travel <= travel_m[last] + CHORD_M) - 1;
    let direction = |from: usize, to: usize| {
        let (dx, dy) = (points[to].x - points[from].x, points[to].y - points[from].y);
        (dx.hypot(dy) > 1e-6).then(|| dy.atan2(dx))
    };
    match (direction(before, first), direction(last, after)) {
        (Some(entering), Some(leaving)) => wrap_angle(leaving - entering),
        _ => 0.0,
    }
}
