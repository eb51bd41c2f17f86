//! Odometry refined by registration: every 0.2 m a scan is matched against the recent dozen metres of scans.

use std::collections::VecDeque;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::config::RefinerConfig;
use super::correlative::{LikelihoodGrid, LocalWindow};
use super::motion_prior::{MotionPrior, Witness};
use super::odometry_record::OdometryRecord;
use super::point_to_line::{Alignment, AlignmentSettings, align, linearize};
use super::points::thinned_points;
use super::recent_scan::RecentScan;
use super::surface_map::{FittedSurfaces, SurfaceMap};
use crate::geometry::{Point2, Pose2};
use crate::scan::{Scan, ScanGeometry};

/// What the refiner says of one scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// Pose in the run's own frame, which starts at the first odometry pose.
    pub run_from_robot: Pose2,
    /// Present when the scan was registered: keep it as a keyframe.
    pub keyframe: Option<KeyframeMotion>,
}

/// The motion that led to a keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeMotion {
    /// Covariance of the motion since the previous keyframe, (x, y, θ) in that keyframe's axes, row by row.
    pub motion_covariance: [[f64; 3]; 3],
}

/// Time between scans of a robot without a clock, seconds.
const UNTOLD_INTERVAL_S: f64 = 0.3;

/// Points that a surface must rest on.
const MIN_COUNT: i32 = 3;

/// A scan whose pose was settled by registration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Fixed {
    start_from_robot: Pose2,
    /// Covariance of (x, y, θ) since the latest keyframe, in the axes of the start.
    covariance: Matrix3<f64>,
    /// Motion since then as odometry tells it, steps that cannot be left out.
    told: Pose2,
}

/// The scan before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Latest {
    timestamp_ns: i64,
    odom_from_robot: Pose2,
    start_from_robot: Pose2,
    /// Motion from the scan before that one.
    motion: Pose2,
    /// By the gyroscope of a robot that has one.
    angular_velocity_rad_per_s: Option<f64>,
}

/// What is kept of a refiner between processes; the surface map follows from the scans.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct RefinerState {
    config: RefinerConfig,
    /// The first odometry pose. Everything kept here counts from there, so that it is as exact far from the origin of
    /// the odometry, in the coordinates of a country, as near it.
    run_from_start: Pose2,
    latest: Option<Latest>,
    keyframe: Option<Fixed>,
    /// The latest registered scan, be it a keyframe or not.
    fixed: Option<Fixed>,
    record: OdometryRecord,
    /// Usual time between scans, seconds; 0 while unknown.
    interval_s: f64,
    /// Share of returns on surfaces that fits usually have.
    usual_share: f64,
    travel_mm: u64,
    recent: VecDeque<RecentScan>,
}

/// Refines the odometry of one run, scan by scan; a plain value of bounded size.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(from = "RefinerState", into = "RefinerState")]
pub struct OdometryRefiner {
    state: RefinerState,
    surfaces: SurfaceMap,
    fitted: FittedSurfaces,
}

impl From<RefinerState> for OdometryRefiner {
    fn from(state: RefinerState) -> Self {
        let mut surfaces = SurfaceMap::new(state.config.cell_m);
        for scan in &state.recent {
            for point in scan.points() {
                surfaces.insert(&point);
            }
        }
        Self { state, surfaces, fitted: FittedSurfaces::default() }
    }
}

impl From<OdometryRefiner> for RefinerState {
    fn from(refiner: OdometryRefiner) -> Self {
        refiner.state
    }
}

/// What is expected of a scan before it is registered.
struct Expectation {
    /// The likeliest pose.
    predicted: Pose2,
    prior: MotionPrior,
    /// What odometry says, with its covariance, when the robot could have moved so.
    odometry: Option<Witness>,
    /// True when odometry is what is believed.
    is_by_odometry: bool,
    /// How odometry moved from the scan before.
    step: Pose2,
}

/// A pose found for a scan.
struct Settled {
    start_from_robot: Pose2,
    /// Information of (x, y, θ), in the axes of the start.
    information: Matrix3<f64>,
    is_registered: bool,
}

impl OdometryRefiner {
    /// A refiner that has seen nothing.
    pub fn new(config: &RefinerConfig) -> Self {
        RefinerState {
            config: config.clone(),
            run_from_start: Pose2::identity(),
            latest: None,
            keyframe: None,
            fixed: None,
            record: OdometryRecord::default(),
            interval_s: 0.0,
            usual_share: 0.0,
            travel_mm: 0,
            recent: VecDeque::new(),
        }
        .into()
    }

    /// Takes the next scan of the run.
    ///
    /// As long as a few returns bear out what odometry says, a scan between keyframes is the latest registered one
    /// composed with odometry. Otherwise it is registered, and odometry counts for no more than one witness. A scan
    /// that fits the recent scans badly keeps what was expected, with a covariance that says so.
    pub fn refine(&mut self, geometry: &ScanGeometry, scan: &Scan) -> Refined {
        let (start_from_robot, keyframe) = self.advance(geometry, scan);
        Refined { run_from_robot: self.state.run_from_start.compose(&start_from_robot), keyframe }
    }

    /// Pose of the next scan from where the run began, and the motion if it makes a keyframe.
    fn advance(&mut self, geometry: &ScanGeometry, scan: &Scan) -> (Pose2, Option<KeyframeMotion>) {
        let Some(latest) = self.state.latest else { return self.start(geometry, scan) };
        let gap_s = self.clock(scan.timestamp_ns, latest.timestamp_ns);
        let expected = self.expect(&latest, scan, gap_s);
        let (Some(expected), Some(keyframe)) = (expected, self.state.keyframe) else {
            return self.start(geometry, scan);
        };
        let config = &self.state.config;
        let is_due = |pose: &Pose2| {
            let moved = keyframe.start_from_robot.between(pose);
            moved.x.hypot(moved.y) >= config.keyframe_distance_m
                || moved.theta.abs() >= config.keyframe_turn_rad
        };
        let was_due = is_due(&expected.predicted);
        if expected.is_by_odometry && !was_due && self.bears_out(geometry, scan, &expected) {
            self.note(&latest, scan, &expected.step, expected.predicted);
            return (expected.predicted, None);
        }
        let points = self.points_of(geometry, scan);
        let settled = self.settle(&points, &expected, &latest);
        let config = &self.state.config;
        let moved = keyframe.start_from_robot.between(&settled.start_from_robot);
        let is_keyframe = was_due
            || moved.x.hypot(moved.y) >= config.keyframe_distance_m
            || moved.theta.abs() >= config.keyframe_turn_rad;
        self.note(&latest, scan, &expected.step, settled.start_from_robot);
        let covariance = settled.information.try_inverse().unwrap_or_else(Matrix3::identity);
        if !is_keyframe {
            if settled.is_registered {
                self.state.fixed = Some(Fixed {
                    start_from_robot: settled.start_from_robot,
                    covariance,
                    told: Pose2::identity(),
                });
            }
            return (settled.start_from_robot, None);
        }
        self.learn(&keyframe, &settled, &expected);
        self.state.travel_mm += (moved.x.hypot(moved.y) * 1000.0).round() as u64;
        self.keep(&points, settled.start_from_robot);
        let in_keyframe = rotated(&covariance, -keyframe.start_from_robot.theta);
        let motion = KeyframeMotion { motion_covariance: in_keyframe.transpose().into() };
        (settled.start_from_robot, Some(motion))
    }

    fn start(&mut self, geometry: &ScanGeometry, scan: &Scan) -> (Pose2, Option<KeyframeMotion>) {
        let points = self.points_of(geometry, scan);
        self.state.run_from_start = scan.odom_from_robot;
        self.keep(&points, Pose2::identity());
        self.state.latest = Some(Latest {
            timestamp_ns: scan.timestamp_ns,
            odom_from_robot: scan.odom_from_robot,
            start_from_robot: Pose2::identity(),
            motion: Pose2::identity(),
            angular_velocity_rad_per_s: scan.angular_velocity_rad_per_s,
        });
        (Pose2::identity(), Some(KeyframeMotion { motion_covariance: [[0.0; 3]; 3] }))
    }

    /// Seconds since the scan before, as far as the clock can be believed; learns what is usual.
    fn clock(&mut self, timestamp_ns: i64, before_ns: i64) -> f64 {
        let gap_s = timestamp_ns.saturating_sub(before_ns) as f64 * 1e-9;
        let usual_s = &mut self.state.interval_s;
        if *usual_s <= 0.0 {
            *usual_s = gap_s.clamp(0.0, 1.0);
        } else {
            *usual_s += 0.05 * (gap_s.clamp(0.0, 3.0 * *usual_s) - *usual_s);
        }
        // Clocks jitter: only a gap well beyond what is usual counts as one.
        match *usual_s {
            usual_s if usual_s <= 0.0 => UNTOLD_INTERVAL_S,
            usual_s if gap_s > 3.0 * usual_s => gap_s,
            usual_s => usual_s,
        }
    }

    fn expect(&mut self, latest: &Latest, scan: &Scan, gap_s: f64) -> Option<Expectation> {
        let interval_s = self.state.interval_s;
        let config = &self.state.config;
        let step = latest.odom_from_robot.between(&scan.odom_from_robot);
        let is_possible = config.motion.is_possible(&step, gap_s, interval_s);
        let share = if interval_s > 0.0 { (gap_s / interval_s).min(10.0) } else { 1.0 };
        let mut onward =
            Pose2::new(latest.motion.x * share, latest.motion.y * share, latest.motion.theta * share);
        let gyroscope = turn_by_gyroscope(latest, scan, gap_s);
        onward.theta = gyroscope.unwrap_or(onward.theta);
        // A step that cannot be is offered once, and never carried on.
        let carried = if is_possible { step } else { onward };
        let (fixed, keyframe) = (self.state.fixed.as_mut()?, self.state.keyframe.as_mut()?);
        let told = fixed.told.compose(&step);
        (fixed.told, keyframe.told) = (fixed.told.compose(&carried), keyframe.told.compose(&carried));
        let fixed = *fixed;
        let motion = self.state.record.corrected(&told);
        let by_odometry = fixed.start_from_robot.compose(&motion);
        let belief = if is_possible { self.state.record.belief(&step) } else { 0.05 };
        let covariance =
            fixed.covariance + rotated(&config.odometry.covariance(&motion), fixed.start_from_robot.theta);
        let odometry = Witness::new(by_odometry, &covariance, belief);
        let going_on = latest.start_from_robot.compose(&onward);
        let covariance = fixed.covariance
            + rotated(&config.motion.covariance(gap_s, gyroscope.is_some()), latest.start_from_robot.theta);
        let onward = Witness::new(going_on, &covariance, (1.0 - belief).max(config.lie_probability));
        let is_by_odometry = odometry.is_some() && belief > 0.5;
        let predicted = if is_by_odometry { by_odometry } else { going_on };
        let first = odometry.or(onward).unwrap_or_else(|| Witness::certain(predicted));
        let prior = MotionPrior::new(first, onward.filter(|_| odometry.is_some()));
        let odometry = odometry.filter(|_| is_possible);
        Some(Expectation { predicted, prior, odometry, is_by_odometry, step })
    }

    /// True when a few returns of a scan lie as they would if odometry were right.
    fn bears_out(&mut self, geometry: &ScanGeometry, scan: &Scan, expected: &Expectation) -> bool {
        let config = &self.state.config;
        let Some(odometry) = &expected.odometry else { return false };
        let stride = (geometry.num_ranges / config.num_check_points).max(1);
        let points: Vec<Point2> = geometry
            .endpoints_of_every(stride, &scan.ranges_m, config.range_limit_m)
            .map(|(_, point)| point)
            .collect();
        if points.len() < config.num_check_points / 4 {
            return true;
        }
        let settings = alignment_settings(config);
        let (surfaces, fitted) = (&self.surfaces, &mut self.fitted);
        let fit = linearize(
            |point| fitted.surface_at(surfaces, point, MIN_COUNT),
            &points,
            &expected.predicted,
            &settings,
            config.first_outlier_m,
        );
        let share = f64::from(fit.num_inliers) / points.len() as f64;
        let step = (fit.hessian + odometry.information).try_inverse();
        let gain = step.map_or(0.0, |inverse| (fit.gradient.transpose() * inverse * fit.gradient)[0]);
        gain < config.check_chi2 && share > config.check_share * self.state.usual_share
    }

    fn points_of(&self, geometry: &ScanGeometry, scan: &Scan) -> Vec<Point2> {
        let config = &self.state.config;
        thinned_points(
            geometry,
            &scan.ranges_m,
            config.point_spacing_m,
            config.range_limit_m,
            config.max_points,
        )
    }

    /// The pose of a scan, and what is then thought of the odometry.
    fn settle(&mut self, points: &[Point2], expected: &Expectation, latest: &Latest) -> Settled {
        let Some(found) = self.register(points, expected, latest) else {
            let (information, _) = expected.prior.pull(&expected.predicted);
            return Settled { start_from_robot: expected.predicted, information, is_registered: false };
        };
        let config = &self.state.config;
        if expected.odometry.is_some() {
            let believed = expected.prior.responsibilities(&found.map_from_points)[0];
            self.state.record.doubt =
                believed * config.lie_probability + (1.0 - believed) * (1.0 - config.recovery_probability);
        }
        let usual = &mut self.state.usual_share;
        *usual += if *usual > 0.0 { 0.1 * (found.inlier_share - *usual) } else { found.inlier_share };
        Settled {
            start_from_robot: found.map_from_points,
            information: found.information,
            is_registered: true,
        }
    }

    /// The best of the alignments from all the places where the robot may be; none when the fit is poor.
    fn register(&mut self, points: &[Point2], expected: &Expectation, latest: &Latest) -> Option<Alignment> {
        if points.len() < self.state.config.min_points {
            return None;
        }
        let mut best = self.align_from(&expected.predicted, points, expected);
        let config = &self.state.config;
        let is_sound = |found: &Alignment| {
            found.inlier_share >= config.good_inlier_share
                && expected
                    .odometry
                    .as_ref()
                    .is_none_or(|odometry| odometry.chi2(&found.map_from_points) < config.sound_chi2)
        };
        if is_sound(&best) {
            return Some(best);
        }
        let (good, min, gain) = (config.good_inlier_share, config.min_inlier_share, config.min_search_gain);
        let half_turn_rad =
            if expected.is_by_odometry { config.search_half_turn_rad } else { config.lost_half_turn_rad };
        let mut starts: Vec<Pose2> = expected.prior.means().collect();
        starts.push(latest.start_from_robot);
        let mut tried = vec![expected.predicted];
        for start in starts {
            let is_new = tried
                .iter()
                .all(|other| other.distance(&start) > 0.05 || (other.theta - start.theta).abs() > 0.03);
            if is_new {
                tried.push(start);
                let other = self.align_from(&start, points, expected);
                if other.cost < best.cost {
                    best = other;
                }
            }
        }
        if best.inlier_share < good {
            let start = self.search(points, &best.map_from_points, half_turn_rad)?;
            let other = self.align_from(&start, points, expected);
            if other.inlier_share > best.inlier_share + gain {
                best = other;
            }
        }
        (best.inlier_share >= min).then_some(best)
    }

    fn align_from(&mut self, start: &Pose2, points: &[Point2], expected: &Expectation) -> Alignment {
        let settings = alignment_settings(&self.state.config);
        let (surfaces, fitted) = (&self.surfaces, &mut self.fitted);
        let surface_at = |point: &Point2| fitted.surface_at(surfaces, point, MIN_COUNT);
        align(surface_at, points, &expected.prior, start, &settings)
    }

    fn search(&self, points: &[Point2], predicted: &Pose2, half_turn_rad: f64) -> Option<Pose2> {
        let config = &self.state.config;
        let mut grid =
            LikelihoodGrid::around(&predicted.position(), config.search_radius_m, config.search_cell_m);
        for scan in &self.state.recent {
            for point in scan.points() {
                grid.mark(&point);
            }
        }
        let window =
            LocalWindow { half_x_m: config.search_half_m, half_y_m: config.search_half_m, half_turn_rad };
        grid.best_pose(points, predicted, &window)
    }

    /// Compares the odometry since the latest keyframe with what was found.
    fn learn(&mut self, keyframe: &Fixed, settled: &Settled, expected: &Expectation) {
        let Some(odometry) = expected.odometry.as_ref().filter(|_| settled.is_registered) else { return };
        if self.state.record.doubt > 0.1 {
            return;
        }
        let found = keyframe.start_from_robot.between(&settled.start_from_robot);
        let turn = -keyframe.start_from_robot.theta;
        let by_prior = rotated(&odometry.information, turn);
        let by_scan = rotated(&settled.information, turn) - by_prior;
        self.state.record.learn(&keyframe.told, &found, &by_scan, &by_prior);
    }

    /// Remembers a scan as the one before the next.
    fn note(&mut self, latest: &Latest, scan: &Scan, step: &Pose2, start_from_robot: Pose2) {
        let motion = latest.start_from_robot.between(&start_from_robot);
        self.state.record.witness(step, &motion);
        self.state.latest = Some(Latest {
            timestamp_ns: scan.timestamp_ns,
            odom_from_robot: scan.odom_from_robot,
            start_from_robot,
            motion,
            angular_velocity_rad_per_s: scan.angular_velocity_rad_per_s,
        });
    }

    fn keep(&mut self, points: &[Point2], start_from_robot: Pose2) {
        let scan = RecentScan::new(self.state.travel_mm, &start_from_robot, points);
        for point in scan.points() {
            self.surfaces.insert(&point);
        }
        self.state.recent.push_back(scan);
        let fixed = Fixed { start_from_robot, covariance: Matrix3::zeros(), told: Pose2::identity() };
        (self.state.keyframe, self.state.fixed) = (Some(fixed), Some(fixed));
        let window_mm = (self.state.config.window_m * 1000.0) as u64;
        while self.state.recent.len() > self.state.config.max_scans
            || self.state.recent.front().is_some_and(|scan| scan.travel_mm + window_mm < self.state.travel_mm)
        {
            let Some(old) = self.state.recent.pop_front() else { break };
            for point in old.points() {
                self.surfaces.remove(&point);
            }
        }
        self.fitted.clear();
    }
}

/// How far the robot turned since the scan before by the rates that its gyroscope told at both.
fn turn_by_gyroscope(latest: &Latest, scan: &Scan, gap_s: f64) -> Option<f64> {
    let (before, now) = (latest.angular_velocity_rad_per_s?, scan.angular_velocity_rad_per_s?);
    let turn = 0.5 * (before + now) * gap_s;
    // Beyond a turn something else than the robot is told of.
    (turn.abs() < std::f64::consts::TAU).then_some(turn)
}

fn alignment_settings(config: &RefinerConfig) -> AlignmentSettings {
    AlignmentSettings {
        noise_m: config.noise_m,
        outlier_m: config.outlier_m,
        first_outlier_m: config.first_outlier_m,
        max_iterations: config.max_iterations,
        correlated_returns: config.correlated_returns,
    }
}

/// The covariance of (x, y, θ) in axes turned by `angle_rad`.
pub(crate) fn rotated(covariance: &Matrix3<f64>, angle_rad: f64) -> Matrix3<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    turn * covariance * turn.transpose()
}
