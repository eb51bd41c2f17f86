//! The map a robot is looked for in: free, occupied and unknown cells.

use serde::{Deserialize, Serialize};

use super::TiledOccupancy;
use crate::geometry::Point2;
use crate::grid::{Cell, LocalMap};

/// What is known of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CellState {
    /// Never seen, or seen both ways.
    #[default]
    Unknown,
    /// Nothing stands there.
    Free,
    /// Something stands there.
    Occupied,
}

/// An occupancy grid, axis-parallel; rows run along y from the lower left corner, as `nav_msgs/OccupancyGrid` has it.
#[derive(Clone, Debug, PartialEq)]
pub struct GridMap {
    width: usize,
    height: usize,
    resolution_m: f64,
    origin: Point2,
    cells: Vec<CellState>,
}

impl GridMap {
    /// A map of `width` columns; None when the cells do not fill whole rows, the map is empty or the resolution is
    /// not a positive number.
    pub fn new(width: usize, resolution_m: f64, origin: Point2, cells: Vec<CellState>) -> Option<Self> {
        let is_whole = width > 0 && !cells.is_empty() && cells.len().is_multiple_of(width);
        let is_usable =
            resolution_m.is_finite() && resolution_m > 0.0 && origin.x.is_finite() && origin.y.is_finite();
        (is_whole && is_usable).then(|| Self {
            width,
            height: cells.len() / width,
            resolution_m,
            origin,
            cells,
        })
    }

    /// A map of `width × height` unknown cells; sides of zero become one.
    pub fn unknown(width: usize, height: usize, resolution_m: f64, origin: Point2) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        Self { width, height, resolution_m, origin, cells: vec![CellState::Unknown; width * height] }
    }

    /// The rectangle of the cells that scans have seen; None when they saw none.
    pub fn of_occupancy(occupancy: &TiledOccupancy) -> Option<Self> {
        let bounds = occupancy.bounds()?;
        let width = bounds.width();
        let mut cells = vec![CellState::Unknown; width * bounds.height()];
        for ((column, row), counts) in occupancy.seen_cells() {
            let (column, row) = ((column - bounds.low.0) as usize, (row - bounds.low.1) as usize);
            cells[row * width + column] = match occupancy.is_occupied(counts) {
                None => CellState::Unknown,
                Some(false) => CellState::Free,
                Some(true) => CellState::Occupied,
            };
        }
        let corner = |index: i32| f64::from(index) * occupancy.resolution_m();
        let origin = Point2::new(corner(bounds.low.0), corner(bounds.low.1));
        Self::new(width, occupancy.resolution_m(), origin, cells)
    }

    /// What a robot's local map knows within `radius_m` of the robot, in the frame of that map; None before the first
    /// scan.
    pub fn around_robot(local_map: &LocalMap, radius_m: f64) -> Option<Self> {
        let robot = local_map.robot_cell()?;
        let resolution_m = local_map.resolution_m();
        let reach = (radius_m / resolution_m).ceil() as i32;
        let side = 2 * reach + 1;
        let corner = Cell { x: robot.x - reach, y: robot.y - reach };
        let origin = Point2::new(f64::from(corner.x) * resolution_m, f64::from(corner.y) * resolution_m);
        let state = |cell: i32| {
            let cell = Cell { x: corner.x + cell % side, y: corner.y + cell / side };
            match (local_map.is_free(cell), local_map.is_occupied(cell)) {
                (true, _) => CellState::Free,
                (false, true) => CellState::Occupied,
                (false, false) => CellState::Unknown,
            }
        };
        Self::new(side as usize, resolution_m, origin, (0..side * side).map(state).collect())
    }

    /// Columns.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Edge of a cell in metres.
    pub const fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Lower left corner of the lower left cell, metres.
    pub const fn origin(&self) -> Point2 {
        self.origin
    }

    /// All cells, row by row from the lower left.
    pub fn cells(&self) -> &[CellState] {
        &self.cells
    }

    /// State of a cell; whatever lies outside is unknown.
    pub fn state(&self, column: i64, row: i64) -> CellState {
        match self.index(column, row) {
            Some(index) => self.cells[index],
            None => CellState::Unknown,
        }
    }

    /// Says what is known of a cell; cells outside are ignored.
    pub fn set(&mut self, column: i64, row: i64, state: CellState) {
        if let Some(index) = self.index(column, row) {
            self.cells[index] = state;
        }
    }

    /// Column and row of the cell that holds a point, which may lie outside the map.
    pub fn cell_at(&self, point: &Point2) -> (i64, i64) {
        let column = ((point.x - self.origin.x) / self.resolution_m).floor();
        let row = ((point.y - self.origin.y) / self.resolution_m).floor();
        (column as i64, row as i64)
    }

    /// Centre of a cell, metres.
    pub fn center_of(&self, column: i64, row: i64) -> Point2 {
        Point2::new(
            self.origin.x + (column as f64 + 0.5) * self.resolution_m,
            self.origin.y + (row as f64 + 0.5) * self.resolution_m,
        )
    }

    /// Number of free cells.
    pub fn num_free(&self) -> usize {
        self.cells.iter().filter(|&&state| state == CellState::Free).count()
    }

    /// The same with cells of twice the edge: a wall stays a wall, and what is known of a part is known.
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut halved = Self::unknown(width, height, 2.0 * self.resolution_m, self.origin);
        for (index, &state) in self.cells.iter().enumerate() {
            let known = &mut halved.cells[index / self.width / 2 * width + index % self.width / 2];
            if state == CellState::Occupied || *known == CellState::Unknown {
                *known = state;
            }
        }
        halved
    }

    /// The cells that a rectangle of the map's frame touches, as far as there are any.
    pub fn window(&self, low: &Point2, high: &Point2) -> Option<Self> {
        let inside = |cell: i64, num: usize| cell.clamp(0, num as i64 - 1);
        let ((left, bottom), (right, top)) = (self.cell_at(low), self.cell_at(high));
        let is_beside = right < 0
            || top < 0
            || left >= self.width as i64
            || bottom >= self.height as i64
            || right < left
            || top < bottom;
        if is_beside {
            return None;
        }
        let (left, right) = (inside(left, self.width), inside(right, self.width));
        let (bottom, top) = (inside(bottom, self.height), inside(top, self.height));
        let width = (right - left + 1) as usize;
        let rows = (bottom as usize..=top as usize).map(|row| row * self.width + left as usize);
        let cells = rows.flat_map(|first| &self.cells[first..first + width]).copied().collect();
        let corner = Point2::new(
            self.origin.x + left as f64 * self.resolution_m,
            self.origin.y + bottom as f64 * self.resolution_m,
        );
        Self::new(width, self.resolution_m, corner, cells)
    }

    fn index(&self, column: i64, row: i64) -> Option<usize> {
        let is_inside = column >= 0 && row >= 0 && column < self.width as i64 && row < self.height as i64;
        is_inside.then(|| row as usize * self.width + column as usize)
    }
}

impl GridMap {
    /// A map drawn as text, top row first: `.` free, `#` occupied, anything else unknown.
    pub fn drawn(rows: &[&str], resolution_m: f64) -> Self {
        let mut map = Self::unknown(rows[0].chars().count(), rows.len(), resolution_m, Point2::default());
        for (from_top, row) in rows.iter().enumerate() {
            for (column, symbol) in row.chars().enumerate() {
                let state = match symbol {
                    '.' => CellState::Free,
                    '#' => CellState::Occupied,
                    _ => CellState::Unknown,
                };
                map.set(column as i64, (rows.len() - 1 - from_top) as i64, state);
            }
        }
        map
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::occupancy::OccupancyConfig;
    use crate::scan::ScanGeometry;

    #[test]
    fn a_window_holds_the_cells_that_it_touches() {
        let map = GridMap::drawn(&["#...", ".#..", "..#."], 0.5);
        let window = map.window(&Point2::new(0.6, 0.2), &Point2::new(1.4, 0.9)).unwrap();
        assert_eq!(window, {
            let mut expected = GridMap::drawn(&["#.", ".#"], 0.5);
            expected.origin = Point2::new(0.5, 0.0);
            expected
        });
        assert_eq!(map.window(&Point2::new(-9.0, -9.0), &Point2::new(9.0, 9.0)).unwrap(), map);
        assert_eq!(map.window(&Point2::new(5.0, 0.0), &Point2::new(6.0, 1.0)), None);
        assert_eq!(map.window(&Point2::new(1.0, 1.0), &Point2::new(-1.0, 0.0)), None);
    }

    #[test]
    fn cells_and_points_agree() {
        let map = GridMap::unknown(4, 3, 0.5, Point2::new(-1.0, 2.0));
        assert_eq!(map.cell_at(&Point2::new(-0.9, 2.1)), (0, 0));
        assert_eq!(map.cell_at(&Point2::new(-1.1, 2.6)), (-1, 1));
        assert_eq!(map.cell_at(&map.center_of(3, 2)), (3, 2));
        assert_eq!(map.state(-1, 1), CellState::Unknown);
    }

    #[test]
    fn drawings_have_their_last_row_at_the_bottom() {
        let map = GridMap::drawn(&["..", "#?"], 1.0);
        assert_eq!(map.state(0, 0), CellState::Occupied);
        assert_eq!(map.state(1, 0), CellState::Unknown);
        assert_eq!(map.num_free(), 2);
    }

    #[test]
    fn half_as_many_cells_keep_walls() {
        let map = GridMap::drawn(&["?..", "?#.", "?..", "??."], 0.5).halved();
        assert_eq!((map.width(), map.height(), map.resolution_m()), (2, 2, 1.0));
        assert_eq!(map.state(0, 1), CellState::Occupied);
        assert_eq!(map.state(0, 0), CellState::Free);
        assert_eq!(map.state(1, 0), CellState::Free);
    }

    #[test]
    fn ragged_cells_are_refused() {
        assert!(GridMap::new(3, 0.1, Point2::default(), vec![CellState::Free; 7]).is_none());
        assert!(GridMap::new(3, 0.0, Point2::default(), vec![CellState::Free; 6]).is_none());
        assert!(GridMap::new(3, 0.1, Point2::default(), vec![CellState::Free; 6]).is_some());
    }

    #[test]
    fn a_drawn_grid_is_the_rectangle_of_seen_cells() {
        use CellState::{Free, Occupied, Unknown};
        let config = OccupancyConfig { resolution_m: 1.0, ..OccupancyConfig::default() };
        let mut occupancy = TiledOccupancy::new(config).unwrap();
        let geometry = ScanGeometry {
            num_ranges: 4,
            angle_min_rad: 0.0,
            angle_increment_rad: std::f64::consts::FRAC_PI_2,
            range_max_m: 50.0,
            robot_from_laser: Pose2::identity(),
        };
        occupancy.add_scan(&geometry, &[3.0, 2.0, 1.0, 1.0], &Pose2::new(0.5, 0.5, 0.0));
        let map = GridMap::of_occupancy(&occupancy).unwrap();
        assert_eq!((map.width(), map.height(), map.origin()), (5, 4, Point2::new(-1.0, -1.0)));
        #[rustfmt::skip]
        let from_below = [
            Unknown,  Occupied, Unknown, Unknown,  Unknown,
            Occupied, Free,     Free,    Free,     Occupied,
            Unknown,  Free,     Unknown, Unknown,  Unknown,
            Unknown,  Occupied, Unknown, Unknown,  Unknown,
        ];
        assert_eq!(map.cells(), from_below);
    }
}
