//! What a laser sees: exact walks through cells near walls, long steps through open floor.

use super::world::World;
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::scan::ScanGeometry;

/// A round obstacle that is not part of the building, such as a person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre in the world's frame.
    pub center: Point2,
    /// Radius in metres.
    pub radius_m: f64,
}

/// Noise-free ranges of one sweep; infinite where nothing is met before the geometry's maximum.
pub(super) fn cast_scan(
    world: &World,
    discs: &[Disc],
    geometry: &ScanGeometry,
    world_from_robot: &Pose2,
) -> Vec<f64> {
    let world_from_laser = world_from_robot.compose(&geometry.robot_from_laser);
    let origin = world_from_laser.position();
    let near: Vec<Disc> = discs
        .iter()
        .filter(|disc| {
            let distance_m = disc.center.distance(&origin);
            // A laser inside a person would see nothing at all; such a person has stepped aside.
            distance_m > disc.radius_m + 0.05 && distance_m < geometry.range_max_m + disc.radius_m
        })
        .copied()
        .collect();
    (0..geometry.num_ranges)
        .map(|beam_idx| {
            let angle_rad = world_from_laser.theta + geometry.beam_angle_rad(beam_idx);
            let wall_m = cast_ray(world, &origin, angle_rad, geometry.range_max_m);
            near.iter().filter_map(|disc| distance_to_disc(&origin, angle_rad, disc)).fold(wall_m, f64::min)
        })
        .collect()
}

/// Distance in metres from `origin` to the first blocked cell in this direction, infinite beyond `range_max_m`.
///
/// Cost: where the nearest wall is far the ray jumps by that distance, so about a dozen steps instead of hundreds.
pub(super) fn cast_ray(world: &World, origin: &Point2, angle_rad: f64, range_max_m: f64) -> f64 {
    let (dy, dx) = angle_rad.sin_cos();
    let resolution_m = world.resolution_m();
    let cell_at =
        |range_m: f64| world.cell_of(&Point2::new(origin.x + range_m * dx, origin.y + range_m * dy));
    let mut range_m = 0.0;
    let mut cell = cell_at(0.0);
    while range_m < range_max_m {
        if !world.is_free_cell(cell) {
            return range_m;
        }
        // No blocked cell's edge is nearer than the centre distance less one cell's diagonal.
        let safe_m = world.cell_clearance_m(cell) - 1.5 * resolution_m;
        if safe_m > resolution_m {
            range_m += safe_m;
            cell = cell_at(range_m);
            continue;
        }
        let (exit_x, exit_y) = (
            exit_m(origin.x, dx, cell.0, world.origin().x, resolution_m),
            exit_m(origin.y, dy, cell.1, world.origin().y, resolution_m),
        );
        if exit_x < exit_y {
            range_m = exit_x.max(range_m);
            cell.0 += if dx > 0.0 { 1 } else { -1 };
        } else {
            range_m = exit_y.max(range_m);
            cell.1 += if dy > 0.0 { 1 } else { -1 };
        }
    }
    f64::INFINITY
}

/// Range at which a ray leaves a column (or row) of cells.
fn exit_m(from: f64, direction: f64, cell: i64, grid_origin: f64, resolution_m: f64) -> f64 {
    if direction == 0.0 {
        return f64::INFINITY;
    }
    let edge = grid_origin + (cell + i64::from(direction > 0.0)) as f64 * resolution_m;
    (edge - from) / direction
}

fn distance_to_disc(origin: &Point2, angle_rad: f64, disc: &Disc) -> Option<f64> {
    let (dy, dx) = angle_rad.sin_cos();
    let (cx, cy) = (disc.center.x - origin.x, disc.center.y - origin.y);
    let along_m = cx * dx + cy * dy;
    let aside_m = cx * dy - cy * dx;
    let half_chord_squared = disc.radius_m * disc.radius_m - aside_m * aside_m;
    (along_m > 0.0 && half_chord_squared >= 0.0).then(|| along_m - half_chord_squared.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    const ROOM: &str = "
        ####################
        #..................#
        #.......####.......#
        #.......#..........#
        #..................#
        ####################";

    /// Tiny steps until a blocked cell.
    fn by_creeping(world: &World, origin: &Point2, angle_rad: f64, range_max_m: f64) -> f64 {
        let (sin, cos) = angle_rad.sin_cos();
        let at = |step: i32| f64::from(step) * 0.0005;
        (0..(range_max_m / 0.0005) as i32)
            .find(|&step| !world.is_free(&Point2::new(origin.x + at(step) * cos, origin.y + at(step) * sin)))
            .map_or(f64::INFINITY, at)
    }

    proptest! {
        #[test]
        fn agrees_with_creeping(x in 0.6..9.4f64, y in 0.6..2.4f64, angle_rad in -PI..PI) {
            let world = World::drawn(ROOM);
            let origin = Point2::new(x, y);
            prop_assume!(world.is_free(&origin));
            let fast = cast_ray(&world, &origin, angle_rad, 20.0);
            let slow = by_creeping(&world, &origin, angle_rad, 20.0);
            // A ray through the very corner of a cell may take either side.
            prop_assert!((fast - slow).abs() < 0.01 || corner_near(&world, &origin, angle_rad, fast.min(slow)));
        }
    }

    /// Whether turning the ray by a hair changes the answer.
    fn corner_near(world: &World, origin: &Point2, angle_rad: f64, range_m: f64) -> bool {
        [-2e-4, 2e-4]
            .iter()
            .any(|turn| (by_creeping(world, origin, angle_rad + turn, 20.0) - range_m).abs() < 0.02)
    }

    #[test]
    fn sees_walls_people_and_nothing() {
        let world = World::drawn(ROOM);
        let geometry = ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -FRAC_PI_2,
            angle_increment_rad: FRAC_PI_2,
            range_max_m: 6.0,
            robot_from_laser: Pose2::new(0.5, 0.0, 0.0),
        };
        let robot = Pose2::new(1.5, 0.75, 0.0);
        let person = Disc { center: Point2::new(2.0, 2.0), radius_m: 0.25 };
        let ranges = cast_scan(&world, &[person], &geometry, &robot);
        assert!((ranges[0] - 0.25).abs() < 1e-9, "{ranges:?}");
        assert!(ranges[1].is_infinite(), "{ranges:?}");
        assert!((ranges[2] - 1.0).abs() < 1e-9, "{ranges:?}");
        let upon_the_laser = Disc { center: Point2::new(2.0, 0.85), radius_m: 0.25 };
        assert!((cast_scan(&world, &[upon_the_laser], &geometry, &robot)[2] - 1.75).abs() < 1e-9);
    }
}
