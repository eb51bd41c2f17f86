//! A building of two rooms and a drive through it, for tests of localisation.

use locution_engine::geometry::{Point2, Pose2};
use locution_engine::occupancy::{CellState, GridMap};

/// Two rooms of different size on a corridor, 12 × 9 m.
pub fn building() -> GridMap {
    let mut map = GridMap::unknown(120, 90, 0.1, Point2::new(-4.0, 7.0));
    let mut fill = |columns: std::ops::Range<i64>, rows: std::ops::Range<i64>, state| {
        for (column, row) in columns.flat_map(|x| rows.clone().map(move |y| (x, y))) {
            map.set(column, row, state);
        }
    };
    fill(5..115, 5..85, CellState::Occupied);
    fill(7..113, 7..27, CellState::Free);
    fill(7..45, 30..80, CellState::Free);
    fill(50..113, 30..60, CellState::Free);
    fill(20..30, 27..30, CellState::Free);
    fill(90..99, 27..30, CellState::Free);
    map
}

/// A drive along the corridor, through the door and round the larger room.
pub fn drive() -> Vec<Pose2> {
    let corners: [(f64, f64); 6] =
        [(-3.0, 8.7), (-1.5, 8.7), (-1.5, 11.0), (-0.3, 14.3), (-2.6, 14.3), (-2.6, 11.0)];
    let mut poses = Vec::new();
    for pair in corners.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let (heading, length): (f64, f64) = ((y1 - y0).atan2(x1 - x0), (x1 - x0).hypot(y1 - y0));
        let num_steps = (length / 0.1) as usize;
        poses.extend((0..num_steps).map(|step| {
            let share = step as f64 / num_steps as f64;
            Pose2::new(x0 + share * (x1 - x0), y0 + share * (y1 - y0), heading)
        }));
    }
    poses
}
