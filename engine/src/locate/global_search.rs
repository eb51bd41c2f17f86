//! Where in the whole map could this neighbourhood lie? Branch and bound over all poses (after Olson 2015 and Hess et
//! al. 2016).
//!
//! Headings are tried one by one; for each, squares of positions are bounded from above by a pyramid of maxima of the
//! likelihood field and split, the most promising first. So poses come out in the order of their score, and every pose
//! that is not reported scores less than the last one that is.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::likelihood_field::LikelihoodField;
use crate::config_error::ConfigError;
use crate::geometry::{Point2, Pose2, angle_between};
use crate::occupancy::{CellState, GridMap};

/// Effort and outcome of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GlobalSearchConfig {
    /// Headings tried.
    pub num_headings: usize,
    /// Poses reported at most.
    pub max_poses: usize,
    /// Poses that score less than this share of the best one are not reported.
    pub min_share_of_best: f64,
    /// Poses that score less than this are not reported; 1 is a perfect fit.
    pub min_score: f64,
    /// Two poses closer than this, metres …
    pub separation_m: f64,
    /// … and than this, radians, are one.
    pub separation_rad: f64,
    /// Squares that may be looked at; what is found until then is reported.
    pub max_squares: usize,
}

impl Default for GlobalSearchConfig {
    fn default() -> Self {
        Self {
            num_headings: 240,
            max_poses: 40,
            min_share_of_best: 0.75,
            min_score: 0.4,
            separation_m: 0.8,
            separation_rad: 0.3,
            max_squares: 1_000_000,
        }
    }
}

impl GlobalSearchConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(8..=3600).contains(&self.num_headings) {
            return Err(ConfigError::new(format!("{path}.num_headings"), "must lie in 8..=3600"));
        }
        if self.max_poses == 0 || self.max_squares == 0 {
            return Err(ConfigError::new(format!("{path}.max_poses"), "and max_squares must be above 0"));
        }
        for (name, value) in [("min_share_of_best", self.min_share_of_best), ("min_score", self.min_score)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must lie in 0..=1"));
            }
        }
        if !(self.separation_m > 0.0 && self.separation_rad > 0.0) {
            return Err(ConfigError::new(
                format!("{path}.separation_m"),
                "and separation_rad must be above 0",
            ));
        }
        Ok(())
    }
}

/// Levels above the finest; the largest squares have 2^5 cells a side.
const NUM_LEVELS: usize = 6;

/// Points farther than this from the robot are not searched with, metres: the map has so wide a margin of nothing.
pub const SEARCH_REACH_MAX_M: f64 = 20.0;

/// Maxima of a likelihood field over squares that start at every cell, for squares of 1, 2, 4 … cells a side.
///
/// A margin around the map spares every look the question whether it falls outside.
#[derive(Clone, Debug)]
pub struct SearchPyramid {
    /// Columns and rows with the margin.
    width: usize,
    height: usize,
    /// Cells of the margin on every side.
    margin: usize,
    cell_m: f64,
    /// Lower left corner of the margin.
    origin: Point2,
    /// Best likelihood code in the square.
    codes: Vec<Vec<u8>>,
    /// Whether a robot can stand in the square.
    free: Vec<Vec<bool>>,
}

impl SearchPyramid {
    /// The pyramid of a map, on cells of about 0.2 m. Cost: linear in cells times levels.
    pub fn build(grid: &GridMap, likelihood: &LikelihoodField) -> Self {
        let merge = ((0.2 / grid.resolution_m()).round() as usize).max(1);
        let cell_m = grid.resolution_m() * merge as f64;
        let margin = (SEARCH_REACH_MAX_M / cell_m).ceil() as usize + 1;
        let side = |num_cells: usize| num_cells.div_ceil(merge) + 2 * margin;
        let (width, height) = (side(grid.width()), side(grid.height()));
        let mut codes = vec![0u8; width * height];
        let mut free = vec![false; width * height];
        for row in 0..grid.height() {
            for column in 0..grid.width() {
                let cell = (row / merge + margin) * width + column / merge + margin;
                let (x, y) = (column as i64, row as i64);
                codes[cell] = codes[cell].max(likelihood.code_at(&grid.center_of(x, y)));
                free[cell] |= grid.state(x, y) == CellState::Free;
            }
        }
        let margin_m = margin as f64 * cell_m;
        let mut pyramid = Self {
            width,
            height,
            margin,
            cell_m,
            origin: Point2::new(grid.origin().x - margin_m, grid.origin().y - margin_m),
            codes: vec![codes],
            free: vec![free],
        };
        for level in 1..NUM_LEVELS {
            let step = 1 << (level - 1);
            let codes = doubled(&pyramid.codes[level - 1], width, step, u8::max);
            let free = doubled(&pyramid.free[level - 1], width, step, |a, b| a | b);
            pyramid.codes.push(codes);
            pyramid.free.push(free);
        }
        pyramid
    }

    /// Poses at which `points`, given in the robot's frame, lie on obstacles of the map and the robot on free space,
    /// best first.
    pub fn search(&self, points: &[Point2], config: &GlobalSearchConfig) -> Vec<ScoredPose> {
        let is_near = |point: &&Point2| point.x.hypot(point.y) <= SEARCH_REACH_MAX_M;
        let points: Vec<Point2> = points.iter().filter(is_near).copied().collect();
        if points.is_empty() {
            return Vec::new();
        }
        let headings: Vec<f64> =
            (0..config.num_headings).map(|k| k as f64 * TAU / config.num_headings as f64).collect();
        let turned: Vec<Vec<isize>> = headings.iter().map(|&heading| self.turned(&points, heading)).collect();
        let best_sum = 255.0 * points.len() as f64;
        let sum_min = (config.min_score * best_sum).ceil() as u32;
        let mut open = self.roots(&turned, points.len(), sum_min);
        let mut num_squares = open.len();
        let mut found: Vec<ScoredPose> = Vec::new();
        while let Some(square) = open.pop() {
            let score = f64::from(square.sum) / best_sum;
            let best = found.first().map_or(0.0, |first| first.score);
            if score < best * config.min_share_of_best
                || found.len() >= config.max_poses
                || num_squares > config.max_squares
            {
                break;
            }
            let pose = self.pose_of(&square, headings[square.heading as usize]);
            if self.is_covered(&square, &pose, &found, config) {
                continue;
            }
            if square.level == 0 {
                found.push(ScoredPose { map_from_robot: pose, score });
                continue;
            }
            let level = square.level as usize - 1;
            let side = 1usize << level;
            for (dx, dy) in [(0, 0), (side, 0), (0, side), (side, side)] {
                let corner = (square.x as usize + dx, square.y as usize + dy);
                if !self.holds_robot(level, corner) {
                    continue;
                }
                num_squares += 1;
                let child = self.square(level, corner, square.heading, &turned[square.heading as usize]);
                if child.sum >= sum_min {
                    open.push(child);
                }
            }
        }
        found
    }

    /// Points of the robot's frame after a turn, as steps from the robot's cell in the rows of cells.
    fn turned(&self, points: &[Point2], heading: f64) -> Vec<isize> {
        let (sin, cos) = heading.sin_cos();
        let cell = |meters: f64| (meters / self.cell_m).round() as isize;
        let step =
            |p: &Point2| cell(sin * p.x + cos * p.y) * self.width as isize + cell(cos * p.x - sin * p.y);
        points.iter().map(step).collect()
    }

    /// Whether a robot can stand in the square from a corner on; squares that begin in the margin are not searched.
    fn holds_robot(&self, level: usize, (x, y): (usize, usize)) -> bool {
        x + self.margin < self.width && y + self.margin < self.height && self.free[level][y * self.width + x]
    }

    /// All squares of the coarsest level in which a robot can stand and which are not bounded too low.
    fn roots(&self, turned: &[Vec<isize>], num_points: usize, sum_min: u32) -> OpenSquares {
        let level = NUM_LEVELS - 1;
        let side = 1usize << level;
        let mut roots = OpenSquares::new(num_points);
        let rows = (self.margin..self.height - self.margin).step_by(side);
        let corners =
            rows.flat_map(|y| (self.margin..self.width - self.margin).step_by(side).map(move |x| (x, y)));
        for corner in corners.filter(|&corner| self.holds_robot(level, corner)) {
            for (heading, steps) in turned.iter().enumerate() {
                let square = self.square(level, corner, heading as u32, steps);
                if square.sum >= sum_min {
                    roots.push(square);
                }
            }
        }
        roots
    }

    /// A square with the sum of the best codes that its positions could give.
    fn square(&self, level: usize, (x, y): (usize, usize), heading: u32, steps: &[isize]) -> Square {
        let codes = &self.codes[level];
        let corner = y * self.width + x;
        // The margin is as wide as points are far, so that every step ends on a cell.
        let sum = steps.iter().map(|&step| u32::from(codes[corner.wrapping_add_signed(step)])).sum();
        Square { sum, level: level as u8, x: x as u32, y: y as u32, heading }
    }

    /// Middle of a square, as a pose.
    fn pose_of(&self, square: &Square, heading: f64) -> Pose2 {
        let middle = |cell: u32| (f64::from(cell) + f64::from(1u32 << square.level) / 2.0) * self.cell_m;
        Pose2::new(self.origin.x + middle(square.x), self.origin.y + middle(square.y), heading)
    }

    /// True when every position of the square is too close to a pose already found.
    fn is_covered(
        &self,
        square: &Square,
        pose: &Pose2,
        found: &[ScoredPose],
        config: &GlobalSearchConfig,
    ) -> bool {
        let radius_m = f64::from(1u32 << square.level) * self.cell_m * std::f64::consts::FRAC_1_SQRT_2;
        found.iter().any(|other| {
            pose.distance(&other.map_from_robot) + radius_m < config.separation_m + self.cell_m
                && angle_between(pose.theta, other.map_from_robot.theta) < config.separation_rad
        })
    }
}

/// Combines squares of a level into squares of twice the side.
fn doubled<T: Copy>(finer: &[T], width: usize, step: usize, combine: impl Fn(T, T) -> T) -> Vec<T> {
    let height = finer.len() / width;
    (0..finer.len())
        .map(|cell| {
            let (column, row) = (cell % width, cell / width);
            let (right, up) = ((column + step).min(width - 1), (row + step).min(height - 1));
            let along = |row: usize| combine(finer[row * width + column], finer[row * width + right]);
            combine(along(row), along(up))
        })
        .collect()
}

/// A pose with its score, 1 being a perfect fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScoredPose {
    /// Pose of the robot in the map.
    pub map_from_robot: Pose2,
    /// Mean likelihood of the points there, in [0, 1].
    pub score: f64,
}

/// A square of positions for one heading, with an upper bound of the summed codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Square {
    sum: u32,
    level: u8,
    x: u32,
    y: u32,
    heading: u32,
}

/// Squares that are not yet looked into, the best bound first; of equal ones the last that came, which is the finer.
///
/// Bounds are small whole numbers and never grow, so a list for each of them takes the place of a heap.
#[derive(Debug)]
struct OpenSquares {
    by_sum: Vec<Vec<Square>>,
    /// No list beyond this one holds anything.
    top: usize,
    num: usize,
}

impl OpenSquares {
    fn new(num_points: usize) -> Self {
        Self { by_sum: vec![Vec::new(); 255 * num_points + 1], top: 0, num: 0 }
    }

    const fn len(&self) -> usize {
        self.num
    }

    fn push(&mut self, square: Square) {
        self.top = self.top.max(square.sum as usize);
        self.num += 1;
        self.by_sum[square.sum as usize].push(square);
    }

    fn pop(&mut self) -> Option<Square> {
        while self.top > 0 && self.by_sum[self.top].is_empty() {
            self.top -= 1;
        }
        let square = self.by_sum[self.top].pop()?;
        self.num -= 1;
        Some(square)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::locate::LikelihoodFieldConfig;

    #[test]
    fn the_search_misses_nothing_that_trying_every_pose_finds() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut map = GridMap::unknown(70, 50, 0.2, Point2::new(-2.0, 1.0));
        (0..3500).for_each(|cell| map.set(cell % 70, cell / 70, CellState::Free));
        (0..250).for_each(|_| map.set(rng.random_range(0..70), rng.random_range(0..50), CellState::Occupied));
        let likelihood = LikelihoodField::build(&map, &LikelihoodFieldConfig::default());
        let pyramid = SearchPyramid::build(&map, &likelihood);
        let points: Vec<Point2> =
            (0..25).map(|_| Point2::new(rng.random_range(-3.0..3.0), rng.random_range(-3.0..3.0))).collect();
        let config = GlobalSearchConfig { num_headings: 16, min_score: 0.1, ..Default::default() };
        let found = pyramid.search(&points, &config);
        let mut best = 0;
        for heading in 0..16u32 {
            let turned = pyramid.turned(&points, f64::from(heading) * TAU / 16.0);
            for (x, y) in (0..70).flat_map(|x| (0..50).map(move |y| (x, y))) {
                if map.state(x as i64, y as i64) == CellState::Free {
                    let cell = (x + pyramid.margin, y + pyramid.margin);
                    best = best.max(pyramid.square(0, cell, heading, &turned).sum);
                }
            }
        }
        assert!(
            (found[0].score - f64::from(best) / (255.0 * 25.0)).abs() < 1e-9,
            "{:?} against {best}",
            found[0]
        );
        let outside = pyramid.search(&[Point2::new(0.0, 1.5 * SEARCH_REACH_MAX_M)], &config);
        assert!(outside.is_empty(), "farther than the margin is wide: {outside:?}");
        assert!(found.windows(2).all(|pair| pair[0].score >= pair[1].score));
    }
}
