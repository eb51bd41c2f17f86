//! A scan as localisation keeps it: some ends of beams, and some places that beams passed through.

use super::served_map::ServedMap;
use crate::geometry::{Point2, Pose2};
use crate::occupancy::CellState;
use crate::scan::ScanGeometry;

/// Beam ends at least this far apart count as different, metres.
const END_SPACING_M: f64 = 0.12;
/// Distance between the places that stand for the free part of a beam, metres.
const PASS_SPACING_M: f64 = 0.7;
/// Free places this close to the end of their beam are left out, metres.
const PASS_CLEARANCE_M: f64 = 0.4;

/// What is kept of a scan, in the robot's frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sweep {
    /// Places where something stands.
    pub ends: Vec<Point2>,
    /// Places where nothing stands.
    pub passes: Vec<Point2>,
}

/// How a sweep fits a map at a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Agreement {
    /// Share of what the map knows that fits, in [0, 1].
    pub share: f64,
    /// Share of the sweep that lies where the map knows something, in [0, 1].
    pub coverage: f64,
}

impl Sweep {
    /// Takes at most `max_points` ends and as many passes from a scan, nothing beyond `range_max_m`.
    pub fn new(geometry: &ScanGeometry, ranges_m: &[f32], range_max_m: f64, max_points: usize) -> Self {
        let mut sweep = Self::default();
        let laser = geometry.robot_from_laser.position();
        let mut last_pass: Option<Point2> = None;
        for (_, end) in geometry.endpoints(ranges_m, f64::INFINITY) {
            let range_m = laser.distance(&end);
            let is_new = sweep.ends.last().is_none_or(|last| last.distance(&end) >= END_SPACING_M);
            if range_m <= range_max_m && is_new {
                sweep.ends.push(end);
            }
            if last_pass.is_some_and(|last| last.distance(&end) < PASS_SPACING_M) {
                continue;
            }
            last_pass = Some(end);
            let reach_m = (range_m - PASS_CLEARANCE_M).min(range_max_m);
            let num_passes = (reach_m / PASS_SPACING_M).max(0.0) as usize;
            sweep.passes.extend((1..=num_passes).map(|step| {
                let share = step as f64 * PASS_SPACING_M / range_m;
                Point2::new(laser.x + share * (end.x - laser.x), laser.y + share * (end.y - laser.y))
            }));
        }
        sweep.ends = evenly(&sweep.ends, max_points);
        sweep.passes = evenly(&sweep.passes, max_points);
        sweep
    }

    /// How well the sweep fits: ends on obstacles and passes through free space speak for the pose, ends in free space
    /// and passes through obstacles against it, and what lies in unknown space says nothing.
    pub fn agreement(&self, map: &ServedMap, map_from_robot: &Pose2) -> Agreement {
        let (mut fits, mut known) = (0.0, 0.0);
        let (sin, cos) = map_from_robot.theta.sin_cos();
        let placed = |point: &Point2| {
            Point2::new(
                map_from_robot.x + cos * point.x - sin * point.y,
                map_from_robot.y + sin * point.x + cos * point.y,
            )
        };
        for end in self.ends.iter().map(placed) {
            let code = f64::from(map.likelihood.code_at(&end)) / 255.0;
            let is_free = state_at(map, &end) == CellState::Free;
            fits += code;
            known += if is_free { 1.0 } else { code };
        }
        for pass in self.passes.iter().map(placed) {
            match state_at(map, &pass) {
                CellState::Free => (fits, known) = (fits + PASS_WEIGHT, known + PASS_WEIGHT),
                CellState::Occupied => known += 1.0,
                CellState::Unknown => {}
            }
        }
        let all = self.ends.len() as f64 + PASS_WEIGHT * self.passes.len() as f64;
        Agreement {
            share: if known > 0.0 { fits / known } else { 0.0 },
            coverage: if all > 0.0 { (known / all).min(1.0) } else { 0.0 },
        }
    }
}

/// What a free place counts beside an end: free space fits nearly everywhere inside a building.
const PASS_WEIGHT: f64 = 0.3;

fn state_at(map: &ServedMap, point: &Point2) -> CellState {
    let (column, row) = map.grid.cell_at(point);
    map.grid.state(column, row)
}

/// At most `count` of the points, evenly spread over the list.
pub(super) fn evenly(points: &[Point2], count: usize) -> Vec<Point2> {
    if points.len() <= count {
        return points.to_vec();
    }
    (0..count).map(|number| points[number * points.len() / count]).collect()
}

/// Climbs from `start` to the pose where `ends` fit best, without straying far from `start`.
///
/// `deviation` is how far the start may be off: metres and radians.
pub(super) fn climb(
    map: &ServedMap,
    ends: &[Point2],
    start: &Pose2,
    (deviation_m, deviation_rad): (f64, f64),
) -> Pose2 {
    let worth = |pose: &Pose2| {
        let strayed = (pose.distance(start) / deviation_m).powi(2)
            + (crate::geometry::wrap_angle(pose.theta - start.theta) / deviation_rad).powi(2);
        map.likelihood.mean_code(ends, pose) / 255.0 - 0.01 * strayed
    };
    let mut best = *start;
    let mut best_worth = worth(start);
    for scale in [1.0, 0.5, 0.25, 0.125] {
        let (step_m, step_rad) = (deviation_m * scale, deviation_rad * scale);
        for _ in 0..4 {
            let moves = [
                Pose2::new(step_m, 0.0, 0.0),
                Pose2::new(-step_m, 0.0, 0.0),
                Pose2::new(0.0, step_m, 0.0),
                Pose2::new(0.0, -step_m, 0.0),
                Pose2::new(0.0, 0.0, step_rad),
                Pose2::new(0.0, 0.0, -step_rad),
            ];
            let from = best;
            for candidate in moves.map(|by| from.compose(&by)) {
                let value = worth(&candidate);
                if value > best_worth {
                    (best, best_worth) = (candidate, value);
                }
            }
            if best == from {
                break;
            }
        }
    }
    best
}
