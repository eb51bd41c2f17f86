//! Cells of a grid: integer coordinates of squares whose lower left corners are multiples of the resolution.

use serde::{Deserialize, Serialize};

use crate::geometry::Point2;

/// A square of the grid, counted from the origin of the map's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Cell {
    /// Column, growing with x.
    pub x: i32,
    /// Row, growing with y.
    pub y: i32,
}

impl Cell {
    /// The cell in column `x` and row `y`.
    pub const fn new(x: i32, y: i32) -> Self {
        Self { x, y }
    }

    /// The cell that contains a point (`pose2grid` of the thesis).
    pub fn containing(point: &Point2, resolution_m: f64) -> Self {
        Self { x: (point.x / resolution_m).floor() as i32, y: (point.y / resolution_m).floor() as i32 }
    }

    /// Centre of the cell, metres.
    pub fn center(&self, resolution_m: f64) -> Point2 {
        Point2::new((f64::from(self.x) + 0.5) * resolution_m, (f64::from(self.y) + 0.5) * resolution_m)
    }

    /// The cell `dx` columns and `dy` rows away.
    pub const fn offset(&self, dx: i32, dy: i32) -> Self {
        Self { x: self.x.wrapping_add(dx), y: self.y.wrapping_add(dy) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_contain_their_centers_on_both_sides_of_the_origin() {
        for cell in [Cell::new(0, 0), Cell::new(-1, -1), Cell::new(17, -42)] {
            assert_eq!(Cell::containing(&cell.center(0.1), 0.1), cell);
        }
        assert_eq!(Cell::containing(&Point2::new(-0.01, 0.01), 0.1), Cell::new(-1, 0));
    }
}
