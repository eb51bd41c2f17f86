//! Distance from a place to the first obstacle in a direction, cell by cell (Amanatides and Woo 1987).

use super::{CellState, GridMap};
use crate::geometry::Point2;

/// Metres from `from` along `angle_rad` to where the ray enters an occupied cell; `range_max_m` when it meets none.
/// Unknown cells let the ray pass. Cost: linear in the cells passed.
pub fn cast_ray(map: &GridMap, from: &Point2, angle_rad: f64, range_max_m: f64) -> f64 {
    let (sin, cos) = angle_rad.sin_cos();
    let (mut column, mut row) = map.cell_at(from);
    let origin = map.origin();
    let resolution = map.resolution_m();
    let axis = |position: f64, cell: i64, slope: f64| {
        let step = if slope > 0.0 { 1 } else { -1 };
        let edge = (cell + i64::from(step == 1)) as f64 * resolution;
        if slope == 0.0 {
            (0, f64::INFINITY, f64::INFINITY)
        } else {
            (step, (edge - position) / slope, resolution / slope.abs())
        }
    };
    let (step_x, mut next_x, pace_x) = axis(from.x - origin.x, column, cos);
    let (step_y, mut next_y, pace_y) = axis(from.y - origin.y, row, sin);
    let mut distance = 0.0;
    while distance < range_max_m {
        if map.state(column, row) == CellState::Occupied {
            return distance;
        }
        if next_x < next_y {
            (distance, column, next_x) = (next_x, column + step_x, next_x + pace_x);
        } else {
            (distance, row, next_y) = (next_y, row + step_y, next_y + pace_y);
        }
    }
    range_max_m
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    use super::*;

    #[test]
    fn rays_end_at_walls() {
        let map = GridMap::drawn(&["#####", "#...#", "#...#", "#...#", "#####"], 0.5);
        let from = Point2::new(1.25, 1.25);
        for angle in [0.0, FRAC_PI_2, PI, -FRAC_PI_2] {
            assert!((cast_ray(&map, &from, angle, 9.0) - 0.75).abs() < 1e-9, "towards {angle}");
        }
        let diagonal = cast_ray(&map, &from, FRAC_PI_4, 9.0);
        assert!((diagonal - 0.75 * 2f64.sqrt()).abs() < 1e-9, "{diagonal}");
        assert_eq!(cast_ray(&map, &from, 0.3, 0.5), 0.5);
    }
}
