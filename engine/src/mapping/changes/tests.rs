//! A laser in a room from which things go and into which things come.

use super::*;

/// A box in the world: low corner, high corner.
type Block = ((f64, f64), (f64, f64));

fn laser() -> ScanGeometry {
    ScanGeometry {
        num_ranges: 180,
        angle_min_rad: -std::f64::consts::FRAC_PI_2,
        angle_increment_rad: std::f64::consts::PI / 180.0,
        range_max_m: 30.0,
        robot_from_laser: Pose2::identity(),
    }
}

/// Distance along a ray to the room's walls or the nearest box.
fn range_m(pose: &Pose2, angle_rad: f64, blocks: &[Block]) -> f32 {
    let (sin, cos) = (pose.theta + angle_rad).sin_cos();
    let slab = |from: f64, way: f64, low: f64, high: f64| {
        let (a, b) = ((low - from) / way, (high - from) / way);
        (a.min(b), a.max(b))
    };
    let room = {
        let (_, x) = slab(pose.x, cos, 0.0, 12.0);
        let (_, y) = slab(pose.y, sin, 0.0, 4.0);
        x.min(y)
    };
    let hit = |((x0, y0), (x1, y1)): &Block| {
        let (x, y) = (slab(pose.x, cos, *x0, *x1), slab(pose.y, sin, *y0, *y1));
        let (enter, leave) = (x.0.max(y.0), x.1.min(y.1));
        (enter <= leave && enter > 0.0).then_some(enter)
    };
    blocks.iter().filter_map(hit).fold(room, f64::min) as f32
}

/// A drive down the room and back, poses off by `error_m`.
fn drive(blocks: &[Block], error_m: f64) -> (Vec<Keyframe>, Vec<Pose2>) {
    let there = (0..50).map(|k| Pose2::new(1.0 + 0.2 * f64::from(k), 2.0, 0.0));
    let back = (0..50).map(|k| Pose2::new(11.0 - 0.2 * f64::from(k), 2.0, std::f64::consts::PI));
    let poses: Vec<Pose2> = there.chain(back).collect();
    let keyframe = |pose: &Pose2| Keyframe {
        scan_seq: 0,
        timestamp_ns: 0,
        odom_from_robot: *pose,
        run_from_robot: *pose,
        motion_covariance: [[0.0; 3]; 3],
        ranges_m: (0..180).map(|k| range_m(pose, laser().beam_angle_rad(k), blocks)).collect(),
    };
    let keyframes = poses.iter().map(keyframe).collect();
    (keyframes, poses.iter().map(|pose| Pose2::new(pose.x + error_m, pose.y - error_m, pose.theta)).collect())
}

fn compare(before: &[Block], after: &[Block], error_m: f64, densities: [f32; 2]) -> Vec<Change> {
    let geometry = laser();
    let (old, new) = (drive(before, 0.0), drive(after, error_m));
    let samples = densities.map(|density| [(Point2::new(6.0, 2.0), density)]);
    let old = PlacedRun {
        geometry: &geometry,
        keyframes: &old.0,
        map_from_keyframes: &old.1,
        densities: &samples[0],
    };
    let new = PlacedRun { keyframes: &new.0, map_from_keyframes: &new.1, densities: &samples[1], ..old };
    find_changes(&[old], &[new], &ChangesConfig::default()).unwrap()
}

const SHELF: Block = ((5.5, 3.2), (6.5, 3.7));
const PALLET: Block = ((8.0, 0.4), (8.8, 1.0));

#[test]
fn nothing_changed_where_nothing_changed() {
    assert!(compare(&[SHELF], &[SHELF], 0.0, [0.5, 0.5]).is_empty());
    assert!(compare(&[SHELF], &[SHELF], 0.08, [0.5, 0.5]).is_empty(), "poses are never exact");
}

#[test]
fn furniture_that_came_and_went_is_found() {
    let changes = compare(&[SHELF], &[PALLET], 0.05, [0.5, 0.7]);
    let find = |kind, x: f64, y: f64| {
        changes.iter().find(|c| c.kind == kind && c.center.distance(&Point2::new(x, y)) < 0.6)
    };
    let came = find(ChangeKind::Appeared, 8.4, 0.9).unwrap();
    assert!(came.high.x - came.low.x > 0.5 && came.confidence > 0.5, "{came:?}");
    let went = find(ChangeKind::Disappeared, 6.0, 3.3).unwrap();
    assert!(went.density_change.is_some_and(|change| (change - 0.2).abs() < 1e-6));
    assert_eq!(changes.len(), 2, "{changes:?}");
}

#[test]
fn densities_of_the_wrong_sign_lower_the_confidence() {
    let confidence = |densities| {
        let changes = compare(&[SHELF], &[], 0.0, densities);
        assert_eq!(changes.len(), 1);
        changes[0].confidence
    };
    assert!(confidence([0.7, 0.5]) < 0.6 * confidence([0.5, 0.7]));
}

#[test]
fn impossible_settings_name_the_field() {
    let config = ChangesConfig { free_share_max: f64::NAN, ..ChangesConfig::default() };
    assert_eq!(find_changes(&[], &[], &config).unwrap_err().field, "changes.free_share_max");
}

#[test]
fn a_change_is_dated_between_the_last_visit_before_and_the_first_after() {
    let geometry = laser();
    let visits = [&[SHELF][..], &[SHELF], &[], &[]].map(|blocks| drive(blocks, 0.0));
    let placed: Vec<PlacedRun<'_>> = visits
        .iter()
        .map(|(keyframes, poses)| PlacedRun {
            geometry: &geometry,
            keyframes,
            map_from_keyframes: poses,
            densities: &[],
        })
        .collect();
    let dated = |before: std::ops::Range<usize>, after: std::ops::Range<usize>| {
        let found = find_changes(&placed[before], &placed[after], &ChangesConfig::default()).unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
        (found[0].last_as_before, found[0].first_as_after)
    };
    assert_eq!(dated(0..2, 2..4), (Some(1), Some(2)));
    assert_eq!(dated(0..1, 2..3), (Some(0), Some(1)));
}
