//! The recent surroundings of the robot: the beam ends of its last metres as one cloud.

use std::collections::BTreeSet;

use super::sweep::evenly;
use super::track::Moment;
use crate::geometry::Point2;

/// Ends seen during the last `travel_m` metres, in the frame of the last moment, at most one per 0.2 m cell, none
/// farther than `reach_m`, at most `max_points`.
pub(super) fn surroundings<'a>(
    moments: impl IntoIterator<Item = &'a Moment, IntoIter: DoubleEndedIterator>,
    travel_m: f64,
    reach_m: f64,
    max_points: usize,
) -> Vec<Point2> {
    /// Ends in one cell of this edge count once.
    const CELL_M: f64 = 0.2;
    let mut cells = BTreeSet::new();
    let mut points = Vec::new();
    let mut last: Option<&Moment> = None;
    for moment in moments.into_iter().rev() {
        let latest = *last.get_or_insert(moment);
        if latest.travel_m - moment.travel_m > travel_m {
            break;
        }
        let latest_from_moment = latest.run_from_robot.between(&moment.run_from_robot);
        for point in moment.sweep.ends.iter().map(|end| latest_from_moment.transform_point(end)) {
            let cell = ((point.x / CELL_M).floor() as i64, (point.y / CELL_M).floor() as i64);
            if point.x.hypot(point.y) <= reach_m && cells.insert(cell) {
                points.push(point);
            }
        }
    }
    evenly(&points, max_points)
}
