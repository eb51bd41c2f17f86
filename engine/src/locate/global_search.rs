//! Where in the whole map could this neighbourhood lie? Branch and bound over all poses (after Olson 2015 and Hess et
//! al. 2016).
//!
//! Headings are tried one by one; for each, squares of positions are bounded from above by a pyramid of maxima of the
//! likelihood field and split, the most promising first. So poses come out in the order of their score, and every pose
//! that is not reported scores less than the last one that is.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
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

/// Maxima of a likelihood field over squares that start at every cell, for squares of 1, 2, 4 … cells a side.
#[derive(Clone, Debug)]
pub struct SearchPyramid {
    width: usize,
    height: usize,
    cell_m: f64,
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
        let (width, height) = (grid.width().div_ceil(merge), grid.height().div_ceil(merge));
        let mut codes = vec![0u8; width * height];
        let mut free = vec![false; width * height];
        for row in 0..grid.height() {
            for column in 0..grid.width() {
                let cell = row / merge * width + column / merge;
                let (x, y) = (column as i64, row as i64);
                codes[cell] = codes[cell].max(likelihood.code_at(&grid.center_of(x, y)));
                free[cell] |= grid.state(x, y) == CellState::Free;
            }
        }
        let mut pyramid = Self {
            width,
            height,
            cell_m: grid.resolution_m() * merge as f64,
            origin: grid.origin(),
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
        if points.is_empty() {
            return Vec::new();
        }
        let headings: Vec<f64> =
            (0..config.num_headings).map(|k| k as f64 * TAU / config.num_headings as f64).collect();
        let turned: Vec<Vec<(i32, i32)>> =
            headings.iter().map(|&heading| self.turned(points, heading)).collect();
        let mut open = self.roots(&turned, config);
        let mut num_squares = open.len();
        let mut found: Vec<ScoredPose> = Vec::new();
        while let Some(square) = open.pop() {
            let best = found.first().map_or(0.0, |first| first.score);
            if square.score(points.len()) < config.min_score.max(best * config.min_share_of_best)
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
                found.push(ScoredPose { map_from_robot: pose, score: square.score(points.len()) });
                continue;
            }
            for child in self.children(&square, &turned[square.heading as usize]) {
                num_squares += 1;
                open.push(child);
            }
        }
        found
    }

    /// Points of the robot's frame as cells after a turn.
    fn turned(&self, points: &[Point2], heading: f64) -> Vec<(i32, i32)> {
        let (sin, cos) = heading.sin_cos();
        let cell = |meters: f64| (meters / self.cell_m).round() as i32;
        points.iter().map(|p| (cell(cos * p.x - sin * p.y), cell(sin * p.x + cos * p.y))).collect()
    }

    /// All squares of the coarsest level in which a robot can stand and which are not bounded too low.
    fn roots(&self, turned: &[Vec<(i32, i32)>], config: &GlobalSearchConfig) -> BinaryHeap<Square> {
        let level = NUM_LEVELS - 1;
        let side = 1usize << level;
        let mut roots = BinaryHeap::new();
        let corners =
            (0..self.height).step_by(side).flat_map(|y| (0..self.width).step_by(side).map(move |x| (x, y)));
        for (x, y) in corners.filter(|&(x, y)| self.free[level][y * self.width + x]) {
            for (heading, points) in turned.iter().enumerate() {
                let square = self.square(level, (x, y), heading as u32, points);
                if square.score(points.len()) >= config.min_score {
                    roots.push(square);
                }
            }
        }
        roots
    }

    fn children(&self, square: &Square, points: &[(i32, i32)]) -> Vec<Square> {
        let level = square.level as usize - 1;
        let side = 1usize << level;
        [(0, 0), (side, 0), (0, side), (side, side)]
            .into_iter()
            .map(|(dx, dy)| (square.x as usize + dx, square.y as usize + dy))
            .filter(|&(x, y)| x < self.width && y < self.height && self.free[level][y * self.width + x])
            .map(|corner| self.square(level, corner, square.heading, points))
            .collect()
    }

    /// A square with the sum of the best codes that its positions could give.
    fn square(&self, level: usize, (x, y): (usize, usize), heading: u32, points: &[(i32, i32)]) -> Square {
        let codes = &self.codes[level];
        let (width, height) = (self.width as i32, self.height as i32);
        let reach = (1i32 << level) - 1;
        let sum = points
            .iter()
            .map(|&(dx, dy)| {
                let (column, row) = (x as i32 + dx, y as i32 + dy);
                if column < -reach || row < -reach || column >= width || row >= height {
                    return 0;
                }
                // A square that begins before the map is bounded by the one that begins at its edge.
                u32::from(codes[(row.max(0) * width + column.max(0)) as usize])
            })
            .sum();
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

impl Square {
    fn score(&self, num_points: usize) -> f64 {
        f64::from(self.sum) / (255.0 * num_points as f64)
    }
}

impl Ord for Square {
    /// The better bound first, then the finer square, then the place.
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |square: &Self| {
            (square.sum, std::cmp::Reverse((square.level, square.heading, square.y, square.x)))
        };
        key(self).cmp(&key(other))
    }
}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
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
                    best = best.max(pyramid.square(0, (x, y), heading, &turned).sum);
                }
            }
        }
        assert!(
            (found[0].score - f64::from(best) / (255.0 * 25.0)).abs() < 1e-9,
            "{:?} against {best}",
            found[0]
        );
        assert!(found.windows(2).all(|pair| pair[0].score >= pair[1].score));
    }
}
