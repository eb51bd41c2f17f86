//! The local map as Algorithm 2.2 is printed: a loop over all cells with an arc tangent and a square root each.

use std::collections::{HashMap, HashSet};

use locution_engine::geometry::{Pose2, wrap_angle};
use locution_engine::grid::{Cell, LocalMapConfig};
use locution_engine::scan::ScanGeometry;

/// Directions this near to the edge between two beams, in beams, may belong to either.
const TIE_BEAMS: f64 = 1e-4;

/// The map of Algorithm 2.2, one hash table of cells.
pub struct LiteralMap {
    config: LocalMapConfig,
    geometry: ScanGeometry,
    occupancies: HashMap<Cell, u8>,
    /// Cells that once lay on the edge between two beams.
    pub ties: HashSet<Cell>,
}

impl LiteralMap {
    /// A map of which nothing is known.
    pub fn new(config: &LocalMapConfig, geometry: &ScanGeometry) -> Self {
        let (config, geometry) = (config.clone(), geometry.clone());
        Self { config, geometry, occupancies: HashMap::new(), ties: HashSet::new() }
    }

    /// Occupancy of a cell.
    pub fn occupancy(&self, cell: Cell) -> u8 {
        self.occupancies.get(&cell).copied().unwrap_or(self.config.initial)
    }

    /// Updates the map with a scan taken at a pose.
    pub fn integrate_scan(&mut self, ranges_m: &[f32], map_from_robot: &Pose2) {
        let resolution = self.config.resolution_m;
        let map_from_laser = map_from_robot.compose(&self.geometry.robot_from_laser);
        let robot = Cell::containing(&map_from_robot.position(), resolution);
        let laser = Cell::containing(&map_from_laser.position(), resolution);
        let reach = self.config.radius_cells().ceil() as i32;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                if (dx, dy) != (0, 0) {
                    self.update_cell(laser.offset(dx, dy), (dx, dy), map_from_laser.theta, ranges_m);
                }
            }
        }
        self.free_footprint(robot, laser);
        let radius = self.config.radius_cells();
        let distance = |cell: &Cell| f64::from(cell.x - robot.x).hypot(f64::from(cell.y - robot.y));
        self.occupancies.retain(|cell, _| distance(cell) <= radius);
        self.ties.retain(|cell| distance(cell) <= radius);
    }

    fn update_cell(&mut self, cell: Cell, (dx, dy): (i32, i32), heading: f64, ranges_m: &[f32]) {
        let (config, geometry) = (&self.config, &self.geometry);
        let radius = config.radius_cells();
        let distance = f64::from(dx).hypot(f64::from(dy));
        if distance > radius {
            return;
        }
        let direction = f64::from(dy).atan2(f64::from(dx)) - heading;
        let off_beam = |beam: usize| wrap_angle(direction - geometry.beam_angle_rad(beam)).abs();
        let increment = geometry.angle_increment_rad.abs();
        // Where a sweep of more than a turn looks twice, the first beam counts.
        let beam =
            (0..geometry.num_ranges).min_by_key(|&beam| (off_beam(beam) * 1e9).round() as i64).unwrap();
        if (off_beam(beam) / increment - 0.5).abs() < TIE_BEAMS {
            self.ties.insert(cell);
        }
        if off_beam(beam) > increment / 2.0 || ranges_m[beam] <= 0.0 {
            return;
        }
        let is_return = geometry.is_return(ranges_m[beam]);
        let range = if is_return { f64::from(ranges_m[beam]) } else { geometry.range_max_m };
        let range = range / config.resolution_m;
        let tolerance = if is_return { config.hit_tolerance_cells } else { 0.0 };
        let occupancy = self.occupancy(cell);
        if is_return && (distance - range).abs() < tolerance && distance < radius {
            self.occupancies.insert(cell, (occupancy + config.hit_increment).min(15));
        } else if distance < range - tolerance {
            self.occupancies.insert(cell, occupancy.saturating_sub(config.free_decrement));
        }
    }

    fn free_footprint(&mut self, robot: Cell, laser: Cell) {
        let radius = self.config.robot_radius_m / self.config.resolution_m;
        let steps = (laser.x - robot.x).abs().max((laser.y - robot.y).abs()).max(1);
        for step in 0..=steps {
            let along = |from: i32, to: i32| {
                from + (f64::from(to - from) * f64::from(step) / f64::from(steps)).round() as i32
            };
            let center = Cell::new(along(robot.x, laser.x), along(robot.y, laser.y));
            for dy in -5i32..=5 {
                for dx in -5i32..=5 {
                    if f64::from(dx).hypot(f64::from(dy)) <= radius {
                        self.occupancies.insert(center.offset(dx, dy), 0);
                    }
                }
            }
        }
    }
}
