//! Sessions in small buildings, scans cast from the map itself.

use std::f64::consts::PI;

use locution_engine::geometry::{Point2, Pose2, angle_between};
use locution_engine::locate::{
    LikelihoodFieldConfig, LocalizationEstimate, LocalizationState, Localizer, LocalizerConfig, ServedMap,
};
use locution_engine::occupancy::{CellState, GridMap, cast_ray};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_lab::small_building::{building, drive};

fn laser() -> ScanGeometry {
    ScanGeometry {
        num_ranges: 121,
        angle_min_rad: -PI / 2.0,
        angle_increment_rad: PI / 120.0,
        range_max_m: 20.0,
        robot_from_laser: Pose2::new(0.1, 0.0, 0.0),
    }
}

/// What a robot at `pose` senses whose odometry says `odom_from_robot`.
fn sense(map: &GridMap, pose: &Pose2, odom_from_robot: Pose2) -> Scan {
    let laser = laser();
    let map_from_laser = pose.compose(&laser.robot_from_laser);
    let range = |beam| {
        let angle = map_from_laser.theta + laser.beam_angle_rad(beam);
        cast_ray(map, &map_from_laser.position(), angle, 25.0) as f32
    };
    Scan { timestamp_ns: 0, odom_from_robot, ranges_m: (0..laser.num_ranges).map(range).collect() }
}

/// Scans along a drive, odometry starting at zero.
fn scans_along(map: &GridMap, poses: &[Pose2]) -> Vec<Scan> {
    poses.iter().map(|pose| sense(map, pose, poses[0].between(pose))).collect()
}

fn served(grid: GridMap) -> ServedMap {
    ServedMap::build(grid, &LikelihoodFieldConfig::default())
}

/// The estimate after each scan.
fn estimates(map: &ServedMap, scans: &[Scan]) -> Vec<LocalizationEstimate> {
    let mut localizer = Localizer::new(laser(), LocalizerConfig::default());
    let estimate = |scan| {
        localizer.push(map, scan);
        localizer.estimate(map)
    };
    scans.iter().map(estimate).collect()
}

/// The drive, ended by a way back so that there is enough of it.
fn there_and_back() -> Vec<Pose2> {
    let mut poses = drive();
    let back: Vec<Pose2> =
        poses.iter().rev().map(|pose| Pose2::new(pose.x, pose.y, pose.theta + PI)).collect();
    poses.extend(back);
    poses
}

#[test]
fn a_robot_that_wakes_up_is_found_where_it_is() {
    let map = served(building());
    let poses = there_and_back();
    let found = estimates(&map, &scans_along(&map.grid, &poses));
    assert_eq!(found[0].state, LocalizationState::Lost, "one scan is not enough");
    let first_sure = found.iter().position(|estimate| estimate.state == LocalizationState::Converged);
    let first_sure = first_sure.expect("the building is not ambiguous");
    for (estimate, truth) in found.iter().zip(&poses).skip(first_sure) {
        let best = &estimate.hypotheses[0];
        assert!(best.map_from_robot.distance(truth) < 0.3, "{best:?} is not {truth:?}");
        assert!(angle_between(best.map_from_robot.theta, truth.theta) < 0.1, "{best:?} is not {truth:?}");
    }
    assert_eq!(estimates(&map, &scans_along(&map.grid, &poses)).last(), found.last(), "it can be repeated");
}

#[test]
fn two_buildings_alike_stay_ambiguous() {
    let one = building();
    let mut both = GridMap::unknown(2 * one.width(), one.height(), one.resolution_m(), one.origin());
    for (cell, state) in one.cells().iter().enumerate() {
        let (column, row) = ((cell % one.width()) as i64, (cell / one.width()) as i64);
        both.set(column, row, *state);
        both.set(column + one.width() as i64, row, *state);
    }
    let map = served(both);
    for estimate in estimates(&map, &scans_along(&map.grid, &there_and_back())) {
        assert_ne!(estimate.state, LocalizationState::Converged, "{estimate:?}");
    }
    let last = estimates(&map, &scans_along(&map.grid, &there_and_back())).pop().expect("scans were sent");
    assert_eq!(last.state, LocalizationState::Ambiguous);
    assert_eq!(last.hypotheses.len(), 2, "{:?}", last.hypotheses);
}

#[test]
fn a_robot_elsewhere_is_never_found() {
    // A hall with pillars has nothing to do with the building.
    let mut hall = GridMap::unknown(220, 220, 0.1, Point2::new(-11.0, -11.0));
    for (column, row) in (0..220).flat_map(|x| (0..220).map(move |y| (x, y))) {
        let is_wall = column < 3 || row < 3 || column > 216 || row > 216 || (column % 50 < 6 && row % 50 < 6);
        hall.set(column, row, if is_wall { CellState::Occupied } else { CellState::Free });
    }
    let poses: Vec<Pose2> = (0..120).map(|step| Pose2::new(-8.0 + 0.1 * f64::from(step), 1.5, 0.0)).collect();
    let map = served(building());
    for estimate in estimates(&map, &scans_along(&hall, &poses)) {
        assert_ne!(estimate.state, LocalizationState::Converged, "{estimate:?}");
    }
}

#[test]
fn a_robot_that_is_carried_away_is_found_again() {
    let map = served(building());
    let poses = there_and_back();
    let mut scans = scans_along(&map.grid, &poses);
    // Odometry goes on as if nothing had happened, but the robot finds itself in the larger room.
    let offset = scans[scans.len() - 1].odom_from_robot;
    let again = scans_along(&map.grid, &poses[60..]);
    scans.extend(
        again.into_iter().map(|scan| Scan { odom_from_robot: offset.compose(&scan.odom_from_robot), ..scan }),
    );
    let last = estimates(&map, &scans).pop().expect("scans were sent");
    let truth = poses[poses.len() - 1];
    assert_eq!(last.state, LocalizationState::Converged);
    assert!(
        last.hypotheses[0].map_from_robot.distance(&truth) < 0.3,
        "{:?} is not {truth:?}",
        last.hypotheses[0]
    );
}

#[test]
fn a_map_of_nothing_and_scans_of_nothing_are_survived() {
    let map = served(GridMap::unknown(30, 30, 0.1, Point2::default()));
    let blind = |step: i32| Scan {
        timestamp_ns: 0,
        odom_from_robot: Pose2::new(0.3 * f64::from(step), 0.0, 0.0),
        ranges_m: vec![f32::NAN; laser().num_ranges],
    };
    let scans: Vec<Scan> = (0..30).map(blind).collect();
    let last = estimates(&map, &scans).pop().expect("scans were sent");
    assert_eq!(last.state, LocalizationState::Lost);
    assert!(last.hypotheses.is_empty());
}
