//! The likelihood field: how well a beam's end fits a map, by its distance to the nearest obstacle (Probabilistic
//! Robotics, table 6.3).
//!
//! The logarithm of p = (1 − random) · exp(−d² / 2σ²) + random is kept as a byte per cell, so that the score of a scan
//! is a sum of bytes: 0 far from everything, 255 on an obstacle.

use serde::{Deserialize, Serialize};

use super::grid_map::{CellState, GridMap};
use super::particle_filter::SensorModel;
use super::particles::Particles;
use crate::config::ConfigError;
use crate::geometry::{Point2, Pose2};

/// Shape of the likelihood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LikelihoodFieldConfig {
    /// σ: deviation of a beam's end from the obstacle of the map, metres.
    pub sigma_m: f64,
    /// Share of beams that end anywhere: people, moved things, errors of the map.
    pub random_share: f64,
    /// Weight of a beam relative to an independent measurement; neighbouring beams err together.
    pub independence: f64,
}

impl Default for LikelihoodFieldConfig {
    fn default() -> Self {
        Self { sigma_m: 0.15, random_share: 0.1, independence: 0.3 }
    }
}

impl LikelihoodFieldConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(self.sigma_m > 0.0 && self.sigma_m <= 5.0) {
            return Err(ConfigError::new(format!("{path}.sigma_m"), "must lie above 0 and up to 5 m"));
        }
        for (name, value) in [("random_share", self.random_share), ("independence", self.independence)] {
            if !(value > 0.0 && value <= 1.0) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must lie in 0..=1 and not be 0"));
            }
        }
        Ok(())
    }

    /// ln p at a distance from the nearest obstacle.
    fn log_likelihood(&self, distance_m: f64) -> f64 {
        let hit = (-0.5 * (distance_m / self.sigma_m).powi(2)).exp();
        ((1.0 - self.random_share) * hit + self.random_share).ln()
    }
}

/// Log-likelihoods of beam ends over a map.
#[derive(Clone, Debug, PartialEq)]
pub struct LikelihoodField {
    /// Columns and rows of the map; the codes have a border of one cell that is worth 0.
    width: usize,
    height: usize,
    resolution_m: f64,
    origin: Point2,
    /// Rows of codes start at multiples of 2^`row_shift`.
    row_shift: u32,
    codes: Vec<u8>,
    /// What one step of the code is worth, in natural logarithms.
    unit: f64,
    independence: f64,
}

impl LikelihoodField {
    /// Computes the field of a map. Cost: linear in cells times 3σ in cells.
    pub fn build(map: &GridMap, config: &LikelihoodFieldConfig) -> Self {
        let worst = config.random_share.ln();
        let unit = (config.log_likelihood(0.0) - worst) / 255.0;
        let reach = (3.5 * config.sigma_m / map.resolution_m()).ceil() as usize;
        let code = |squared_cells: u32| {
            let distance_m = f64::from(squared_cells).sqrt() * map.resolution_m();
            ((config.log_likelihood(distance_m) - worst) / unit).round() as u8
        };
        let by_square: Vec<u8> = (0..=2 * (reach * reach) as u32).map(code).collect();
        let row_shift = (map.width() + 2).next_power_of_two().trailing_zeros();
        let mut codes = vec![0; (map.height() + 2) << row_shift];
        for (row, squares) in squared_distances(map, reach).chunks_exact(map.width()).enumerate() {
            let start = ((row + 1) << row_shift) + 1;
            for (code, &square) in codes[start..].iter_mut().zip(squares) {
                *code = by_square.get(square as usize).copied().unwrap_or(0);
            }
        }
        Self {
            width: map.width(),
            height: map.height(),
            resolution_m: map.resolution_m(),
            origin: map.origin(),
            row_shift,
            codes,
            unit,
            independence: config.independence,
        }
    }

    /// Code of the cell that holds a point: 0 far from obstacles or outside, 255 on one.
    pub fn code_at(&self, point: &Point2) -> u8 {
        let column = ((point.x - self.origin.x) / self.resolution_m).floor();
        let row = ((point.y - self.origin.y) / self.resolution_m).floor();
        if column < 0.0 || row < 0.0 || column >= self.width as f64 || row >= self.height as f64 {
            return 0;
        }
        self.codes[((row as usize + 1) << self.row_shift) + column as usize + 1]
    }

    /// Natural logarithm that one step of the code is worth for one beam, with the beams' dependence taken off.
    pub const fn unit_of_evidence(&self) -> f64 {
        self.unit * self.independence
    }

    /// Edge of a cell in metres.
    pub const fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Lower left corner of the map, metres.
    pub const fn origin(&self) -> Point2 {
        self.origin
    }

    /// Mean code of beam ends in the robot's frame, seen from a pose; 0 for none.
    pub fn mean_code(&self, points: &[Point2], map_from_robot: &Pose2) -> f64 {
        let sum: u32 =
            points.iter().map(|point| u32::from(self.code_at(&map_from_robot.transform_point(point)))).sum();
        if points.is_empty() { 0.0 } else { f64::from(sum) / points.len() as f64 }
    }
}

/// Squared distance in cells from every cell to the nearest occupied one, exact up to `reach` cells along an axis and
/// `u32::MAX` beyond.
fn squared_distances(map: &GridMap, reach: usize) -> Vec<u32> {
    let (width, height) = (map.width(), map.height());
    let far = reach as u32 + 1;
    let mut along_column = vec![far; width * height];
    for (cell, state) in map.cells().iter().enumerate() {
        if *state == CellState::Occupied {
            along_column[cell] = 0;
        } else if cell >= width {
            along_column[cell] = far.min(along_column[cell - width] + 1);
        }
    }
    for cell in (0..width * (height - 1)).rev() {
        along_column[cell] = along_column[cell].min(along_column[cell + width] + 1);
    }
    let mut squares = vec![u32::MAX; width * height];
    for (row, nearest) in squares.chunks_exact_mut(width).zip(along_column.chunks_exact(width)) {
        for dx in 0..=reach.min(width - 1) {
            let offset = (dx * dx) as u32;
            let square = |down: u32| if down < far { down * down + offset } else { u32::MAX };
            for (best, &down) in row[dx..].iter_mut().zip(nearest) {
                *best = (*best).min(square(down));
            }
            for (best, &down) in row.iter_mut().zip(&nearest[dx..]) {
                *best = (*best).min(square(down));
            }
        }
    }
    squares
}

/// A scan against a likelihood field: the sensor model of pose tracking.
///
/// The beam ends are turned once per heading that particles have, in steps of [`TURN_STEPS`], and kept in fixed point, so
/// that a beam of a particle is two sums, a few shifts and one byte of memory.
#[derive(Clone, Debug)]
pub struct LikelihoodFieldModel<'a> {
    field: &'a LikelihoodField,
    /// Beam ends in the robot's frame, in cells.
    ends: Vec<(f64, f64)>,
    /// No end is farther from the robot than this, in cells.
    reach: f32,
}

/// Headings told apart: 0.09° off at most, 1.5 cm at ten metres.
const TURN_STEPS: usize = 2048;
/// Fractions of a cell are kept to 2⁻¹².
const FRACTION_BITS: u32 = 12;
/// Positions and ends stay below this, so that their sums stay within fixed point.
const FARTHEST_CELLS: f32 = 200_000.0;
const ONE_CELL: f64 = (1 << FRACTION_BITS) as f64;

/// Beam ends at every heading that occurs, in fixed point.
struct TurnedEnds {
    num_ends: usize,
    /// Where the ends of a heading begin; `ABSENT` when no particle has it.
    starts: Vec<u32>,
    ends: Vec<(i32, i32)>,
}

const ABSENT: u32 = u32::MAX;

impl TurnedEnds {
    fn new(ends: &[(f64, f64)], headings: &[u16]) -> Self {
        let mut turned = Self { num_ends: ends.len(), starts: vec![ABSENT; TURN_STEPS], ends: Vec::new() };
        for &heading in headings {
            let start = &mut turned.starts[usize::from(heading)];
            if *start != ABSENT {
                continue;
            }
            *start = turned.ends.len() as u32;
            let (sin, cos) = (f64::from(heading) / TURN_STEPS as f64 * std::f64::consts::TAU).sin_cos();
            turned.ends.extend(ends.iter().map(|(along, across)| {
                (fixed(cos * along - sin * across), fixed(sin * along + cos * across))
            }));
        }
        turned
    }

    #[inline]
    fn at(&self, heading: u16) -> &[(i32, i32)] {
        let start = self.starts[usize::from(heading)] as usize;
        &self.ends[start..start + self.num_ends]
    }
}

fn fixed(cells: f64) -> i32 {
    (cells * ONE_CELL).round() as i32
}

/// The step of a heading in turns.
fn heading_step(heading_turns: f32) -> u16 {
    ((heading_turns * TURN_STEPS as f32).round() as i32).rem_euclid(TURN_STEPS as i32) as u16
}

impl<'a> LikelihoodFieldModel<'a> {
    /// The model of the beam ends `points`, in the robot's frame, metres; ends farther than any map is wide say nothing.
    pub fn new(field: &'a LikelihoodField, points: &[Point2]) -> Self {
        let ends: Vec<(f64, f64)> = points
            .iter()
            .map(|point| (point.x / field.resolution_m, point.y / field.resolution_m))
            .filter(|(along, across)| along.hypot(*across) < f64::from(FARTHEST_CELLS))
            .collect();
        let reach = ends.iter().map(|(along, across)| along.hypot(*across)).fold(0.0, f64::max);
        Self { field, ends, reach: reach as f32 + 1.0 }
    }

    /// Sum of codes of all beam ends for a particle, its position in cells.
    #[inline]
    fn score(&self, x: f32, y: f32, ends: &[(i32, i32)]) -> u32 {
        let field = self.field;
        let (right, top) = (field.width as f32, field.height as f32);
        // The codes begin with a border of one cell. What is so far off the map sees nothing of it.
        let near = |cells: f32| fixed(f64::from(cells.clamp(-FARTHEST_CELLS, FARTHEST_CELLS)) + 1.0);
        let (column, row) = (near(x), near(y));
        let is_deep_inside =
            x > self.reach && y > self.reach && x + self.reach < right && y + self.reach < top;
        if is_deep_inside {
            return ends.iter().map(|end| field.code_of(column + end.0, row + end.1)).sum();
        }
        // Beyond the edge all cells are worth nothing, as those of the border are.
        let side = |cells: usize| ((cells + 1) << FRACTION_BITS) as i32;
        let (right, top) = (side(field.width), side(field.height));
        ends.iter()
            .map(|end| field.code_of((column + end.0).clamp(0, right), (row + end.1).clamp(0, top)))
            .sum()
    }
}

impl LikelihoodField {
    /// Code at a position in fixed point, counted from the corner of the border.
    #[inline]
    fn code_of(&self, column: i32, row: i32) -> u32 {
        let cell = ((row >> FRACTION_BITS) << self.row_shift) | (column >> FRACTION_BITS);
        u32::from(self.codes.get(cell as usize).copied().unwrap_or(0))
    }
}

impl SensorModel for LikelihoodFieldModel<'_> {
    fn weigh(&self, particles: &mut Particles) {
        let scale = (1.0 / self.field.resolution_m) as f32;
        let headings: Vec<u16> = particles.heading_turns.iter().map(|turns| heading_step(*turns)).collect();
        let turned = TurnedEnds::new(&self.ends, &headings);
        let poses = particles.x_m.iter().zip(&particles.y_m).zip(&headings);
        let scores: Vec<u32> =
            poses.map(|((x, y), heading)| self.score(x * scale, y * scale, turned.at(*heading))).collect();
        let best = scores.iter().copied().max().unwrap_or(0);
        let by_lag = self.weights_by_lag();
        for (weight, score) in particles.weight.iter_mut().zip(scores) {
            *weight *= by_lag.get((best - score) as usize).copied().unwrap_or(0.0);
        }
    }
}

impl LikelihoodFieldModel<'_> {
    /// Weight by how far a score lags behind the best one, down to where it vanishes.
    fn weights_by_lag(&self) -> Vec<f32> {
        let unit = self.field.unit_of_evidence();
        let num_lags = ((30.0 / unit).ceil() as usize).min(255 * self.ends.len() + 1);
        (0..num_lags).map(|lag| (-unit * lag as f64).exp() as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn scattered(rng: &mut ChaCha8Rng, width: usize, height: usize) -> GridMap {
        let mut map = GridMap::unknown(width, height, 0.1, Point2::new(-3.0, 2.0));
        for _ in 0..width * height / 15 {
            map.set(
                rng.random_range(0..width as i64),
                rng.random_range(0..height as i64),
                CellState::Occupied,
            );
        }
        map
    }

    #[test]
    fn distances_agree_with_a_search_over_all_obstacles() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (width, height) in [(1, 9), (30, 20), (7, 40)] {
            let map = scattered(&mut rng, width, height);
            for (cell, &square) in squared_distances(&map, 6).iter().enumerate() {
                let (column, row) = ((cell % width) as i64, (cell / width) as i64);
                let exact = (0..(width * height) as i64)
                    .filter(|&other| map.cells()[other as usize] == CellState::Occupied)
                    .map(|other| (other % width as i64 - column, other / width as i64 - row))
                    .filter(|(dx, dy)| dx.abs() <= 6 && dy.abs() <= 6)
                    .map(|(dx, dy)| (dx * dx + dy * dy) as u32)
                    .min();
                assert_eq!(square, exact.unwrap_or(u32::MAX), "{column},{row}");
            }
        }
    }

    #[test]
    fn particles_are_weighed_as_one_point_after_another() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let map = scattered(&mut rng, 90, 70);
        let field = LikelihoodField::build(&map, &LikelihoodFieldConfig::default());
        let points: Vec<Point2> =
            (0..19).map(|_| Point2::new(rng.random_range(-4.0..4.0), rng.random_range(-4.0..4.0))).collect();
        let mut particles = Particles::default();
        for _ in 0..300 {
            let pose = Pose2::new(
                rng.random_range(-4.0..7.0),
                rng.random_range(1.0..10.0),
                rng.random_range(-3.0..3.0),
            );
            particles.push(&pose, &map.origin());
        }
        let model = LikelihoodFieldModel::new(&field, &points);
        let close = (0..300).filter(|&index| {
            let exact = particles.pose(index, &map.origin());
            let heading = heading_step(particles.heading_turns[index]);
            let stepped = f64::from(heading) / TURN_STEPS as f64 * std::f64::consts::TAU;
            assert!(crate::geometry::angle_between(exact.theta, stepped) < 0.0016, "half a step at most");
            let pose = Pose2::new(exact.x, exact.y, stepped);
            let slow = field.mean_code(&points, &pose) * points.len() as f64;
            let (x, y) = (particles.x_m[index] * 10.0, particles.y_m[index] * 10.0);
            let turned = TurnedEnds::new(&model.ends, &[heading]);
            // A point within a rounding error of a cell's edge may fall on either side.
            (f64::from(model.score(x, y, turned.at(heading))) - slow).abs() < 0.5
        });
        assert!(close.count() >= 290);
        model.weigh(&mut particles);
        let best = particles.weight.iter().copied().fold(0.0, f32::max);
        assert_eq!(best, 1.0, "the best particle keeps its weight");
    }
}
