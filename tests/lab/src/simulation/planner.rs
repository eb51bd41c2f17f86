//! Ways through a building: shortest paths that would rather keep some distance from the walls.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use thiserror::Error;

use super::world::World;
use locution_engine::geometry::Point2;

/// Cells of the planning grid are at least this large; finer plans would only cost time.
const PLANNING_CELL_M: f64 = 0.1;

/// A task that cannot be driven.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlanError {
    /// A robot does not fit there.
    #[error("({x:.2}, {y:.2}) is not on free floor, or too near a wall for the robot")]
    Blocked {
        /// Metres.
        x: f64,
        /// Metres.
        y: f64,
    },
    /// No way leads there.
    #[error("no way leads from ({from_x:.2}, {from_y:.2}) to ({x:.2}, {y:.2})")]
    Unreachable {
        /// Metres.
        from_x: f64,
        /// Metres.
        from_y: f64,
        /// Metres.
        x: f64,
        /// Metres.
        y: f64,
    },
}

/// A planning grid over a world: where a robot of some radius fits, and how much it likes to be there.
#[derive(Clone, Debug)]
pub struct Planner {
    width: usize,
    height: usize,
    cell_m: f64,
    origin: Point2,
    clearance_m: Vec<f32>,
    robot_radius_m: f64,
}

/// Shortest ways from one place to everywhere.
#[derive(Clone, Debug)]
pub(super) struct WaysFrom {
    start: Point2,
    parent: Vec<u32>,
}

const UNREACHED: u32 = u32::MAX;

impl Planner {
    /// Lays the grid over the world.
    pub fn new(world: &World, robot_radius_m: f64) -> Self {
        let cell_m = world.resolution_m().max(PLANNING_CELL_M);
        let (columns, rows) = world.size();
        let along = |cells: usize| ((cells as f64 * world.resolution_m() / cell_m).ceil() as usize).max(1);
        let (width, height) = (along(columns), along(rows));
        let mut planner =
            Self { width, height, cell_m, origin: world.origin(), clearance_m: Vec::new(), robot_radius_m };
        planner.clearance_m =
            (0..width * height).map(|cell| world.clearance_m(&planner.center(cell)) as f32).collect();
        planner
    }

    pub(super) fn center(&self, cell: usize) -> Point2 {
        let along = |from: f64, cells: usize| from + (cells as f64 + 0.5) * self.cell_m;
        Point2::new(along(self.origin.x, cell % self.width), along(self.origin.y, cell / self.width))
    }

    /// The cell of a point where the robot fits; the nearest such cell within half a metre when it does not.
    fn standing_cell(&self, point: &Point2) -> Result<usize, PlanError> {
        let reach = (0.5 / self.cell_m).ceil() as i64;
        let column = ((point.x - self.origin.x) / self.cell_m).floor() as i64;
        let row = ((point.y - self.origin.y) / self.cell_m).floor() as i64;
        let nearby = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (column + dx, row + dy)));
        nearby
            .filter_map(|(column, row)| {
                let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
                (column < self.width && row < self.height).then_some(row * self.width + column)
            })
            .filter(|&cell| self.fits(cell))
            .map(|cell| (self.center(cell).distance(point), cell))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, cell)| cell)
            .ok_or(PlanError::Blocked { x: point.x, y: point.y })
    }

    pub(super) fn fits(&self, cell: usize) -> bool {
        f64::from(self.clearance_m[cell]) > self.robot_radius_m
    }

    /// Cells where a robot fits.
    pub(super) fn standing_cells(&self) -> Vec<usize> {
        (0..self.clearance_m.len()).filter(|&cell| self.fits(cell)).collect()
    }

    /// Shortest ways to everywhere (Dijkstra on eight neighbours); a metre costs up to four times as much where
    /// walls are nearer than `comfort_m`.
    ///
    /// # Errors
    /// The robot does not fit at the start.
    pub(super) fn ways_from(&self, start: &Point2, comfort_m: f64) -> Result<WaysFrom, PlanError> {
        let first = self.standing_cell(start)?;
        let mut cost = vec![f32::INFINITY; self.clearance_m.len()];
        let mut parent = vec![UNREACHED; self.clearance_m.len()];
        // Costs of positive floats order like their bits, and the cell breaks ties.
        let mut queue = BinaryHeap::from([Reverse((0u32, first as u32))]);
        cost[first] = 0.0;
        parent[first] = first as u32;
        while let Some(Reverse((bits, cell))) = queue.pop() {
            let cell = cell as usize;
            if f32::from_bits(bits) > cost[cell] {
                continue;
            }
            for (neighbor, length_m) in self.neighbors(cell) {
                let crowding = (1.0 - f64::from(self.clearance_m[neighbor]) / comfort_m).max(0.0);
                let reached = cost[cell] + (length_m * (1.0 + 3.0 * crowding)) as f32;
                if reached < cost[neighbor] {
                    cost[neighbor] = reached;
                    parent[neighbor] = cell as u32;
                    queue.push(Reverse((reached.to_bits(), neighbor as u32)));
                }
            }
        }
        Ok(WaysFrom { start: *start, parent })
    }

    fn neighbors(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (column, row) = ((cell % self.width) as i64, (cell / self.width) as i64);
        let around = (-1..=1i64).flat_map(|dy| (-1..=1i64).map(move |dx| (dx, dy)));
        around.filter(|&step| step != (0, 0)).filter_map(move |(dx, dy)| {
            let (column, row) = (usize::try_from(column + dx).ok()?, usize::try_from(row + dy).ok()?);
            let neighbor = row * self.width + column;
            let exists = column < self.width && row < self.height;
            (exists && self.fits(neighbor))
                .then(|| (neighbor, self.cell_m * ((dx * dx + dy * dy) as f64).sqrt()))
        })
    }

    /// The way to a place, as points about a cell apart, its end included.
    ///
    /// # Errors
    /// The robot does not fit there, or no way leads there.
    pub(super) fn way_to(&self, ways: &WaysFrom, goal: &Point2) -> Result<Vec<Point2>, PlanError> {
        let mut cell = self.standing_cell(goal)?;
        if ways.parent[cell] == UNREACHED {
            let Point2 { x: from_x, y: from_y } = ways.start;
            return Err(PlanError::Unreachable { from_x, from_y, x: goal.x, y: goal.y });
        }
        let mut way = vec![self.center(cell)];
        while ways.parent[cell] as usize != cell {
            cell = ways.parent[cell] as usize;
            way.push(self.center(cell));
        }
        way.reverse();
        Ok(way)
    }
}

impl WaysFrom {
    /// Whether a way leads to the cell.
    pub(super) fn reaches(&self, cell: usize) -> bool {
        self.parent[cell] != UNREACHED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO_ROOMS: &str = "
        ##############
        #....#.......#
        #....#.......#
        #............#
        #....#.......#
        ##############
        #............#
        #............#
        ##############";

    #[test]
    fn ways_go_through_doors_and_keep_clear_of_walls() {
        let world = World::drawn(TWO_ROOMS);
        let planner = Planner::new(&world, 0.2);
        let ways = planner.ways_from(&Point2::new(1.0, 4.0), 0.6).unwrap();
        let way = planner.way_to(&ways, &Point2::new(6.0, 4.0)).unwrap();
        assert!(way.iter().all(|point| world.clearance_m(point) > 0.2));
        let length_m: f64 = way.windows(2).map(|pair| pair[0].distance(&pair[1])).sum();
        assert!(way.iter().any(|point| point.distance(&Point2::new(2.75, 2.75)) < 0.3), "through the door");
        assert!((5.0..7.5).contains(&length_m), "{length_m}");
    }

    #[test]
    fn what_cannot_be_driven_is_an_error() {
        let world = World::drawn(TWO_ROOMS);
        let planner = Planner::new(&world, 0.2);
        let ways = planner.ways_from(&Point2::new(1.0, 4.0), 0.6).unwrap();
        let other_building = planner.way_to(&ways, &Point2::new(3.0, 1.0));
        assert!(matches!(other_building, Err(PlanError::Unreachable { .. })));
        assert!(matches!(planner.ways_from(&Point2::new(-5.0, 0.0), 0.6), Err(PlanError::Blocked { .. })));
    }
}
