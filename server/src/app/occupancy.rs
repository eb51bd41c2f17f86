//! An occupancy grid from scans at known poses, tile by tile, so that memory follows what was seen and not the
//! rectangle around it.
//!
//! Every beam passes through the cells on its way and ends in one. A cell is occupied when a good share of the beams
//! that reached it ended there, free when beams passed, unknown when none came.

use std::collections::BTreeMap;

use locution_engine::geometry::{Point2, Pose2};
use locution_engine::localization::{CellState, GridMap};
use locution_engine::scan::ScanGeometry;

/// Cells along the edge of a tile.
const TILE: i32 = 64;
/// Beams are followed no farther than this, metres: beyond, their ends are too far apart to draw walls.
const RANGE_LIMIT_M: f64 = 20.0;
/// A cell is occupied when at least this share of the beams that reached it ended in it.
const OCCUPIED_SHARE: f64 = 0.25;
/// Grids are drawn coarser rather than with more cells than this.
const NUM_CELLS_MAX: f64 = 6.4e7;

type Tile = Box<[[u16; 2]]>;

/// Counts beams by cell.
pub struct OccupancyCounter {
    resolution_m: f64,
    index: BTreeMap<(i32, i32), usize>,
    tiles: Vec<Tile>,
    // Beams stay in one tile for many cells, so the last one found is kept at hand.
    latest: ((i32, i32), usize),
}

impl OccupancyCounter {
    /// An empty counter for an area of the given size; the cells are coarser than asked for when there would be too
    /// many.
    pub fn new(resolution_m: f64, width_m: f64, height_m: f64) -> Self {
        let area_m2 = (width_m + 2.0 * RANGE_LIMIT_M) * (height_m + 2.0 * RANGE_LIMIT_M);
        let resolution_m = resolution_m.max((area_m2 / NUM_CELLS_MAX).sqrt());
        Self { resolution_m, index: BTreeMap::new(), tiles: Vec::new(), latest: ((0, 0), usize::MAX) }
    }

    /// Counts the beams of one scan.
    pub fn add(&mut self, geometry: &ScanGeometry, map_from_robot: &Pose2, ranges_m: &[f32]) {
        let map_from_laser = map_from_robot.compose(&geometry.robot_from_laser);
        let from = self.cell_of(&map_from_laser.position());
        for (beam_idx, &range_m) in ranges_m.iter().enumerate() {
            if !geometry.is_return(range_m) {
                continue;
            }
            let (sin, cos) = (map_from_laser.theta + geometry.beam_angle_rad(beam_idx)).sin_cos();
            let length_m = f64::from(range_m).min(RANGE_LIMIT_M);
            let end = Point2::new(map_from_laser.x + length_m * cos, map_from_laser.y + length_m * sin);
            let to = self.cell_of(&end);
            self.pass(from, to);
            if f64::from(range_m) <= RANGE_LIMIT_M {
                self.count(to, 1);
            }
        }
    }

    /// The grid around everything counted; `None` when nothing was.
    pub fn finish(self) -> Option<GridMap> {
        let min = (self.index.keys().map(|key| key.0).min()?, self.index.keys().map(|key| key.1).min()?);
        let max = (self.index.keys().map(|key| key.0).max()?, self.index.keys().map(|key| key.1).max()?);
        let (width, height) = (((max.0 - min.0 + 1) * TILE) as usize, ((max.1 - min.1 + 1) * TILE) as usize);
        let origin = Point2::new(
            f64::from(min.0 * TILE) * self.resolution_m,
            f64::from(min.1 * TILE) * self.resolution_m,
        );
        let mut cells = vec![CellState::Unknown; width * height];
        for ((tile_x, tile_y), tile_idx) in &self.index {
            let (left, bottom) = (((tile_x - min.0) * TILE) as usize, ((tile_y - min.1) * TILE) as usize);
            for (row, counts) in self.tiles[*tile_idx].chunks(TILE as usize).enumerate() {
                let start = (bottom + row) * width + left;
                for (cell, counts) in cells[start..].iter_mut().zip(counts) {
                    *cell = state_of(*counts);
                }
            }
        }
        GridMap::new(width, self.resolution_m, origin, cells)
    }

    fn cell_of(&self, point: &Point2) -> (i32, i32) {
        ((point.x / self.resolution_m).floor() as i32, (point.y / self.resolution_m).floor() as i32)
    }

    /// Counts a passing beam in every cell from one to another, the last one left out (Bresenham).
    fn pass(&mut self, from: (i32, i32), to: (i32, i32)) {
        let (dx, dy) = ((to.0 - from.0).abs(), -(to.1 - from.1).abs());
        let (step_x, step_y) = ((to.0 - from.0).signum(), (to.1 - from.1).signum());
        let (mut x, mut y) = from;
        let mut error = dx + dy;
        while (x, y) != to {
            self.count((x, y), 0);
            let doubled = 2 * error;
            if doubled >= dy {
                error += dy;
                x += step_x;
            }
            if doubled <= dx {
                error += dx;
                y += step_y;
            }
        }
    }

    fn count(&mut self, cell: (i32, i32), which: usize) {
        let key = (cell.0.div_euclid(TILE), cell.1.div_euclid(TILE));
        if self.latest.0 != key || self.latest.1 == usize::MAX {
            self.latest = (key, self.tile_of(key));
        }
        let cell_idx = (cell.1.rem_euclid(TILE) * TILE + cell.0.rem_euclid(TILE)) as usize;
        let counted = &mut self.tiles[self.latest.1][cell_idx][which];
        *counted = counted.saturating_add(1);
    }
}

impl OccupancyCounter {
    fn tile_of(&mut self, key: (i32, i32)) -> usize {
        *self.index.entry(key).or_insert_with(|| {
            self.tiles.push(vec![[0; 2]; (TILE * TILE) as usize].into());
            self.tiles.len() - 1
        })
    }
}

fn state_of([passed, ended]: [u16; 2]) -> CellState {
    if ended > 0 && f64::from(ended) >= OCCUPIED_SHARE * (f64::from(ended) + f64::from(passed)) {
        CellState::Occupied
    } else if passed > 0 {
        CellState::Free
    } else {
        CellState::Unknown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_is_where_beams_end_and_the_way_there_is_free() {
        let geometry = ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -0.1,
            angle_increment_rad: 0.1,
            range_max_m: 30.0,
            robot_from_laser: Pose2::identity(),
        };
        let mut counter = OccupancyCounter::new(0.1, 1.0, 1.0);
        counter.add(&geometry, &Pose2::new(0.05, 0.05, 0.0), &[f32::NAN, 3.0, f32::NAN]);
        let map = counter.finish().unwrap();
        let state = |x: f64, y: f64| {
            let (column, row) = map.cell_at(&Point2::new(x, y));
            map.state(column, row)
        };
        assert_eq!(state(3.05, 0.05), CellState::Occupied);
        assert_eq!(state(1.55, 0.05), CellState::Free);
        assert_eq!(state(1.55, 0.55), CellState::Unknown);
        assert_eq!(state(3.45, 0.05), CellState::Unknown);
    }
}
