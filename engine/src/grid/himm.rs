//! The update rule of the local map (thesis Algorithm 2.2, SPEC 3.1).
//!
//! The cells that a scan frees and those it hits are collected as bits first and applied to 64 cells at a time. In a
//! sector of the view, the nearest cells are freed by whatever beams meet it; only for the cells about the readings is
//! the beam looked up.

use std::f64::consts::TAU;

use super::field_of_view::{NUM_SECTORS, SECTOR_WIDTH, to_turns};
use super::local_map::for_each_word;
use super::{Cell, LocalMap, LocalMapConfig};
use crate::geometry::Pose2;
use crate::scan::ScanGeometry;

/// Squared distances, in cells, at which the cells of one beam change their meaning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct BeamLimits {
    /// Cells below this lie before the reading.
    free_end: u32,
    /// Cells from here, not before `free_end`, lie around it...
    hit_begin: u32,
    /// ...over this many squared distances.
    hit_width: u32,
    /// Cells from here on are not touched.
    reach: u32,
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
    pub fn new(geometry: &ScanGeometry) -> Self {
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

    /// Sectors that the field of view touches, from the one that holds its first edge.
    fn num_sectors(&self) -> usize {
        let view = ((self.geometry.num_ranges as u64) << 48) / self.beams_per_turn;
        ((view / u64::from(SECTOR_WIDTH)) as usize + 2).min(NUM_SECTORS)
    }

    fn set_limits(&mut self, ranges_m: &[f32], config: &LocalMapConfig) {
        let scale = RangeScale::new(&self.geometry, config);
        let beams = &mut self.limits[..self.geometry.num_ranges];
        // Readings that the scan does not have say nothing.
        beams.fill(BeamLimits::default());
        for (limits, &range_m) in beams.iter_mut().zip(ranges_m) {
            *limits = scale.limits_of(range_m);
        }
        if self.geometry.angle_increment_rad < 0.0 {
            beams.reverse();
        }
    }
}

/// Turns readings into limits in cells.
struct RangeScale {
    range_max_m: f64,
    resolution_m: f64,
    hit_tolerance: f64,
    radius: f64,
    /// What a reading from beyond the radius says.
    all_free: BeamLimits,
    /// What a beam without return says.
    no_return: BeamLimits,
}

impl RangeScale {
    fn new(geometry: &ScanGeometry, config: &LocalMapConfig) -> Self {
        let free_within = |free_end: u32| BeamLimits { free_end, reach: free_end, ..BeamLimits::default() };
        let radius = config.radius_cells();
        let all_free = free_within((radius * radius) as u32 + 1);
        let cleared = geometry.range_max_m / config.resolution_m;
        let no_return = if cleared > radius { all_free } else { free_within(rounded_up(cleared * cleared)) };
        let (range_max_m, resolution_m) = (geometry.range_max_m, config.resolution_m);
        Self {
            range_max_m,
            resolution_m,
            hit_tolerance: config.hit_tolerance_cells,
            radius,
            all_free,
            no_return,
        }
    }

    /// What a reading says about the cells of its beam.
    fn limits_of(&self, range_m: f32) -> BeamLimits {
        if range_m <= 0.0 {
            // A reading of nothing is a fault of the sensor; it says neither free nor occupied.
            return BeamLimits::default();
        }
        let is_return = range_m.is_finite() && f64::from(range_m) < self.range_max_m;
        if !is_return {
            return self.no_return;
        }
        let range = f64::from(range_m) / self.resolution_m;
        let (near, far) = ((range - self.hit_tolerance).max(0.0), range + self.hit_tolerance);
        if near > self.radius {
            return self.all_free;
        }
        let free_end = rounded_up(near * near);
        let hit_end = rounded_up((far * far).min(self.radius * self.radius));
        let hit_begin = if range < self.hit_tolerance { 0 } else { (near * near) as u32 + 1 };
        let hit_width = hit_end.saturating_sub(hit_begin);
        BeamLimits { free_end, hit_begin, hit_width, reach: free_end.max(hit_end) }
    }
}

/// The smallest integer not below a number that is not negative.
fn rounded_up(number: f64) -> u32 {
    let below = number as u32;
    below + u32::from(f64::from(below) < number)
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
        let mut seen = self.cells_seen(laser, self.laser.first_edge(&map_from_laser));
        if laser != robot {
            self.unmark_beyond_radius(&mut seen, laser, robot);
        }
        self.apply(&seen);
        for cell in cells_between(robot, laser) {
            self.stamp_footprint(cell);
        }
    }

    fn unmark_beyond_radius(&self, seen: &mut [Seen], laser: Cell, robot: Cell) {
        for (start, len) in self.outside(laser, robot) {
            for_each_word(start, len, self.index_mask(), |word, mask| {
                seen[word][FREE] &= !mask;
                seen[word][HIT] &= !mask;
            });
        }
    }

    /// Collects the cells before and around the readings, seen from the laser's cell.
    fn cells_seen(&self, laser_cell: Cell, first_edge: u32) -> Vec<Seen> {
        // Made anew for each scan: kept, it would be a good part of what an open run weighs.
        let mut seen = vec![[0; 2]; self.num_words()];
        let (base, index_mask) = (self.index(laser_cell) as i32, self.index_mask());
        let first_sector = (first_edge / SECTOR_WIDTH) as usize;
        for sector in
            (first_sector..first_sector + self.laser.num_sectors()).map(|sector| sector % NUM_SECTORS)
        {
            let from_edge = (sector as u32).wrapping_mul(SECTOR_WIDTH).wrapping_sub(first_edge);
            let beams =
                (self.laser.beam_at(from_edge), self.laser.beam_at(from_edge.wrapping_add(SECTOR_WIDTH - 1)));
            let (free_for_all, reach) = common_limits(&self.laser.limits, beams);
            let num_free = self.view.num_nearer(sector, free_for_all);
            let (cells, offsets, sign) = self.view.sector(sector);
            let bit_of = |offset: i32| base.wrapping_add(offset * sign) as usize & index_mask;
            let mut free = |offset: i32| {
                let bit = bit_of(offset);
                seen[bit >> 6][FREE] |= 1 << (bit & 63);
            };
            // The near half beside the far one: neighbours share words, and each write would wait for the last.
            let (near, far) = offsets[..num_free].split_at(num_free / 2);
            near.iter().zip(far).for_each(|(&near, &far)| {
                free(near);
                free(far);
            });
            far[near.len()..].iter().for_each(|&offset| free(offset));
            let others = cells[num_free..].iter().zip(&offsets[num_free..]);
            for (cell, &offset) in others.take_while(|(cell, _)| u32::from(cell.squared) < reach) {
                let (bit, squared) = (bit_of(offset), u32::from(cell.squared));
                let beam = self.laser.beam_at(from_edge.wrapping_add(cell.angle_in_sector()));
                let limits = &self.laser.limits[beam];
                // Without branches, as nothing foretells the outcome about a reading.
                let is_free = squared < limits.free_end;
                let is_hit = squared.wrapping_sub(limits.hit_begin) < limits.hit_width;
                let seen = &mut seen[bit >> 6];
                seen[FREE] |= u64::from(is_free) << (bit & 63);
                seen[HIT] |= u64::from(is_hit) << (bit & 63);
            }
        }
        seen
    }
}

/// Which of 64 cells of the map's helix the scan at hand found free ([`FREE`]), and hit ([`HIT`]).
pub(super) type Seen = [u64; 2];

/// Cells before the readings.
pub(super) const FREE: usize = 0;
/// Cells around the readings.
pub(super) const HIT: usize = 1;

/// What all beams of a sector free, and how far the farthest goes; a sector may straddle the first edge.
fn common_limits(limits: &[BeamLimits], (first, last): (usize, usize)) -> (u32, u32) {
    let fold = |beams: &[BeamLimits], start: (u32, u32)| {
        beams.iter().fold(start, |(free, reach), beam| (free.min(beam.free_end), reach.max(beam.reach)))
    };
    if first <= last {
        fold(&limits[first..=last], (u32::MAX, 0))
    } else {
        fold(&limits[..=last], fold(&limits[first..], (u32::MAX, 0)))
    }
}

/// Cells on the straight line between two, both included.
fn cells_between(from: Cell, to: Cell) -> impl Iterator<Item = Cell> {
    let (dx, dy) = (to.x.wrapping_sub(from.x), to.y.wrapping_sub(from.y));
    let steps = dx.unsigned_abs().max(dy.unsigned_abs()) as i32;
    let part = move |delta: i32, step: i32| {
        (f64::from(delta) * f64::from(step) / f64::from(steps.max(1))).round() as i32
    };
    (0..=steps).map(move |step| from.offset(part(dx, step), part(dy, step)))
}
