//! The refiner on a simulated drive through offices.

use super::config::RefinerConfig;
use super::lost::CutReason;
use super::refiner::OdometryRefiner;
use super::testing::{Wall, drifting, drive, laser, polygon, sense};
use crate::geometry::Pose2;
use crate::scan::Scan;

fn offices() -> Vec<Wall> {
    let mut walls = polygon(&[(0.0, 0.0), (14.0, 0.0), (14.0, 9.0), (0.0, 9.0)]);
    walls.extend(polygon(&[(5.0, 3.0), (9.0, 3.0), (9.0, 6.0), (5.0, 6.0)]));
    walls.extend(polygon(&[(2.0, 7.5), (2.6, 7.5), (2.6, 8.2), (2.0, 8.2)]));
    walls
}

fn recording() -> (Vec<Pose2>, Vec<Scan>) {
    let truth = drive(&[(1.5, 1.5), (12.0, 1.5), (12.0, 7.5), (2.0, 7.0)], 0.1);
    let odometry = drifting(&truth, 1.03, 0.02);
    let scans = truth.iter().zip(&odometry).map(|(at, odom)| sense(&offices(), &laser(), at, odom)).collect();
    (truth, scans)
}

#[test]
fn drift_is_taken_out() {
    let (truth, scans) = recording();
    let mut refiner = OdometryRefiner::new(&RefinerConfig::default());
    let refined: Vec<_> = scans.iter().map(|scan| refiner.refine(&laser(), scan)).collect();
    let last = truth.len() - 1;
    let driven = truth[0].between(&truth[last]);
    let estimated = refined[0].run_from_robot.between(&refined[last].run_from_robot);
    let raw = scans[0].odom_from_robot.between(&scans[last].odom_from_robot);
    assert!(raw.distance(&driven) > 1.0, "the odometry of this test should be bad: {raw:?}");
    assert!(estimated.distance(&driven) < 0.06, "{estimated:?} is not {driven:?}");
    let num_keyframes = refined.iter().filter(|scan| scan.keyframe.is_some()).count();
    assert!(num_keyframes * 4 > truth.len() && num_keyframes < truth.len());
}

#[test]
fn a_restored_refiner_continues_with_the_same_bytes() {
    let (_, scans) = recording();
    let mut straight = OdometryRefiner::new(&RefinerConfig::default());
    let mut restored = straight.clone();
    for (index, scan) in scans.iter().enumerate() {
        if index % 37 == 5 {
            let bytes = postcard::to_stdvec(&restored).unwrap();
            assert!(bytes.len() < 150 * 1024);
            restored = postcard::from_bytes(&bytes).unwrap();
        }
        assert_eq!(straight.refine(&laser(), scan), restored.refine(&laser(), scan));
    }
    assert_eq!(postcard::to_stdvec(&straight).unwrap(), postcard::to_stdvec(&restored).unwrap());
}

/// How far the refined poses go wrong from the first scan to any other, metres and radians.
fn worst_error(truth: &[Pose2], scans: &[Scan]) -> (f64, f64) {
    let mut refiner = OdometryRefiner::new(&RefinerConfig::default());
    let refined: Vec<Pose2> =
        scans.iter().map(|scan| refiner.refine(&laser(), scan).run_from_robot).collect();
    truth.iter().zip(&refined).fold((0.0, 0.0), |worst: (f64, f64), (at, found)| {
        let error = truth[0].between(at).between(&refined[0].between(found));
        (worst.0.max(error.x.hypot(error.y)), worst.1.max(error.theta.abs()))
    })
}

/// The recording with a step put into its odometry half way, as seen from the robot there.
fn recording_with_step(step: &Pose2) -> (Vec<Pose2>, Vec<Scan>) {
    let (truth, mut scans) = recording();
    let middle = scans.len() / 2;
    let before = scans[middle].odom_from_robot;
    for scan in &mut scans[middle..] {
        scan.odom_from_robot = before.compose(step).compose(&before.between(&scan.odom_from_robot));
    }
    (truth, scans)
}

#[test]
fn a_heading_that_turns_at_once_is_put_right_by_the_scans() {
    for degrees in [45.0f64, 60.0, 90.0, -90.0, 180.0] {
        let (truth, scans) = recording_with_step(&Pose2::new(0.0, 0.0, degrees.to_radians()));
        let (place_m, turn) = worst_error(&truth, &scans);
        assert!(place_m < 0.1 && turn < 0.02, "{degrees}°: {place_m} m, {turn} rad");
    }
}

#[test]
fn a_position_that_steps_aside_is_put_right_by_the_scans() {
    for (x, y) in [(0.0, 3.0), (2.0, 0.0), (-40.0, 30.0)] {
        let (truth, scans) = recording_with_step(&Pose2::new(x, y, 0.0));
        let (place_m, turn) = worst_error(&truth, &scans);
        assert!(place_m < 0.1 && turn < 0.02, "({x}, {y}): {place_m} m, {turn} rad");
    }
}

#[test]
fn odometry_that_runs_backwards_or_stands_is_overruled() {
    for sign in [-1.0, 0.0] {
        let (truth, clean) = recording();
        let mut scans = clean.clone();
        for idx in 1..scans.len() {
            let motion = clean[idx - 1].odom_from_robot.between(&clean[idx].odom_from_robot);
            let told = if (40..70).contains(&idx) {
                Pose2::new(sign * motion.x, sign * motion.y, sign.abs() * motion.theta)
            } else {
                motion
            };
            scans[idx].odom_from_robot = scans[idx - 1].odom_from_robot.compose(&told);
        }
        let (place_m, turn) = worst_error(&truth, &scans);
        assert!(place_m < 0.1 && turn < 0.02, "{sign}: {place_m} m, {turn} rad");
    }
}

#[test]
fn without_odometry_the_laser_alone_finds_the_way() {
    let (truth, mut scans) = recording();
    for scan in &mut scans {
        scan.odom_from_robot = Pose2::identity();
    }
    let (place_m, turn) = worst_error(&truth, &scans);
    assert!(place_m < 0.1 && turn < 0.02, "{place_m} m, {turn} rad");
}

#[test]
fn far_from_zero_odometry_is_refined_as_well_as_near_it() {
    let (truth, mut scans) = recording();
    for scan in &mut scans {
        let odom = scan.odom_from_robot;
        scan.odom_from_robot = Pose2::new(odom.x + 691_345.0, odom.y + 5_336_921.0, odom.theta);
    }
    let (place_m, turn) = worst_error(&truth, &scans);
    assert!(place_m < 0.06 && turn < 0.02, "{place_m} m, {turn} rad");
}

#[test]
fn without_returns_odometry_stands() {
    let (_, mut scans) = recording();
    for scan in &mut scans {
        scan.ranges_m = vec![f32::INFINITY; 180];
    }
    let mut refiner = OdometryRefiner::new(&RefinerConfig::default());
    for scan in &scans {
        let refined = refiner.refine(&laser(), scan);
        assert!(refined.run_from_robot.distance(&scan.odom_from_robot) < 1e-9);
    }
}

/// A narrow place elsewhere.
fn store() -> Vec<Wall> {
    let mut walls = polygon(&[(50.0, 0.0), (52.2, 0.0), (52.2, 4.0), (54.0, 4.0), (54.0, 9.0), (50.0, 9.0)]);
    walls.extend(polygon(&[(50.8, 6.0), (51.1, 6.0), (51.1, 6.4), (50.8, 6.4)]));
    walls
}

/// A robot that drives through offices and is then carried to where it drives on, five scans a second: what its
/// odometry says of the carrying follows from where it was; with the number of the first scan behind.
fn carried(odometry: impl Fn(&Pose2) -> Pose2) -> (Vec<Pose2>, Vec<Scan>, usize) {
    let (truth, scans) = recording();
    let from = scans.len() / 4;
    let there = drive(&[(51.0, 1.0), (51.2, 5.0), (52.6, 8.0)], 0.1);
    let told = odometry(&scans[from - 1].odom_from_robot);
    let behind = there.iter().map(|at| {
        let odom_from_robot = told.compose(&there[0].between(at));
        sense(&store(), &laser(), at, &odom_from_robot)
    });
    let mut scans: Vec<Scan> = scans[..from].iter().cloned().chain(behind).collect();
    (scans.iter_mut().zip(0..)).for_each(|(scan, idx)| scan.timestamp_ns = idx * 200_000_000);
    ([&truth[..from], &there].concat(), scans, from)
}

/// The places of cuts, and how far the poses go wrong between them, metres.
fn pieces(truth: &[Pose2], scans: &[Scan]) -> (Vec<(usize, CutReason)>, f64) {
    let mut refiner = OdometryRefiner::new(&RefinerConfig::default());
    let (mut cuts, mut worst_m, mut first) = (Vec::new(), 0.0f64, 0);
    let mut refined: Vec<Pose2> = Vec::new();
    for (idx, scan) in scans.iter().enumerate() {
        let found = refiner.refine(&laser(), scan);
        if let Some(reason) = found.cut {
            cuts.push((idx, reason));
            first = idx;
        }
        refined.push(found.run_from_robot);
        if !found.is_doubtful {
            let error = truth[first].between(&truth[idx]).between(&refined[first].between(&refined[idx]));
            worst_m = worst_m.max(error.x.hypot(error.y));
        }
    }
    (cuts, worst_m)
}

#[test]
fn a_robot_that_is_carried_is_in_two_pieces() {
    let (truth, scans, at) = carried(|before| *before);
    let (cuts, worst_m) = pieces(&truth, &scans);
    assert_eq!(cuts.len(), 1, "{cuts:?}");
    assert!(
        cuts[0].1 == CutReason::Carried && (at..at + 5).contains(&cuts[0].0),
        "{cuts:?}, carried at {at}"
    );
    assert!(worst_m < 0.1, "{worst_m}");
}

#[test]
fn a_jump_that_the_scans_do_not_bear_out_is_a_cut() {
    let (truth, scans, at) = carried(|before| before.compose(&Pose2::new(30.0, 0.0, 2.0)));
    let (cuts, worst_m) = pieces(&truth, &scans);
    assert_eq!(cuts.len(), 1, "{cuts:?}");
    assert!(cuts[0].1 == CutReason::Jump && (at..at + 5).contains(&cuts[0].0), "{cuts:?}, jumped at {at}");
    assert!(worst_m < 0.1, "{worst_m}");
}

#[test]
fn a_covered_laser_is_a_cut_when_it_sees_another_place_afterwards() {
    let (mut truth, mut scans, at) = carried(|before| *before);
    for _ in 0..20 {
        let blind = Scan { ranges_m: vec![f32::NAN; laser().num_ranges], ..scans[at - 1].clone() };
        scans.insert(at, blind);
        truth.insert(at, truth[at - 1]);
    }
    for (idx, scan) in scans.iter_mut().enumerate() {
        scan.timestamp_ns = idx as i64 * 200_000_000;
    }
    let (cuts, worst_m) = pieces(&truth, &scans);
    assert_eq!(cuts.len(), 1, "{cuts:?}");
    assert!(cuts[0].1 == CutReason::NoReturns && (at + 20..at + 25).contains(&cuts[0].0), "{cuts:?}");
    assert!(worst_m < 0.1, "{worst_m}");
}

#[test]
fn a_laser_that_is_covered_where_the_robot_stands_or_drives_by_good_odometry_is_no_cut() {
    let (truth, scans) = recording();
    let blind = |scan: &Scan| Scan { ranges_m: vec![f32::NAN; laser().num_ranges], ..scan.clone() };
    let driving: Vec<Scan> = (scans.iter().enumerate())
        .map(|(idx, scan)| if (40..55).contains(&idx) { blind(scan) } else { scan.clone() })
        .collect();
    assert_eq!(pieces(&truth, &driving).0, []);
    let mut standing = scans.clone();
    (0..30).for_each(|_| standing.insert(60, blind(&scans[59])));
    let mut stood = truth.clone();
    (0..30).for_each(|_| stood.insert(60, truth[59]));
    assert_eq!(pieces(&stood, &standing).0, []);
    assert_eq!(pieces(&truth, &scans).0, []);
}
