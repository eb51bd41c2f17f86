//! The returns of one scan, thinned so that near walls do not outvote far ones.

use crate::geometry::{Point2, Pose2};
use crate::scan::ScanGeometry;

/// Returns of a scan in the robot's frame, at least `spacing_m` apart along the sweep and not farther than
/// `limit_m`.
///
/// A laser puts a hundred returns on a wall at arm's length and three on one at the end of a hall; thinning by
/// distance makes every metre of wall count about the same. At most `max_points` are kept, evenly spread.
pub fn thinned_points(
    geometry: &ScanGeometry,
    ranges_m: &[f32],
    spacing_m: f64,
    limit_m: f64,
    max_points: usize,
) -> Vec<Point2> {
    let mut points: Vec<Point2> = Vec::new();
    for (_, point) in geometry.endpoints(ranges_m, limit_m) {
        if points.last().is_none_or(|last| last.distance(&point) >= spacing_m) {
            points.push(point);
        }
    }
    if points.len() <= max_points {
        return points;
    }
    (0..max_points).map(|k| points[k * points.len() / max_points]).collect()
}

/// The points moved by `target_from_source`.
pub fn transformed(points: &[Point2], target_from_source: &Pose2) -> Vec<Point2> {
    let (sin, cos) = target_from_source.theta.sin_cos();
    points
        .iter()
        .map(|point| {
            Point2::new(
                target_from_source.x + cos * point.x - sin * point.y,
                target_from_source.y + sin * point.x + cos * point.y,
            )
        })
        .collect()
}
