//! Along a path at a natural speed: turn on the spot to face it, speed up, slow down in bends and before the end.

use super::config::DriveConfig;
use super::path::STEP_M;
use locution_engine::geometry::{Point2, Pose2, wrap_angle};

/// Poses one scan period apart, from `start` (not included) along the path to its end.
pub(super) fn drive_along(path: &[Point2], start: &Pose2, config: &DriveConfig) -> Vec<Pose2> {
    if path.len() < 3 {
        return Vec::new();
    }
    let headings_rad = headings(path);
    let speeds = speed_limits(&headings_rad, config);
    let mut poses = turn_on_the_spot(
        &Pose2 { theta: start.theta, ..pose_at(path, &headings_rad, 0.0) },
        headings_rad[0],
        config,
    );
    let length_m = (path.len() - 1) as f64 * STEP_M;
    let (mut along_m, mut speed) = (0.0, 0.0f64);
    while along_m < length_m {
        let limit = speeds[((along_m / STEP_M) as usize).min(speeds.len() - 1)];
        // A crawl remains at the ends, or the robot would never leave them.
        speed = (speed + config.acceleration_m_per_s2 * config.scan_period_s).min(limit).max(0.05);
        along_m = (along_m + speed * config.scan_period_s).min(length_m);
        poses.push(pose_at(path, &headings_rad, along_m));
    }
    poses
}

/// Heading at each point: the chord from a little before to a little after.
fn headings(path: &[Point2]) -> Vec<f64> {
    let reach = 3;
    (0..path.len())
        .map(|idx| {
            let before = path[idx.saturating_sub(reach)];
            let after = path[(idx + reach).min(path.len() - 1)];
            (after.y - before.y).atan2(after.x - before.x)
        })
        .collect()
}

/// Top speed at each point, such that neither turn rate nor acceleration is exceeded on the way there.
fn speed_limits(headings_rad: &[f64], config: &DriveConfig) -> Vec<f64> {
    let mut limits: Vec<f64> = (0..headings_rad.len())
        .map(|idx| {
            let next = headings_rad[(idx + 1).min(headings_rad.len() - 1)];
            let bend_rad_per_m = wrap_angle(next - headings_rad[idx]).abs() / STEP_M;
            config.speed_m_per_s.min(config.turn_rate_rad_per_s / bend_rad_per_m.max(1e-9))
        })
        .collect();
    if let Some(last) = limits.last_mut() {
        *last = 0.0;
    }
    for idx in (0..limits.len().saturating_sub(1)).rev() {
        let reachable = (limits[idx + 1].powi(2) + 2.0 * config.acceleration_m_per_s2 * STEP_M).sqrt();
        limits[idx] = limits[idx].min(reachable);
    }
    limits
}

fn turn_on_the_spot(start: &Pose2, to_rad: f64, config: &DriveConfig) -> Vec<Pose2> {
    let turn_rad = wrap_angle(to_rad - start.theta);
    let num_steps = (turn_rad.abs() / (config.turn_rate_rad_per_s * config.scan_period_s)).ceil() as usize;
    (1..=num_steps)
        .map(|step| Pose2::new(start.x, start.y, start.theta + turn_rad * step as f64 / num_steps as f64))
        .collect()
}

fn pose_at(path: &[Point2], headings_rad: &[f64], along_m: f64) -> Pose2 {
    let idx = ((along_m / STEP_M) as usize).min(path.len() - 2);
    let share = along_m / STEP_M - idx as f64;
    let turn_rad = wrap_angle(headings_rad[idx + 1] - headings_rad[idx]);
    Pose2::new(
        path[idx].x + share * (path[idx + 1].x - path[idx].x),
        path[idx].y + share * (path[idx + 1].y - path[idx].y),
        headings_rad[idx] + share * turn_rad,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_faster_than_allowed_and_arrives() {
        let config = DriveConfig::default();
        let mut path: Vec<Point2> = (0..100).map(|idx| Point2::new(idx as f64 * STEP_M, 0.0)).collect();
        path.extend((1..100).map(|idx| {
            let angle = f64::from(idx) * STEP_M;
            Point2::new(99.0 * STEP_M + angle.sin(), 1.0 - angle.cos())
        }));
        let start = Pose2::new(0.0, 0.0, 2.0);
        let poses = drive_along(&path, &start, &config);
        let mut last = start;
        for pose in &poses {
            let turn_rad = wrap_angle(pose.theta - last.theta).abs();
            assert!(last.distance(pose) <= config.speed_m_per_s * config.scan_period_s + 1e-9);
            assert!(turn_rad <= 1.5 * config.turn_rate_rad_per_s * config.scan_period_s, "{turn_rad}");
            last = *pose;
        }
        assert!(last.position().distance(&path[path.len() - 1]) < 1e-9);
    }
}
