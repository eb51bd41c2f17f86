//! What kind of place each spot of a plan is, from its drawn rooms and the rule of the labelled recordings.
//!
//! The drawing says which cells belong to which room; what a room is used as stands in a table below, by its picture. In
//! corridors the labels follow from the geometry: a flood from the spot along the corridors, rooms left out, counts the
//! arms that go on beyond one and a half corridor widths, so that bifurcations and corners reach half a width beyond the
//! crossing into each arm. At the end of that reach two arms of a crossing may still hang together, and the spot is then
//! called a corner: a flaw that the weights of now have learned with.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use anyhow::Result;
use locution_engine::geometry::{Point2, distance_to_blocked};
use locution_engine::semantics::PlaceLabel;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::simulation::World;

/// Edge of a cell, metres.
const CELL_M: f64 = 0.1;
/// Smaller rooms are rooms, larger ones halls, between them people may disagree, square metres.
const ROOM_MAX_M2: f64 = 60.0;
const HALL_MIN_M2: f64 = 90.0;
/// An arm goes on for this long beyond the crossing, metres.
const ARM_M: f64 = 2.5;
/// An arm is at least this share of the corridor's width wide.
const ARM_WIDTH_SHARE: f64 = 0.6;
/// A turn with an open door so near may be called a corner or a bifurcation, metres.
const DOOR_M: f64 = 2.5;
/// A straighter way is no corner.
const CORNER_STRAIGHTNESS: f64 = 0.955;
/// Steps towards the middle of the corridor before anything is measured.
const MIDDLE_STEPS: usize = 5;

/// What the rooms of one plan are where their size does not say it.
struct Uses {
    world: &'static str,
    corridors: &'static [u32],
    halls: &'static [u32],
    /// Lobbies, anterooms and large rooms of which two people would say two things.
    unclear: &'static [u32],
}

/// By the pictures of the drawn rooms.
const USES: [Uses; 11] = [
    Uses { world: "ipa-freiburg101", corridors: &[1, 8], halls: &[], unclear: &[] },
    Uses { world: "ipa-freiburg52", corridors: &[5], halls: &[], unclear: &[] },
    Uses { world: "ipa-lab-a", corridors: &[1], halls: &[], unclear: &[] },
    Uses { world: "ipa-lab-b", corridors: &[11, 13, 14], halls: &[], unclear: &[12, 15] },
    Uses {
        world: "ipa-lab-f",
        corridors: &[12, 13, 14, 18, 20, 24, 36, 47, 53],
        halls: &[31],
        unclear: &[15, 34, 35],
    },
    Uses { world: "ipa-lab-ipa", corridors: &[2, 6, 9], halls: &[8], unclear: &[] },
    Uses { world: "ipa-nlb", corridors: &[9], halls: &[], unclear: &[8] },
    Uses { world: "ipa-office-a", corridors: &[7], halls: &[], unclear: &[] },
    Uses { world: "ipa-office-b", corridors: &[6], halls: &[], unclear: &[] },
    Uses { world: "ipa-office-c", corridors: &[17, 18], halls: &[], unclear: &[] },
    Uses { world: "ipa-office-d", corridors: &[6], halls: &[], unclear: &[] },
];

/// The labels of one plan.
pub struct PlanLabels {
    width: usize,
    height: usize,
    origin: Point2,
    /// What the room of each cell is; `Some(Corridor)` for all of a corridor.
    label: Vec<Option<PlaceLabel>>,
    /// Distance to the border of the corridors, metres; 0 outside.
    clearance_m: Vec<f32>,
    /// Half the usual width of the corridor of each cell, metres.
    half_width_m: Vec<f64>,
    /// The doors of corridors: the middles of the cells on either side.
    doors: Vec<Vec<Point2>>,
    /// Middles of the doors that are open.
    open_doors: Vec<Point2>,
    /// Labels of corridor cells already found.
    known: BTreeMap<usize, PlaceLabel>,
}

impl PlanLabels {
    /// From the numbers of the rooms, row by row from the lower left; `None` for a plan of which nothing is known.
    pub fn new(world: &str, rooms: &[u32], width: usize, resolution_m: f64, origin: Point2) -> Option<Self> {
        let uses = USES.iter().find(|uses| uses.world == world)?;
        let mut areas_m2: BTreeMap<u32, f64> = BTreeMap::new();
        for room in rooms {
            *areas_m2.entry(*room).or_default() += resolution_m * resolution_m;
        }
        let label_of = |room: u32| {
            if room == 0 || uses.unclear.contains(&room) {
                None
            } else if uses.corridors.contains(&room) {
                Some(PlaceLabel::Corridor)
            } else if uses.halls.contains(&room) || areas_m2[&room] >= HALL_MIN_M2 {
                Some(PlaceLabel::Hall)
            } else {
                (areas_m2[&room] <= ROOM_MAX_M2).then_some(PlaceLabel::DeadEnd)
            }
        };
        let height = rooms.len() / width;
        let cells = |pixels: usize| (pixels as f64 * resolution_m / CELL_M).floor() as usize;
        let (columns, rows) = (cells(width), cells(height));
        let room_at = |cell: usize| {
            let pixel = |index: usize| ((index as f64 + 0.5) * CELL_M / resolution_m) as usize;
            rooms[pixel(cell / columns) * width + pixel(cell % columns)]
        };
        let cell_rooms: Vec<u32> = (0..columns * rows).map(room_at).collect();
        let label: Vec<Option<PlaceLabel>> = cell_rooms.iter().map(|room| label_of(*room)).collect();
        let is_corridor: Vec<bool> = label.iter().map(|label| *label == Some(PlaceLabel::Corridor)).collect();
        let clearance_m: Vec<f32> = distance_to_blocked(columns, rows, &is_corridor)
            .into_iter()
            .map(|distance| distance * CELL_M as f32)
            .collect();
        let mut ridges: BTreeMap<u32, Vec<f32>> = BTreeMap::new();
        for cell in columns + 1..(columns * rows).saturating_sub(columns + 1) {
            let around = [cell - 1, cell + 1, cell - columns, cell + columns];
            if is_corridor[cell] && around.iter().all(|&other| clearance_m[other] <= clearance_m[cell]) {
                ridges.entry(cell_rooms[cell]).or_default().push(clearance_m[cell]);
            }
        }
        let half_widths: BTreeMap<u32, f64> = ridges
            .into_iter()
            .map(|(room, mut ridge)| {
                ridge.sort_by(f32::total_cmp);
                (room, f64::from(ridge[ridge.len() / 2]))
            })
            .collect();
        let half_width_m =
            cell_rooms.iter().map(|room| half_widths.get(room).copied().unwrap_or(1.0)).collect();
        let doors = doors(&cell_rooms, &label, columns, origin);
        let open_doors = doors.iter().map(|door| door[door.len() / 2]).collect();
        Some(Self {
            doors,
            open_doors,
            width: columns,
            height: rows,
            origin,
            label,
            clearance_m,
            half_width_m,
            known: BTreeMap::new(),
        })
    }

    /// The label of a position; `None` where people may disagree.
    pub fn label_at(&mut self, point: &Point2) -> Option<PlaceLabel> {
        let along = |value: f64, from: f64| ((value - from) / CELL_M).floor();
        let (column, row) = (along(point.x, self.origin.x), along(point.y, self.origin.y));
        let is_inside = column >= 0.0 && row >= 0.0 && column < self.width as f64 && row < self.height as f64;
        let cell = if is_inside { row as usize * self.width + column as usize } else { return None };
        let label = self.label[cell]?;
        if label != PlaceLabel::Corridor {
            return Some(label);
        }
        let found = match self.known.get(&cell) {
            Some(known) => *known,
            None => self.corridor_label(cell),
        };
        self.known.insert(cell, found);
        let is_unclear =
            found == PlaceLabel::Corner && self.open_doors.iter().any(|door| door.distance(point) <= DOOR_M);
        (!is_unclear).then_some(found)
    }

    /// The world with a share of the doors between corridors and other rooms shut, and these labels for it.
    ///
    /// # Errors
    /// A world that cannot be made.
    pub fn shut_doors(&mut self, world: &World, share: f64, seed: u64) -> Result<World> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (open, shut): (Vec<&Vec<Point2>>, Vec<&Vec<Point2>>) =
            self.doors.iter().partition(|_| rng.random_range(0.0..1.0) >= share);
        let (width, height) = world.size();
        let (origin, edge_m) = (world.origin(), world.resolution_m());
        let center = |cell: usize| {
            let along = |index: usize| (index as f64 + 0.5) * edge_m;
            Point2::new(origin.x + along(cell % width), origin.y + along(cell / width))
        };
        let mut is_free: Vec<bool> = (0..width * height).map(|cell| world.is_free(&center(cell))).collect();
        let reach = (CELL_M / edge_m).ceil() as i64;
        for point in shut.into_iter().flatten() {
            let cell = |value: f64, from: f64| ((value - from) / edge_m).floor() as i64;
            let (column, row) = (cell(point.x, origin.x), cell(point.y, origin.y));
            for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
                let (x, y) = (column + dx, row + dy);
                if (0..width as i64).contains(&x) && (0..height as i64).contains(&y) {
                    is_free[y as usize * width + x as usize] = false;
                }
            }
        }
        self.open_doors = open.into_iter().map(|door| door[door.len() / 2]).collect();
        Ok(World::new(width, height, edge_m, origin, is_free)?)
    }

    /// Where in the corridors of a world there is most room: a place to begin.
    pub fn widest_in(&self, world: &World) -> Option<Point2> {
        let center = |cell: usize| {
            let along = |index: usize| (index as f64 + 0.5) * CELL_M;
            Point2::new(self.origin.x + along(cell % self.width), self.origin.y + along(cell / self.width))
        };
        let corridors = (0..self.clearance_m.len()).filter(|&cell| self.clearance_m[cell] > 0.0).map(center);
        corridors.max_by(|a, b| world.clearance_m(a).total_cmp(&world.clearance_m(b)))
    }

    /// What a spot of a corridor is.
    fn corridor_label(&self, cell: usize) -> PlaceLabel {
        let half_m = self.half_width_m[cell];
        let start = self.middle(cell);
        let near_m = 3.0 * half_m;
        let far_m = near_m + ARM_M;
        let ways = self.ways(start, far_m);
        let arms = self.arms(start, &ways, near_m, far_m, ARM_WIDTH_SHARE * 2.0 * half_m);
        match arms.as_slice() {
            [a, b] => {
                let straightness = a.distance(b) / (2.0 * near_m);
                if straightness < CORNER_STRAIGHTNESS { PlaceLabel::Corner } else { PlaceLabel::Corridor }
            }
            [] | [_] => PlaceLabel::Corridor,
            _ => PlaceLabel::Bifurcation,
        }
    }

    /// A few steps from a cell towards where the corridor is widest.
    fn middle(&self, cell: usize) -> usize {
        (0..MIDDLE_STEPS).fold(cell, |here, _| {
            let widest = |best: usize, (other, _): (usize, u64)| {
                if self.clearance_m[other] > self.clearance_m[best] { other } else { best }
            };
            self.around(here).fold(here, widest)
        })
    }

    /// Lengths of the shortest ways from a cell along corridors, metres, as far as `limit_m`.
    fn ways(&self, start: usize, limit_m: f64) -> BTreeMap<usize, f64> {
        let mut ways = BTreeMap::new();
        // Hundredths of a cell, so that the heap has an order.
        let mut waiting = BinaryHeap::from([(Reverse(0u64), start)]);
        let limit = (limit_m / CELL_M * 100.0) as u64;
        while let Some((Reverse(way), cell)) = waiting.pop() {
            if ways.contains_key(&cell) {
                continue;
            }
            ways.insert(cell, way as f64 * CELL_M / 100.0);
            for (neighbor, step) in self.around(cell) {
                if self.clearance_m[neighbor] > 0.0 && way + step <= limit && !ways.contains_key(&neighbor) {
                    waiting.push((Reverse(way + step), neighbor));
                }
            }
        }
        ways
    }

    fn around(&self, cell: usize) -> impl Iterator<Item = (usize, u64)> + use<> {
        let (width, height) = (self.width as i64, self.height as i64);
        let (column, row) = ((cell % self.width) as i64, (cell / self.width) as i64);
        (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (dx, dy))).filter_map(
            move |(dx, dy): (i64, i64)| {
                let (x, y) = (column + dx, row + dy);
                let is_cell = (dx, dy) != (0, 0) && (0..width).contains(&x) && (0..height).contains(&y);
                is_cell.then(|| ((y * width + x) as usize, if dx != 0 && dy != 0 { 141 } else { 100 }))
            },
        )
    }

    /// Where, relative to the start, the arms begin that span the ring and are wide enough.
    fn arms(
        &self,
        start: usize,
        ways: &BTreeMap<usize, f64>,
        near_m: f64,
        far_m: f64,
        width_m: f64,
    ) -> Vec<Point2> {
        let mut left: BTreeMap<usize, f64> =
            ways.iter().filter(|(_, way)| **way >= near_m).map(|(cell, way)| (*cell, *way)).collect();
        let mut arms = Vec::new();
        while let Some((first, way)) = left.pop_first() {
            let mut group = vec![(first, way)];
            let mut next = 0;
            while let Some(&(cell, _)) = group.get(next) {
                next += 1;
                for (neighbor, _) in self.around(cell) {
                    if let Some(way) = left.remove(&neighbor) {
                        group.push((neighbor, way));
                    }
                }
            }
            let reaches_far = group.iter().any(|(_, way)| *way >= far_m - 1.5 * CELL_M);
            let surface_m2 = group.len() as f64 * CELL_M * CELL_M;
            if !reaches_far || surface_m2 < width_m * (far_m - near_m) {
                continue;
            }
            let beginning =
                group.iter().filter(|(_, way)| *way <= near_m + 1.5 * CELL_M).map(|(cell, _)| *cell);
            let middle = beginning
                .max_by(|a, b| self.clearance_m[*a].total_cmp(&self.clearance_m[*b]))
                .unwrap_or(first);
            let along = |of: fn(usize, usize) -> usize| {
                (of(middle, self.width) as f64 - of(start, self.width) as f64) * CELL_M
            };
            arms.push(Point2::new(along(|cell, width| cell % width), along(|cell, width| cell / width)));
        }
        arms
    }
}

/// Groups of cells along which a corridor touches a room, by room; halls and what is unclear stand open.
fn doors(rooms: &[u32], label: &[Option<PlaceLabel>], width: usize, origin: Point2) -> Vec<Vec<Point2>> {
    let mut touching: BTreeSet<(u32, usize)> = BTreeSet::new();
    for cell in 0..rooms.len().saturating_sub(width) {
        for beside in [cell + 1, cell + width] {
            match (label[cell], label[beside]) {
                (Some(PlaceLabel::Corridor), Some(PlaceLabel::DeadEnd)) => {
                    touching.insert((rooms[beside], cell))
                }
                (Some(PlaceLabel::DeadEnd), Some(PlaceLabel::Corridor)) => {
                    touching.insert((rooms[cell], cell))
                }
                _ => false,
            };
        }
    }
    let mut doors = Vec::new();
    while let Some((room, first)) = touching.pop_first() {
        let mut group = vec![first];
        let mut next = 0;
        while let Some(&cell) = group.get(next) {
            next += 1;
            for (down, left) in (0..5).flat_map(|down| (0..5).map(move |left| (down, left))) {
                let around = (cell + 2 * width + 2).checked_sub(down * width + left);
                group.extend(around.filter(|&other| touching.remove(&(room, other))));
            }
        }
        let middle = |cell: usize| {
            let along = |index: usize| (index as f64 + 0.5) * CELL_M;
            Point2::new(origin.x + along(cell % width), origin.y + along(cell / width))
        };
        doors.push(group.into_iter().map(middle).collect());
    }
    doors
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corridor east with one north from its middle that turns west, and a room beside it; cells of a tenth of a meter.
    fn plan() -> (Vec<u32>, usize) {
        let number = |x: f64, y: f64| {
            let is_corridor = (2.0..38.0).contains(&x) && (10.0..12.0).contains(&y)
                || (19.0..21.0).contains(&x) && (10.0..32.0).contains(&y)
                || (2.0..21.0).contains(&x) && (30.0..32.0).contains(&y);
            let is_room = (30.0..35.0).contains(&x) && (5.0..10.0).contains(&y);
            if is_corridor { 5 } else { u32::from(is_room) }
        };
        let center = |index: usize| (index as f64 + 0.5) * 0.1;
        ((0..400 * 400).map(|cell| number(center(cell % 400), center(cell / 400))).collect(), 400)
    }

    #[test]
    fn crossings_and_turns_reach_into_their_arms() {
        let (rooms, width) = plan();
        let mut labels = PlanLabels::new("ipa-freiburg52", &rooms, width, 0.1, Point2::default()).unwrap();
        let mut at = |x, y| labels.label_at(&Point2::new(x, y));
        assert_eq!(at(20.0, 11.0), Some(PlaceLabel::Bifurcation));
        assert_eq!(at(19.0, 11.0), Some(PlaceLabel::Bifurcation));
        assert_eq!(at(16.0, 11.0), Some(PlaceLabel::Corridor));
        assert_eq!(at(20.0, 31.0), Some(PlaceLabel::Corner));
        assert_eq!(at(18.5, 31.0), Some(PlaceLabel::Corner));
        assert_eq!(at(15.0, 31.0), Some(PlaceLabel::Corridor));
        assert_eq!(at(32.0, 7.0), Some(PlaceLabel::DeadEnd));
        assert_eq!(at(5.0, 20.0), None);
    }

    #[test]
    fn shut_doors_are_wall() {
        let (rooms, width) = plan();
        let is_free = rooms.iter().map(|room| *room != 0).collect();
        let world = World::new(width, 400, 0.1, Point2::default(), is_free).unwrap();
        let mut labels = PlanLabels::new("ipa-freiburg52", &rooms, width, 0.1, Point2::default()).unwrap();
        let door = Point2::new(32.5, 9.95);
        assert!(labels.shut_doors(&world, 0.0, 1).unwrap().is_free(&door));
        let shut = labels.shut_doors(&world, 1.0, 1).unwrap();
        assert!(!shut.is_free(&door) && shut.is_free(&Point2::new(32.0, 7.0)));
        assert!(labels.widest_in(&shut).is_some_and(|start| (10.0..32.0).contains(&start.y)));
    }
}
