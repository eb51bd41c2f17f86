//! Short drives in small buildings, looked for in the map of a longer one.

use super::*;
use crate::config::EngineConfig;
use crate::geometry::{Pose2, angle_between};
use crate::registration::testing::{Wall, drifting, drive, laser, polygon, sense};
use crate::scan::Scan;
use crate::translator::Translator;

/// A ring of corridors whose inner and outer walls jut out here and there.
fn building() -> Vec<Wall> {
    let mut walls = polygon(&[
        (0.0, 0.0),
        (9.0, 0.0),
        (9.0, -1.5),
        (11.0, -1.5),
        (11.0, 0.0),
        (24.0, 0.0),
        (24.0, 6.0),
        (26.5, 6.0),
        (26.5, 9.0),
        (24.0, 9.0),
        (24.0, 16.0),
        (14.0, 16.0),
        (14.0, 15.4),
        (13.0, 15.4),
        (13.0, 16.0),
        (0.0, 16.0),
    ]);
    walls.extend(polygon(&[(2.5, 2.5), (15.0, 2.5), (15.0, 4.0), (21.5, 4.0), (21.5, 13.5), (2.5, 13.5)]));
    walls
}

/// Another one: a hall with two rows of pillars.
fn other_building() -> Vec<Wall> {
    let mut walls = polygon(&[(0.0, 0.0), (30.0, 0.0), (30.0, 14.0), (0.0, 14.0)]);
    for column in 0..5 {
        let x = 4.0 + 5.5 * f64::from(column);
        walls.extend(polygon(&[(x, 4.0), (x + 0.8, 4.0), (x + 0.8, 4.8), (x, 4.8)]));
        walls.extend(polygon(&[(x, 9.0), (x + 0.8, 9.0), (x + 0.8, 9.8), (x, 9.8)]));
    }
    walls
}

/// Scans along a drive with drifting odometry.
fn scans(walls: &[Wall], poses: &[Pose2]) -> Vec<Scan> {
    let odometry = drifting(poses, 1.01, 0.002);
    poses.iter().zip(&odometry).map(|(pose, odom)| sense(walls, &laser(), pose, odom)).collect()
}

/// The index of one loop through the building, placed where it truly is.
fn index(config: &EngineConfig) -> PlaceIndex {
    let poses =
        drive(&[(1.25, 1.25), (22.75, 1.25), (22.75, 14.75), (1.25, 14.75), (1.25, 1.25), (8.0, 1.25)], 0.1);
    let mut translator = Translator::new(&config.translator, laser()).unwrap();
    let mut observations = Vec::new();
    let mut builder = PlaceIndexBuilder::new(&config.recall);
    for (scan, pose) in scans(&building(), &poses).iter().zip(&poses) {
        let read = translator.push(scan);
        observations.extend(read.observations);
        if read.keyframe.is_some() {
            builder.add_scan(0, &laser(), pose, &scan.ranges_m);
        }
    }
    observations.extend(translator.finish().observations);
    let map_from_observations =
        observations.iter().map(|observation| poses[observation.scan_seq as usize]).collect();
    builder.add_run(&observations, PlacedDrive { component: 0, map_from_observations });
    builder.finish()
}

fn ask(config: &EngineConfig, index: &PlaceIndex, scans: &[Scan]) -> Vec<FoundPlace> {
    let example = Example::read(&config.translator, &laser(), scans, &config.recall).unwrap();
    index.find(&example.unwrap(), &config.recall)
}

fn probability_of_first(found: &[FoundPlace]) -> f64 {
    let log_odds: Vec<f64> = found.iter().map(|place| place.log_odds).collect();
    Calibration::probabilities(&log_odds).first().copied().unwrap_or(0.0)
}

#[test]
fn a_short_drive_is_found_either_way_round() {
    let config = EngineConfig::default();
    let index = index(&config);
    assert!(index.num_bytes() > 0);
    let ways = [[(6.0, 1.4), (22.6, 1.4), (22.6, 3.0)], [(22.6, 5.0), (22.6, 1.4), (10.0, 1.4)]];
    for way in ways {
        let poses = drive(&way, 0.1);
        let found = ask(&config, &index, &scans(&building(), &poses));
        let (best, truth) = (&found[0], poses[poses.len() - 1]);
        assert!(best.map_from_robot.distance(&truth) < 0.3, "{best:?} is not {truth:?}");
        assert!(angle_between(best.map_from_robot.theta, truth.theta) < 0.05, "{best:?} is not {truth:?}");
        assert!(probability_of_first(&found) > 0.8, "{found:?}");
        assert!(best.covariance.symmetric_eigenvalues().min() > 0.0);
    }
}

#[test]
fn a_drive_in_another_building_is_not_here() {
    let config = EngineConfig::default();
    let poses = drive(&[(1.5, 6.9), (15.0, 6.9)], 0.1);
    let found = ask(&config, &index(&config), &scans(&other_building(), &poses));
    assert!(probability_of_first(&found) < 0.3, "{found:?}");
}

#[test]
fn nothing_is_found_by_nothing() {
    let config = EngineConfig::default();
    let example = Example::read(&config.translator, &laser(), &[], &config.recall).unwrap();
    assert!(example.is_none());
    let one = scans(&building(), &[Pose2::new(5.0, 1.25, 0.0)]);
    let nowhere = PlaceIndexBuilder::new(&config.recall).finish();
    assert!(ask(&config, &nowhere, &one).is_empty());
    assert!(ask(&config, &index(&config), &one).len() <= config.recall.max_places);
}

#[test]
fn probabilities_leave_room_for_being_nowhere() {
    let all = Calibration::probabilities(&[2.0, 2.0, -30.0]);
    let odds = 2f64.exp();
    assert!((all[0] - odds / (1.0 + 2.0 * odds)).abs() < 1e-9 && all[0] == all[1] && all[2] < 1e-9);
    assert!(Calibration::probabilities(&[]).is_empty());
    assert!(Calibration::probabilities(&[800.0])[0] > 0.999_999);
}
