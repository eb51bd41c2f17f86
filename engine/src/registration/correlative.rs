//! Correlative scan matching: every pose of a window is scored on a grid of likelihoods (Olson 2009).

use crate::geometry::{Point2, Pose2};

/// The poses to try around a start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalWindow {
    /// Half width along x, metres.
    pub half_x_m: f64,
    /// Half width along y, metres.
    pub half_y_m: f64,
    /// Half width of the heading, radians.
    pub half_turn_rad: f64,
}

/// A square of cells; a marked cell is worth 3, its four neighbours 2, its diagonal neighbours 1.
#[derive(Clone, Debug)]
pub(crate) struct LikelihoodGrid {
    cell_m: f64,
    origin: Point2,
    side: i32,
    cells: Vec<u8>,
    reach_m: f64,
}

impl LikelihoodGrid {
    /// An empty grid that reaches `radius_m` from `center`.
    pub fn around(center: &Point2, radius_m: f64, cell_m: f64) -> Self {
        let side = (2.0 * radius_m / cell_m).ceil() as i32 + 4;
        let half = f64::from(side) * cell_m * 0.5;
        let origin = Point2::new(center.x - half, center.y - half);
        Self { cell_m, origin, side, cells: vec![0; (side * side) as usize], reach_m: radius_m }
    }

    /// Marks the cell of an occupied point; points outside are ignored.
    pub fn mark(&mut self, point: &Point2) {
        let column = ((point.x - self.origin.x) / self.cell_m).floor() as i32;
        let row = ((point.y - self.origin.y) / self.cell_m).floor() as i32;
        if column < 1 || row < 1 || column >= self.side - 1 || row >= self.side - 1 {
            return;
        }
        for dy in -1..=1i32 {
            for dx in -1..=1i32 {
                let worth = 3 - dx.unsigned_abs() as u8 - dy.unsigned_abs() as u8;
                let cell = &mut self.cells[((row + dy) * self.side + column + dx) as usize];
                *cell = (*cell).max(worth);
            }
        }
    }

    /// The best-scoring pose of the window around `start`; ties go to the pose nearest to the start in search order.
    /// None when no return lies on the grid.
    pub fn best_pose(&self, points: &[Point2], start: &Pose2, window: &LocalWindow) -> Option<Pose2> {
        let near: Vec<&Point2> =
            points.iter().filter(|point| point.x.hypot(point.y) <= self.reach_m).collect();
        let farthest_m = near.iter().map(|point| point.x.hypot(point.y)).fold(0.0f64, f64::max);
        if near.is_empty() || farthest_m <= 0.0 {
            return None;
        }
        let turn_step = (self.cell_m / farthest_m.min(10.0)).min(window.half_turn_rad.max(1e-3));
        let num_turns = (window.half_turn_rad / turn_step).ceil() as i32;
        let (nx, ny) =
            ((window.half_x_m / self.cell_m).ceil() as i32, (window.half_y_m / self.cell_m).ceil() as i32);
        let mut best: Option<(f64, Pose2)> = None;
        let mut cells: Vec<(i32, i32)> = Vec::with_capacity(near.len());
        for turn_idx in -num_turns..=num_turns {
            let theta = start.theta + f64::from(turn_idx) * turn_step;
            let (sin, cos) = theta.sin_cos();
            cells.clear();
            cells.extend(near.iter().map(|point| {
                let x = start.x + cos * point.x - sin * point.y - self.origin.x;
                let y = start.y + sin * point.x + cos * point.y - self.origin.y;
                ((x / self.cell_m).floor() as i32, (y / self.cell_m).floor() as i32)
            }));
            for dy in -ny..=ny {
                for dx in -nx..=nx {
                    let score = self.score(&cells, dx, dy);
                    // A small penalty keeps plateaus at the prediction.
                    let distance2 = f64::from(dx * dx + dy * dy) * self.cell_m * self.cell_m;
                    let turned = f64::from(turn_idx) * turn_step;
                    let worth = f64::from(score) * (1.0 - 0.1 * distance2 - 0.5 * turned * turned);
                    if best.is_none_or(|(other, _)| worth > other) {
                        let pose = Pose2::new(
                            start.x + f64::from(dx) * self.cell_m,
                            start.y + f64::from(dy) * self.cell_m,
                            theta,
                        );
                        best = Some((worth, pose));
                    }
                }
            }
        }
        best.map(|(_, pose)| pose)
    }

    fn score(&self, cells: &[(i32, i32)], dx: i32, dy: i32) -> u32 {
        let mut sum = 0;
        for &(column, row) in cells {
            let (column, row) = (column + dx, row + dy);
            if column >= 0 && row >= 0 && column < self.side && row < self.side {
                sum += u32::from(self.cells[(row * self.side + column) as usize]);
            }
        }
        sum
    }
}
