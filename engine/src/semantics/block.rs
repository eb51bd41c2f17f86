//! What the scans of a map tell about one square block of it: where is free space, how wide is it, where did robots
//! drive.
//!
//! A map may be large, so it is looked at block by block; a block carries a margin in which the passages that leave
//! its core can be followed.

use super::config::SemanticsConfig;
use crate::geometry::{Point2, Pose2, distance_to_blocked};
use crate::scan::ScanGeometry;

/// Counts of hits and misses, while scans are added.
pub(super) struct BlockEvidence<'a> {
    config: &'a SemanticsConfig,
    lower_left: Point2,
    side: usize,
    hits: Vec<u16>,
    misses: Vec<u16>,
    /// The last scan that missed the cell, from 1: a scan counts once a cell, however many of its beams cross it.
    missed_by: Vec<u32>,
    num_scans: u32,
    is_driven: Vec<bool>,
}

/// Free space of a block, its clearance and where robots drove.
pub(super) struct Block {
    pub resolution_m: f64,
    lower_left: Point2,
    /// Cells along an edge.
    pub side: usize,
    /// Distance to the nearest cell that is not free, metres.
    pub clearance_m: Vec<f32>,
    /// Within half a robot's width of a driven path.
    pub is_driven: Vec<bool>,
}

impl<'a> BlockEvidence<'a> {
    /// Nothing known of the square of edge `edge_m` whose lower left corner is given.
    pub(super) fn new(config: &'a SemanticsConfig, lower_left: Point2, edge_m: f64) -> Self {
        let side = (edge_m / config.resolution_m).ceil().max(1.0) as usize;
        let num_cells = side * side;
        Self {
            config,
            lower_left,
            side,
            hits: vec![0; num_cells],
            misses: vec![0; num_cells],
            missed_by: vec![0; num_cells],
            num_scans: 0,
            is_driven: vec![false; num_cells],
        }
    }

    fn index(&self, x: f64, y: f64) -> Option<usize> {
        cell_index(x, y, &self.lower_left, self.config.resolution_m, self.side)
    }

    /// Adds what one scan saw. Readings without a return say nothing: glass and dark walls give none either.
    pub(super) fn add_scan(&mut self, geometry: &ScanGeometry, map_from_robot: &Pose2, ranges_m: &[f32]) {
        self.num_scans += 1;
        let reach_m = self.config.sight_m;
        let step_m = self.config.resolution_m / 2.0;
        let map_from_laser = map_from_robot.compose(&geometry.robot_from_laser);
        for (beam_idx, &range_m) in ranges_m.iter().enumerate() {
            if !geometry.is_return(range_m) {
                continue;
            }
            let range = f64::from(range_m);
            let (sin, cos) = (map_from_laser.theta + geometry.beam_angle_rad(beam_idx)).sin_cos();
            let num_steps = ((range.min(reach_m) - step_m) / step_m).max(0.0) as usize;
            for step in 0..num_steps {
                let along = step as f64 * step_m;
                let Some(index) = self.index(map_from_laser.x + cos * along, map_from_laser.y + sin * along)
                else {
                    continue;
                };
                if self.missed_by[index] != self.num_scans {
                    self.missed_by[index] = self.num_scans;
                    self.misses[index] = self.misses[index].saturating_add(1);
                }
            }
            if range < reach_m
                && let Some(index) =
                    self.index(map_from_laser.x + cos * range, map_from_laser.y + sin * range)
            {
                self.hits[index] = self.hits[index].saturating_add(1);
            }
        }
    }

    /// Adds a position where a robot was: it fitted there, whatever scans say.
    pub(super) fn add_driven(&mut self, position: &Point2) {
        let radius_m = self.config.driven_radius_m;
        let resolution_m = self.config.resolution_m;
        let reach = (radius_m / resolution_m).ceil() as i64;
        // Whole cells around the robot's own: adding metres would skip a row of cells when it stands on a border.
        let cell = |meters: f64| (meters / resolution_m + BORDER_SHARE).floor() as i64;
        let (column, row) = (cell(position.x - self.lower_left.x), cell(position.y - self.lower_left.y));
        let side = self.side as i64;
        for (up, right) in (-reach..=reach).flat_map(|up| (-reach..=reach).map(move |right| (up, right))) {
            let (x, y) = (column + right, row + up);
            let is_near = (right as f64).hypot(up as f64) * resolution_m <= radius_m + BORDER_SHARE;
            if is_near && (0..side).contains(&x) && (0..side).contains(&y) {
                self.is_driven[(y * side + x) as usize] = true;
            }
        }
    }

    /// The block as known from all scans.
    pub(super) fn finish(self) -> Block {
        let config = self.config;
        let mut is_free: Vec<bool> = self
            .hits
            .iter()
            .zip(&self.misses)
            .map(|(&hits, &misses)| {
                let seen = f64::from(hits) + f64::from(misses);
                let is_occupied = hits >= 2 && f64::from(hits) > config.occupied_share * seen;
                seen >= 2.0 && !is_occupied
            })
            .collect();
        fill_specks(&mut is_free, self.side, config.speck_cells);
        let clearance_m = distance_to_blocked(self.side, self.side, &is_free)
            .into_iter()
            .map(|cells| cells * config.resolution_m as f32)
            .collect();
        Block {
            resolution_m: config.resolution_m,
            lower_left: self.lower_left,
            side: self.side,
            clearance_m,
            is_driven: self.is_driven,
        }
    }
}

impl Block {
    /// Index of the cell that holds a point, if the block does.
    pub(super) fn index(&self, point: &Point2) -> Option<usize> {
        cell_index(point.x, point.y, &self.lower_left, self.resolution_m, self.side)
    }

    /// Column and row of a cell.
    pub(super) fn column_row(&self, index: usize) -> (usize, usize) {
        (index % self.side, index / self.side)
    }

    /// Cells whose column and row differ by at most `reach` from those of `index`.
    pub(super) fn square(&self, index: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let (column, row) = self.column_row(index);
        let side = self.side;
        let columns = column.saturating_sub(reach)..(column + reach + 1).min(side);
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(side);
        rows.flat_map(move |row| columns.clone().map(move |column| row * side + column))
    }

    /// Distance between the centres of two cells, metres.
    pub(super) fn distance_m(&self, a: usize, b: usize) -> f64 {
        let ((ax, ay), (bx, by)) = (self.column_row(a), self.column_row(b));
        (ax as f64 - bx as f64).hypot(ay as f64 - by as f64) * self.resolution_m
    }
}

/// Share of a cell by which a point short of a cell's border stands on it: sums of metres round either way.
const BORDER_SHARE: f64 = 1e-6;

fn cell_index(x: f64, y: f64, lower_left: &Point2, resolution_m: f64, side: usize) -> Option<usize> {
    let column = ((x - lower_left.x) / resolution_m + BORDER_SHARE).floor();
    let row = ((y - lower_left.y) / resolution_m + BORDER_SHARE).floor();
    let is_inside = column >= 0.0 && row >= 0.0 && column < side as f64 && row < side as f64;
    is_inside.then(|| row as usize * side + column as usize)
}

/// Makes groups of at most `max_cells` cells that are not free free: legs of chairs and of people, single wrong
/// readings. Groups hang together over edges.
fn fill_specks(is_free: &mut [bool], side: usize, max_cells: usize) {
    let mut is_done = vec![false; is_free.len()];
    let mut group = Vec::new();
    for start in 0..is_free.len() {
        if is_free[start] || is_done[start] {
            continue;
        }
        group.clear();
        group.push(start);
        is_done[start] = true;
        let mut next = 0;
        while let Some(&index) = group.get(next) {
            next += 1;
            let (column, row) = (index % side, index / side);
            let neighbors = [
                (column > 0).then(|| index - 1),
                (column + 1 < side).then_some(index + 1),
                (row > 0).then(|| index - side),
                (row + 1 < side).then_some(index + side),
            ];
            for neighbor in neighbors.into_iter().flatten() {
                if !is_free[neighbor] && !is_done[neighbor] {
                    is_done[neighbor] = true;
                    group.push(neighbor);
                }
            }
        }
        if group.len() <= max_cells {
            for &index in &group {
                is_free[index] = true;
            }
        }
    }
}
