//! From a chain of cells to a smooth curve.

use rand::{Rng, RngExt};

use super::world::World;
use locution_engine::geometry::Point2;

/// Distance between the points of a path.
pub(super) const STEP_M: f64 = 0.05;

/// How often every point is drawn towards the middle of its neighbours; rounds corners over about half a metre.
const SMOOTHING_ROUNDS: usize = 160;

/// Points [`STEP_M`] apart along a curve that nowhere comes nearer to a wall than the way it was made from, or than
/// `comfort_m` where that way kept more.
pub(super) fn smooth_path(world: &World, way: &[Point2], comfort_m: f64) -> Vec<Point2> {
    let mut path = resample(way);
    for _ in 0..SMOOTHING_ROUNDS {
        for idx in 1..path.len().saturating_sub(1) {
            let (before, here, after) = (path[idx - 1], path[idx], path[idx + 1]);
            let moved = Point2::new(
                0.5 * here.x + 0.25 * (before.x + after.x),
                0.5 * here.y + 0.25 * (before.y + after.y),
            );
            if world.clearance_m(&moved) >= world.clearance_m(&here).min(comfort_m) {
                path[idx] = moved;
            }
        }
    }
    resample(&path)
}

/// Nobody drives the same line twice: shifts the path sideways by a slow random swing of up to `swing_m`, less where
/// it would come nearer to a wall than `clearance_m`. Both ends stay.
pub(super) fn sway(
    world: &World,
    path: &[Point2],
    (swing_m, clearance_m): (f64, f64),
    rng: &mut impl Rng,
) -> Vec<Point2> {
    // Three waves of 7 to 25 m; their phases are what is random.
    let waves: Vec<(f64, f64)> = [7.0, 13.0, 25.0]
        .iter()
        .map(|length_m| (std::f64::consts::TAU / length_m, rng.random_range(0.0..std::f64::consts::TAU)))
        .collect();
    let length_m = path.len().saturating_sub(1) as f64 * STEP_M;
    let swayed: Vec<Point2> = path
        .iter()
        .enumerate()
        .map(|(idx, here)| {
            let along_m = idx as f64 * STEP_M;
            let swing: f64 =
                waves.iter().map(|(rate, phase)| (rate * along_m + phase).sin()).sum::<f64>() / 3.0;
            let fade = (along_m.min(length_m - along_m) / 2.0).clamp(0.0, 1.0);
            let (before, after) = (path[idx.saturating_sub(4)], path[(idx + 4).min(path.len() - 1)]);
            let (dx, dy) = (after.x - before.x, after.y - before.y);
            let chord_m = dx.hypot(dy).max(1e-9);
            let room_m = (world.clearance_m(here) - clearance_m).max(0.0);
            let aside_m = (swing_m * swing * fade).clamp(-room_m, room_m);
            Point2::new(here.x - aside_m * dy / chord_m, here.y + aside_m * dx / chord_m)
        })
        .collect();
    resample(&swayed)
}

/// The same polyline as points [`STEP_M`] apart, both ends kept.
fn resample(way: &[Point2]) -> Vec<Point2> {
    let Some(&first) = way.first() else { return Vec::new() };
    let mut points = vec![first];
    let mut until_next_m = STEP_M;
    for pair in way.windows(2) {
        let length_m = pair[0].distance(&pair[1]);
        let mut along_m = until_next_m;
        while along_m <= length_m {
            let share = along_m / length_m;
            points.push(Point2::new(
                pair[0].x + share * (pair[1].x - pair[0].x),
                pair[0].y + share * (pair[1].y - pair[0].y),
            ));
            along_m += STEP_M;
        }
        until_next_m = along_m - length_m;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn corners_are_rounded_but_walls_are_kept_away_from() {
        let world = World::drawn(
            "
            ##########
            #........#
            #........#
            #.....####
            #.....####
            ##########",
        );
        let way = [Point2::new(0.9, 0.9), Point2::new(0.9, 1.9), Point2::new(4.2, 1.9)];
        let path = smooth_path(&world, &way, 0.3);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let swayed = sway(&world, &path, (0.3, 0.2), &mut rng);
        assert!(swayed.iter().all(|point| world.clearance_m(point) > 0.15));
        assert!(swayed[0] == path[0] && swayed != path);
        assert!(path.iter().all(|point| world.clearance_m(point) > 0.25));
        let sharpest = path.windows(3).map(|at| {
            let heading = |a: Point2, b: Point2| (b.y - a.y).atan2(b.x - a.x);
            locution_engine::geometry::angle_between(heading(at[0], at[1]), heading(at[1], at[2]))
        });
        assert!(sharpest.fold(0.0, f64::max) < 0.3);
        assert!(path.windows(2).all(|pair| (pair[0].distance(&pair[1]) - STEP_M).abs() < 0.01));
    }
}
