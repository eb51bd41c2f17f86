//! Correlative search by branch and bound: the best pose of a window, found without trying most of them.
//!
//! A pyramid holds for every cell the best worth within the next 1, 2, 4, 8 cells to the right and up, so that one
//! look bounds a whole block of offsets from above (Hess et al. 2016, after Olson 2009).

use nalgebra::{Matrix2, Vector2};

use super::evidence_grid::EvidenceGrid;
use crate::geometry::{Point2, Pose2};

/// The poses to try around a start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchWindow {
    /// Pose in the middle of the window.
    pub center: Pose2,
    /// Half width in x and y, metres.
    pub half_m: f64,
    /// Half width of the heading, radians.
    pub half_turn_rad: f64,
}

/// Block sizes of the pyramid, cells.
const NUM_LEVELS: usize = 4;

/// Bounds for blocks of offsets.
#[derive(Clone, Debug)]
pub(crate) struct SearchPyramid {
    cell_m: f64,
    half: i32,
    side: i32,
    levels: Vec<Vec<u8>>,
}

/// A block of offsets at one heading.
#[derive(Clone, Copy, Debug)]
struct Block {
    bound: u32,
    turn_idx: usize,
    x: i32,
    y: i32,
}

/// The best so far.
struct Best {
    /// What another must exceed.
    worth: u32,
    block: Option<Block>,
}

impl SearchPyramid {
    /// The pyramid over the hits of a grid, with cells twice as large: the alignment that follows finds the rest.
    pub fn new(grid: &EvidenceGrid) -> Self {
        let mut pyramid = Self::flat(grid);
        for level in 1..NUM_LEVELS {
            let reach = 1usize << (level - 1);
            let wider = widened(&pyramid.levels[level - 1], pyramid.side as usize, reach);
            pyramid.levels.push(wider);
        }
        pyramid
    }

    /// Its lowest level alone, which is all that [`SearchPyramid::spread`] reads.
    pub fn flat(grid: &EvidenceGrid) -> Self {
        let half = grid.half().div_euclid(2) + 1;
        Self { cell_m: 2.0 * grid.cell_m(), half, side: 2 * half + 1, levels: vec![halved(grid, half)] }
    }

    /// The pose of highest worth, and that worth as a share of the highest possible; none when nothing falls onto a
    /// surface. Ties go to the first in a fixed order.
    pub fn best_pose(
        &self,
        points: &[Point2],
        window: &SearchWindow,
        turn_step_rad: f64,
    ) -> Option<(Pose2, f64)> {
        self.best_pose_above(0.0, points, window, turn_step_rad)
    }

    /// The same, and none when the worth is no larger than this share of the highest possible, which is known soon.
    pub fn best_pose_above(
        &self,
        share: f64,
        points: &[Point2],
        window: &SearchWindow,
        turn_step_rad: f64,
    ) -> Option<(Pose2, f64)> {
        if points.is_empty() {
            return None;
        }
        let num_turns = (window.half_turn_rad / turn_step_rad).ceil() as i32;
        let half_cells = (window.half_m / self.cell_m).ceil() as i32;
        let top = NUM_LEVELS - 1;
        let block = 1 << top;
        let headings: Vec<f64> =
            (-num_turns..=num_turns).map(|k| window.center.theta + f64::from(k) * turn_step_rad).collect();
        let placed: Vec<Vec<(i32, i32)>> =
            headings.iter().map(|&theta| self.cells_at(points, &window.center, theta)).collect();
        let mut blocks = Vec::new();
        for (turn_idx, cells) in placed.iter().enumerate() {
            for y in (-half_cells..=half_cells).step_by(block) {
                for x in (-half_cells..=half_cells).step_by(block) {
                    blocks.push(Block { bound: self.bound(top, cells, x, y), turn_idx, x, y });
                }
            }
        }
        blocks.sort_by_key(|block| (std::cmp::Reverse(block.bound), block.turn_idx, block.y, block.x));
        let least = (share * 2.0 * points.len() as f64) as u32;
        let mut best = Best { worth: least, block: None };
        for block in &blocks {
            if block.bound <= best.worth {
                break;
            }
            self.descend(top, block, &placed[block.turn_idx], half_cells, &mut best);
        }
        best.block.map(|best| {
            let pose = Pose2::new(
                window.center.x + f64::from(best.x) * self.cell_m,
                window.center.y + f64::from(best.y) * self.cell_m,
                headings[best.turn_idx],
            );
            (pose, f64::from(best.bound) / (2.0 * points.len() as f64))
        })
    }

    /// Covariance of the place of `pose` by how slowly the worth falls around it, square metres.
    ///
    /// Every offset within `half_m` counts with exp(−(number of returns lost) / `returns_per_e`): a place among clutter
    /// keeps all weight at the middle, a plain corridor spreads it along itself however well the walls fit (after
    /// Olson 2009).
    pub fn spread(&self, points: &[Point2], pose: &Pose2, half_m: f64, returns_per_e: f64) -> Matrix2<f64> {
        let cells = self.cells_at(points, pose, pose.theta);
        let half_cells = (half_m / self.cell_m).round() as i32;
        let mut scores = Vec::new();
        for y in -half_cells..=half_cells {
            for x in -half_cells..=half_cells {
                scores.push((x, y, self.bound(0, &cells, x, y)));
            }
        }
        let best = scores.iter().map(|score| score.2).max().unwrap_or(0);
        let (mut total, mut covariance) = (0.0, Matrix2::zeros());
        for (x, y, score) in scores {
            let weight = (-0.5 * f64::from(best - score) / returns_per_e).exp();
            let offset = Vector2::new(f64::from(x), f64::from(y)) * self.cell_m;
            total += weight;
            covariance += offset * offset.transpose() * weight;
        }
        covariance / total
    }

    fn descend(&self, level: usize, block: &Block, cells: &[(i32, i32)], half_cells: i32, best: &mut Best) {
        if level == 0 {
            if block.bound > best.worth {
                *best = Best { worth: block.bound, block: Some(*block) };
            }
            return;
        }
        let step = 1 << (level - 1);
        let mut children: Vec<Block> = Vec::with_capacity(4);
        for (dx, dy) in [(0, 0), (step, 0), (0, step), (step, step)] {
            let (x, y) = (block.x + dx, block.y + dy);
            if x <= half_cells && y <= half_cells {
                children.push(Block { bound: self.bound(level - 1, cells, x, y), x, y, ..*block });
            }
        }
        children.sort_by_key(|child| std::cmp::Reverse(child.bound));
        for child in &children {
            if child.bound <= best.worth {
                break;
            }
            self.descend(level - 1, child, cells, half_cells, best);
        }
    }

    fn cells_at(&self, points: &[Point2], center: &Pose2, theta: f64) -> Vec<(i32, i32)> {
        let (sin, cos) = theta.sin_cos();
        points
            .iter()
            .map(|point| {
                let x = center.x + cos * point.x - sin * point.y;
                let y = center.y + sin * point.x + cos * point.y;
                (
                    (x / self.cell_m + 0.5).floor() as i32 + self.half,
                    (y / self.cell_m + 0.5).floor() as i32 + self.half,
                )
            })
            .collect()
    }

    /// Upper bound of the worth over the block of `2^level` offsets from (x, y) on.
    fn bound(&self, level: usize, cells: &[(i32, i32)], x: i32, y: i32) -> u32 {
        let values = &self.levels[level];
        let reach = (1 << level) - 1;
        let mut sum = 0;
        for &(column, row) in cells {
            let (column, row) = (column + x, row + y);
            // A block may begin outside the grid and still reach into it; the border cells are always empty.
            if column >= -reach && row >= -reach && column < self.side && row < self.side {
                let index = row.max(0) * self.side + column.max(0);
                sum += u32::from(values[index as usize]);
            }
        }
        sum
    }
}

/// The best worth of the fine cells whose centres lie in or on the border of each coarse cell.
fn halved(grid: &EvidenceGrid, half: i32) -> Vec<u8> {
    let (fine_half, fine_side) = (grid.half(), 2 * grid.half() + 1);
    let side = 2 * half + 1;
    let mut coarse = vec![0u8; (side * side) as usize];
    for (index, &worth) in grid.hit_worth().iter().enumerate().filter(|(_, worth)| **worth > 0) {
        let (x, y) = (index as i32 % fine_side - fine_half, index as i32 / fine_side - fine_half);
        let cell = &mut coarse[((y.div_euclid(2) + half) * side + x.div_euclid(2) + half) as usize];
        *cell = (*cell).max(worth);
    }
    coarse
}

/// The maximum over each cell and the one `reach` to the right, then the same upwards.
fn widened(values: &[u8], side: usize, reach: usize) -> Vec<u8> {
    let mut wide = values.to_vec();
    for row in 0..side {
        let line = &values[row * side..(row + 1) * side];
        let target = &mut wide[row * side..(row + 1) * side];
        for (cell, &right) in target.iter_mut().zip(&line[reach.min(side)..]) {
            *cell = (*cell).max(right);
        }
    }
    let across = wide.clone();
    for (cell, &above) in wide.iter_mut().zip(&across[(reach * side).min(across.len())..]) {
        *cell = (*cell).max(above);
    }
    wide
}
