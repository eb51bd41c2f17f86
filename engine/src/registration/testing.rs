//! Rooms made of straight walls, and a laser that sees them: for tests.

use crate::geometry::{Point2, Pose2};
use crate::scan::{Scan, ScanGeometry};

/// A wall from one point to another.
pub type Wall = (Point2, Point2);

/// A laser of 180 beams over 180°, 30 m.
pub fn laser() -> ScanGeometry {
    ScanGeometry {
        num_ranges: 180,
        angle_min_rad: -std::f64::consts::FRAC_PI_2,
        angle_increment_rad: 1f64.to_radians(),
        range_max_m: 30.0,
        robot_from_laser: Pose2::new(0.1, 0.0, 0.0),
    }
}

/// The walls of a closed polygon.
pub fn polygon(corners: &[(f64, f64)]) -> Vec<Wall> {
    (0..corners.len())
        .map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            (Point2::new(a.0, a.1), Point2::new(b.0, b.1))
        })
        .collect()
}

/// What the laser sees from `world_from_robot`, while the odometry says `odom_from_robot`.
pub fn sense(
    walls: &[Wall],
    geometry: &ScanGeometry,
    world_from_robot: &Pose2,
    odom_from_robot: &Pose2,
) -> Scan {
    let world_from_laser = world_from_robot.compose(&geometry.robot_from_laser);
    let ranges_m = (0..geometry.num_ranges)
        .map(|beam| {
            let angle = world_from_laser.theta + geometry.beam_angle_rad(beam);
            let nearest = walls.iter().filter_map(|wall| hit(wall, &world_from_laser.position(), angle));
            nearest.fold(geometry.range_max_m, f64::min) as f32
        })
        .collect();
    Scan { timestamp_ns: 0, odom_from_robot: *odom_from_robot, angular_velocity_rad_per_s: None, ranges_m }
}

fn hit(wall: &Wall, from: &Point2, angle_rad: f64) -> Option<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    let (ex, ey) = (wall.1.x - wall.0.x, wall.1.y - wall.0.y);
    let (wx, wy) = (wall.0.x - from.x, wall.0.y - from.y);
    let determinant = ex * sin - ey * cos;
    if determinant.abs() < 1e-12 {
        return None;
    }
    let range = (ex * wy - ey * wx) / determinant;
    let share = (cos * wy - sin * wx) / determinant;
    (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
}

/// Poses every `step_m` along straight lines between the corners, facing along.
pub fn drive(corners: &[(f64, f64)], step_m: f64) -> Vec<Pose2> {
    let mut poses: Vec<Pose2> = Vec::new();
    for pair in corners.windows(2) {
        let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let theta = dy.atan2(dx);
        if let Some(last) = poses.last().copied() {
            let turn = crate::geometry::wrap_angle(theta - last.theta);
            let num_turns = (turn.abs() / 0.15).ceil() as usize;
            poses.extend(
                (1..num_turns)
                    .map(|k| Pose2::new(last.x, last.y, last.theta + turn * k as f64 / num_turns as f64)),
            );
        }
        let num_steps = (dx.hypot(dy) / step_m).round() as usize;
        poses.extend((0..num_steps).map(|k| {
            let share = k as f64 / num_steps as f64;
            Pose2::new(pair[0].0 + share * dx, pair[0].1 + share * dy, theta)
        }));
    }
    poses
}

/// Odometry that stretches every distance and bends every metre, seen from the first pose.
pub fn drifting(poses: &[Pose2], stretch: f64, bend_rad_per_m: f64) -> Vec<Pose2> {
    let mut odometry = vec![Pose2::identity()];
    for pair in poses.windows(2) {
        let step = pair[0].between(&pair[1]);
        let bent = Pose2::new(
            step.x * stretch,
            step.y * stretch,
            step.theta + bend_rad_per_m * step.x.hypot(step.y),
        );
        let last = odometry[odometry.len() - 1];
        odometry.push(last.compose(&bent));
    }
    odometry
}
