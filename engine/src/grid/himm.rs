//! The update rule of the local map (thesis Algorithm 2.2, SPEC 3.1).

use std::f64::consts::TAU;

use super::field_of_view::{SECTOR_WIDTH, SECTORS_PER_QUADRANT, ViewCell, to_turns};
use super::{Cell, LocalMap, LocalMapConfig};
use crate::geometry::Pose2;
use crate::scan::ScanGeometry;

/// Squared distances, in cells, at which the cells of one beam change their meaning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct BeamLimits {
    /// Cells below this lie before the reading.
    free_end: u32,
    /// Cells from here...
    hit_begin: u32,
    /// ...and below this lie around it.
    hit_end: u32,
}

impl BeamLimits {
    fn reach(&self) -> u32 {
        self.free_end.max(self.hit_end)
    }
}

/// The laser with its beams in counter-clockwise order.
#[derive(Clone, Debug)]
pub(super) struct Laser {
    pub geometry: ScanGeometry,
    /// Beams that fit a full turn, in 2⁻¹⁶ beams.
    beams_per_turn: u64,
    /// Limits of every beam that fits a full turn; those the laser has not stay zero.
    limits: Vec<BeamLimits>,
}

impl Laser {
    pub fn new(geometry: &ScanGeometry, _config: &LocalMapConfig) -> Self {
        let beams_per_turn = (TAU / geometry.angle_increment_rad.abs() * 65_536.0).round() as u64;
        let num_slots = (beams_per_turn >> 16) as usize + 2;
        let limits = vec![BeamLimits::default(); num_slots.max(geometry.num_ranges)];
        Self { geometry: geometry.clone(), beams_per_turn, limits }
    }

    /// The first edge of the field of view in the map, 2⁻³² turns.
    fn first_edge(&self, map_from_laser: &Pose2) -> u32 {
        let increment = self.geometry.angle_increment_rad;
        let first = if increment > 0.0 {
            self.geometry.angle_min_rad
        } else {
            self.geometry.beam_angle_rad(self.geometry.num_ranges.saturating_sub(1))
        };
        to_turns(map_from_laser.theta + first - increment.abs() / 2.0)
    }

    /// The beam whose sector holds a direction counted from the first edge.
    fn beam_at(&self, from_first_edge: u32) -> usize {
        ((u64::from(from_first_edge) * self.beams_per_turn) >> 48) as usize
    }

    fn set_limits(&mut self, ranges_m: &[f32], config: &LocalMapConfig) {
        let num_ranges = self.geometry.num_ranges;
        for beam in 0..num_ranges {
            let index = if self.geometry.angle_increment_rad > 0.0 { beam } else { num_ranges - 1 - beam };
            self.limits[beam] = ranges_m
                .get(index)
                .map(|&range_m| limits_of(range_m, &self.geometry, config))
                .unwrap_or_default();
        }
    }
}

/// What a reading says about the cells of its beam.
fn limits_of(range_m: f32, geometry: &ScanGeometry, config: &LocalMapConfig) -> BeamLimits {
    let radius = config.radius_cells();
    let radius_end = (radius * radius).floor() as u32 + 1;
    if range_m <= 0.0 {
        // A reading of nothing is a fault of the sensor; it says neither free nor occupied.
        return BeamLimits::default();
    }
    if !geometry.is_return(range_m) {
        let cleared = geometry.range_max_m / config.resolution_m;
        let free_end = if cleared > radius { radius_end } else { (cleared * cleared).ceil() as u32 };
        return BeamLimits { free_end, ..BeamLimits::default() };
    }
    let range = f64::from(range_m) / config.resolution_m;
    let (near, far) = (range - config.hit_tolerance_cells, range + config.hit_tolerance_cells);
    if near > radius {
        return BeamLimits { free_end: radius_end, ..BeamLimits::default() };
    }
    let near_squared = near.max(0.0).powi(2);
    BeamLimits {
        free_end: near_squared.ceil() as u32,
        hit_begin: if near < 0.0 { 0 } else { near_squared.floor() as u32 + 1 },
        hit_end: (far * far).ceil().min((radius * radius).ceil()) as u32,
    }
}

impl LocalMap {
    /// Updates the map with a scan taken at a pose (Algorithm 2.2).
    ///
    /// Every cell in the field of view learns from the nearest beam: before the reading it becomes less occupied,
    /// around it more. A reading without return clears up to the smaller of the sensor's maximum and the radius.
    /// The floor under the robot is free. Cost: proportional to the cells before the readings.
    pub fn integrate_scan(&mut self, ranges_m: &[f32], map_from_robot: &Pose2) {
        let map_from_laser = map_from_robot.compose(&self.laser.geometry.robot_from_laser);
        let robot = Cell::containing(&map_from_robot.position(), self.config.resolution_m);
        let laser = Cell::containing(&map_from_laser.position(), self.config.resolution_m);
        self.move_to(robot);
        self.laser.set_limits(ranges_m, &self.config);
        self.mark_seen(laser, self.laser.first_edge(&map_from_laser));
        if laser != robot {
            self.unmark_beyond_radius(laser, robot);
        }
        self.apply_seen();
        for cell in self.cells_to_laser(map_from_robot, laser) {
            self.stamp_footprint(cell);
        }
    }

    fn unmark_beyond_radius(&mut self, laser: Cell, robot: Cell) {
        for (start, len) in self.outside(laser, robot) {
            super::local_map::for_each_word(start, len, self.index_mask(), |word, mask| {
                self.seen_free[word] &= !mask;
                self.seen_hit[word] &= !mask;
            });
        }
    }

    /// Collects the cells before and around the readings, seen from the laser's cell.
    fn mark_seen(&mut self, laser_cell: Cell, first_edge: u32) {
        let (base, index_mask, side) = (self.index(laser_cell) as i32, self.index_mask(), self.side());
        let (laser, seen_free, seen_hit) = (&self.laser, &mut self.seen_free, &mut self.seen_hit);
        // A quarter turn maps (dx, dy) to (−dy, dx); on the helix a column counts 1 and a row counts `side`.
        for (quadrant, (per_dx, per_dy)) in
            [(1, side), (side, -1), (-1, -side), (-side, 1)].into_iter().enumerate()
        {
            let quadrant_angle = (quadrant as u32) << 30;
            for sector in 0..SECTORS_PER_QUADRANT {
                let from_edge = (quadrant_angle + sector as u32 * SECTOR_WIDTH).wrapping_sub(first_edge);
                let (first_beam, last_beam) =
                    (laser.beam_at(from_edge), laser.beam_at(from_edge.wrapping_add(SECTOR_WIDTH - 1)));
                let reach = reach_of_beams(&laser.limits, first_beam, last_beam);
                let mut mark = |cell: &ViewCell, limits: &BeamLimits| {
                    let offset = i32::from(cell.dx) * per_dx + i32::from(cell.dy) * per_dy;
                    let index = base.wrapping_add(offset) as usize & index_mask;
                    let squared = u32::from(cell.squared);
                    if squared < limits.free_end {
                        seen_free[index >> 6] |= 1 << (index & 63);
                    } else if squared >= limits.hit_begin && squared < limits.hit_end {
                        seen_hit[index >> 6] |= 1 << (index & 63);
                    }
                };
                for cell in self.view.sector(sector) {
                    if u32::from(cell.squared) >= reach {
                        break;
                    }
                    let from_edge = (quadrant_angle + cell.angle).wrapping_sub(first_edge);
                    mark(cell, &laser.limits[laser.beam_at(from_edge)]);
                }
            }
        }
    }
}

/// The farthest reach of the beams that a sector touches; a sector may straddle the first edge.
fn reach_of_beams(limits: &[BeamLimits], first: usize, last: usize) -> u32 {
    let farthest = |beams: &[BeamLimits]| beams.iter().map(BeamLimits::reach).max().unwrap_or(0);
    if first <= last {
        farthest(&limits[first..=last])
    } else {
        farthest(&limits[first..]).max(farthest(&limits[..=last]))
    }
}
