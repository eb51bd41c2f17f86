//! The likelihood field: how well a beam's end fits a map, by its distance to the nearest obstacle (Probabilistic
//! Robotics, table 6.3).
//!
//! The logarithm of p = (1 − random) · exp(−d² / 2σ²) + random is kept as a byte per cell, so that the score of a scan
//! is a sum of bytes: 0 far from everything, 255 on an obstacle.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::geometry::{Point2, Pose2};
use crate::occupancy::{CellState, GridMap};

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

/// Cells per side of a square of codes.
const SQUARE_SIDE: u32 = 8;

/// Log-likelihoods of beam ends over a map.
#[derive(Clone, Debug, PartialEq)]
pub struct LikelihoodField {
    /// Columns and rows of the map; the codes have a border of one cell that is worth 0.
    width: usize,
    height: usize,
    resolution_m: f64,
    origin: Point2,
    /// Squares of cells, each a line of the cache, so that beams which end close together share memory.
    squares_per_row: u32,
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
        let squares = |cells: usize| (cells + 2).div_ceil(SQUARE_SIDE as usize);
        let squares_per_row = squares(map.width());
        let mut field = Self {
            width: map.width(),
            height: map.height(),
            resolution_m: map.resolution_m(),
            origin: map.origin(),
            squares_per_row: squares_per_row as u32,
            codes: vec![0; squares_per_row * squares(map.height()) * (SQUARE_SIDE * SQUARE_SIDE) as usize],
            unit,
            independence: config.independence,
        };
        for (row, squares) in (1..).zip(squared_distances(map, reach).chunks_exact(map.width())) {
            for (column, &square) in (1..).zip(squares) {
                let place = field.place(column, row) as usize;
                field.codes[place] = by_square.get(square as usize).copied().unwrap_or(0);
            }
        }
        field
    }

    /// Where the code of a cell lies; columns and rows count from the corner of the border.
    #[inline(always)]
    pub fn place(&self, column: u32, row: u32) -> u32 {
        let square =
            (row / SQUARE_SIDE).wrapping_mul(self.squares_per_row).wrapping_add(column / SQUARE_SIDE);
        square.wrapping_mul(SQUARE_SIDE * SQUARE_SIDE)
            | ((row % SQUARE_SIDE) * SQUARE_SIDE + column % SQUARE_SIDE)
    }

    /// The code at a place of a cell.
    #[inline(always)]
    pub fn code(&self, place: u32) -> u8 {
        self.codes[place as usize]
    }

    /// Column and row of the last cell, that of the border's far corner.
    #[inline(always)]
    pub const fn last_cell(&self) -> (u32, u32) {
        (self.width as u32 + 1, self.height as u32 + 1)
    }

    /// Code of the cell that holds a point: 0 far from obstacles or outside, 255 on one.
    pub fn code_at(&self, point: &Point2) -> u8 {
        let column = ((point.x - self.origin.x) / self.resolution_m).floor();
        let row = ((point.y - self.origin.y) / self.resolution_m).floor();
        if column < 0.0 || row < 0.0 || column >= self.width as f64 || row >= self.height as f64 {
            return 0;
        }
        self.code(self.place(column as u32 + 1, row as u32 + 1))
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
}
