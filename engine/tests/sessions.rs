//! Sessions in small buildings, scans cast from the map itself.

use std::f64::consts::PI;
use std::sync::Arc;

use locution_engine::geometry::{Point2, Pose2, angle_between};
use locution_engine::locate::{
    LikelihoodFieldConfig, LocalizationEstimate, LocalizationState, Missing, PosePrior, ServedMap,
    SessionConfig, SessionMap, SiteSession,
};
use locution_engine::occupancy::{CellState, GridMap, cast_ray};
use locution_engine::recall::{PlaceIndexBuilder, RecallConfig};
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

/// A map as robots at these poses saw it.
fn seen(grid: &GridMap, poses: &[Pose2]) -> SessionMap {
    let mut builder = PlaceIndexBuilder::new(&RecallConfig::default());
    for pose in poses.iter().step_by(2) {
        builder.add_scan(0, &laser(), pose, &sense(grid, pose, *pose).ranges_m);
    }
    let served = ServedMap::build(grid.clone(), &LikelihoodFieldConfig::default());
    SessionMap { components: vec![(0, Arc::new(served))], index: Arc::new(builder.finish()) }
}

fn session(map: &SessionMap, prior: Option<PosePrior>) -> SiteSession {
    SiteSession::new(laser(), Arc::new(SessionConfig::default()), map.clone(), prior)
}

/// The estimate after each scan.
fn estimates(map: &SessionMap, scans: &[Scan]) -> Vec<LocalizationEstimate> {
    let mut session = session(map, None);
    let estimate = |scan| {
        session.push(scan);
        session.estimate()
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
    let poses = there_and_back();
    let scans = scans_along(&building(), &poses);
    let map = seen(&building(), &poses);
    let found = estimates(&map, &scans);
    assert_eq!(found[0].state, LocalizationState::Lost, "one scan is not enough");
    assert_eq!(found[0].missing, [Missing::Travel]);
    let first_sure = found.iter().position(|estimate| estimate.state == LocalizationState::Converged);
    let first_sure = first_sure.expect("the building is not ambiguous");
    for (estimate, truth) in found.iter().zip(&poses).skip(first_sure) {
        let best = &estimate.hypotheses[0];
        assert!(best.map_from_robot.distance(truth) < 0.3, "{best:?} is not {truth:?}");
        assert!(angle_between(best.map_from_robot.theta, truth.theta) < 0.1, "{best:?} is not {truth:?}");
    }
    assert_eq!(estimates(&map, &scans).last(), found.last(), "it can be repeated");
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
    let apart_m = one.width() as f64 * one.resolution_m();
    let here = there_and_back();
    let twin = here.iter().map(|pose| Pose2::new(pose.x + apart_m, pose.y, pose.theta));
    let everywhere: Vec<Pose2> = here.iter().copied().chain(twin).collect();
    let map = seen(&both, &everywhere);
    let scans = scans_along(&both, &here);
    let all = estimates(&map, &scans);
    for estimate in &all {
        assert_ne!(estimate.state, LocalizationState::Converged, "{estimate:?}");
    }
    let last = all.last().expect("scans were sent");
    assert_eq!(last.state, LocalizationState::Ambiguous);
    assert_eq!(last.hypotheses.len(), 2, "{:?}", last.hypotheses);
    assert!(last.missing.contains(&Missing::Alternatives), "{:?}", last.missing);

    // What nobody can see, somebody may know.
    let rough = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.1]];
    let said = |pose: Pose2| PosePrior::new(0, pose, rough).expect("a covariance");
    let mut told = session(&map, Some(said(here[0])));
    scans.iter().for_each(|scan| told.push(scan));
    let answer = told.estimate();
    assert_eq!(answer.state, LocalizationState::Converged, "{answer:?}");
    assert_eq!(answer.prior_agrees, Some(true));
    assert!(answer.hypotheses[0].map_from_robot.distance(&here[here.len() - 1]) < 0.3, "{answer:?}");
}

#[test]
fn a_declaration_that_is_wrong_is_contradicted() {
    let poses = there_and_back();
    let rough = [[0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.05]];
    let wrong = PosePrior::new(0, Pose2::new(5.0, 11.0, 1.0), rough);
    let mut misled = session(&seen(&building(), &poses), wrong);
    scans_along(&building(), &poses).iter().for_each(|scan| misled.push(scan));
    let answer = misled.estimate();
    assert_eq!(answer.prior_agrees, Some(false), "{answer:?}");
    assert!(answer.hypotheses[0].map_from_robot.distance(&poses[poses.len() - 1]) < 0.3, "{answer:?}");
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
    let map = seen(&building(), &there_and_back());
    let all = estimates(&map, &scans_along(&hall, &poses));
    for estimate in &all {
        assert_ne!(estimate.state, LocalizationState::Converged, "{estimate:?}");
        let named: f64 = estimate.hypotheses.iter().map(|place| place.probability).sum();
        assert!(named + estimate.probability_elsewhere < 1.0 + 1e-9, "{estimate:?}");
    }
    let last = all.last().expect("scans were sent");
    assert_eq!((last.state, last.probability_elsewhere > 0.5), (LocalizationState::Lost, true), "{last:?}");
}

#[test]
fn a_robot_that_is_carried_away_is_found_again() {
    let poses = there_and_back();
    let map = seen(&building(), &poses);
    let mut scans = scans_along(&building(), &poses);
    // Odometry goes on as if nothing had happened, but the robot finds itself in the larger room.
    let offset = scans[scans.len() - 1].odom_from_robot;
    let again = scans_along(&building(), &poses[60..]);
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
    let nothing = GridMap::unknown(30, 30, 0.1, Point2::default());
    let map = seen(&nothing, &[]);
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
