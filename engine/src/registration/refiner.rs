//! Odometry refined by registration: every 0.2 m a scan is matched against the recent dozen metres of scans.

use std::collections::VecDeque;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::config::RefinerConfig;
use super::correlative::{LikelihoodGrid, LocalWindow};
use super::lost::{CutReason, Doubt};
use super::odometry_record::OdometryRecord;
use super::point_to_line::{Alignment, AlignmentSettings, align, linearize};
use super::points::thinned_points;
use super::recent_scan::RecentScan;
use super::scan_clock::ScanClock;
use super::surface_map::{FittedSurfaces, SurfaceMap};
use crate::geometry::{Point2, Pose2};
use crate::scan::{Scan, ScanGeometry};

mod doubt;
mod expectation;

use expectation::Expectation;

/// What the refiner says of one scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// Pose in the run's own frame, which starts at the first odometry pose; after a cut in another one, which starts
    /// at the odometry pose there.
    pub run_from_robot: Pose2,
    /// Present when the scan was registered: keep it as a keyframe.
    pub keyframe: Option<KeyframeMotion>,
    /// Present when nothing tells how the robot came here from where the scans before were taken.
    pub cut: Option<CutReason>,
    /// True when the pose is a guess: the scan fits nothing, and the next ones will tell.
    pub is_doubtful: bool,
}

/// What became of a scan.
enum Advance {
    /// The robot is here, counted from the start; with the motion if the scan makes a keyframe.
    To(Pose2, Option<KeyframeMotion>),
    /// The robot may be here.
    Perhaps(Pose2),
    /// Everything begins anew.
    Anew(Option<CutReason>),
}

/// The motion that led to a keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeMotion {
    /// Covariance of the motion since the previous keyframe, (x, y, θ) in that keyframe's axes, row by row.
    pub motion_covariance: [[f64; 3]; 3],
}

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
    clock: ScanClock,
    /// Set while it is doubted that the robot is where it is thought to be.
    doubt: Option<Doubt>,
    /// Scans in a row up to the latest that saw next to nothing.
    num_blind: u32,
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

/// A pose found for a scan.
struct Settled {
    start_from_robot: Pose2,
    /// Information of (x, y, θ), in the axes of the start.
    information: Matrix3<f64>,
    is_registered: bool,
    /// Share of the returns that lie on surfaces.
    inlier_share: f64,
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
            clock: ScanClock::default(),
            doubt: None,
            num_blind: 0,
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
    /// that fits the recent scans badly keeps what was expected, with a covariance that says so; when that cannot be
    /// either, and some more scans say the same, the run is cut.
    pub fn refine(&mut self, geometry: &ScanGeometry, scan: &Scan) -> Refined {
        let (start_from_robot, keyframe, cut, is_doubtful) = match self.advance(geometry, scan) {
            Advance::To(pose, keyframe) => (pose, keyframe, None, false),
            Advance::Perhaps(pose) => (pose, None, None, true),
            Advance::Anew(cut) => {
                self.start(geometry, scan);
                let keyframe = KeyframeMotion { motion_covariance: [[0.0; 3]; 3] };
                (Pose2::identity(), Some(keyframe), cut, false)
            }
        };
        let run_from_robot = self.state.run_from_start.compose(&start_from_robot);
        Refined { run_from_robot, keyframe, cut, is_doubtful }
    }

    fn advance(&mut self, geometry: &ScanGeometry, scan: &Scan) -> Advance {
        let Some(latest) = self.state.latest else { return Advance::Anew(None) };
        let gap_s = self.state.clock.gap_s(scan.timestamp_ns, latest.timestamp_ns);
        let expected = self.expect(&latest, scan, gap_s);
        let (Some(expected), Some(keyframe)) = (expected, self.state.keyframe) else {
            return Advance::Anew(None);
        };
        let config = &self.state.config;
        let is_due = |pose: &Pose2| {
            let moved = keyframe.start_from_robot.between(pose);
            moved.x.hypot(moved.y) >= config.keyframe_distance_m
                || moved.theta.abs() >= config.keyframe_turn_rad
        };
        let was_due = is_due(&expected.predicted);
        if expected.is_by_odometry
            && !was_due
            && self.state.doubt.is_none()
            && self.bears_out(geometry, scan, &expected)
        {
            self.note(&latest, scan, &expected.step, expected.predicted);
            return Advance::To(expected.predicted, None);
        }
        let points = self.points_of(geometry, scan);
        let min_points = self.state.config.min_points_of(geometry);
        let settled = self.settle(min_points, &points, &expected, &latest);
        if let Some(doubt) = self.doubt(geometry, scan, points.len(), &settled, &expected) {
            if doubt.num_scans >= self.state.config.num_doubtful_scans {
                return Advance::Anew(Some(doubt.reason));
            }
            self.state.doubt = Some(doubt);
            self.note(&latest, scan, &expected.step, settled.start_from_robot);
            return Advance::Perhaps(settled.start_from_robot);
        }
        self.state.doubt = None;
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
            return Advance::To(settled.start_from_robot, None);
        }
        self.learn(&keyframe, &settled, &expected);
        self.state.travel_mm += (moved.x.hypot(moved.y) * 1000.0).round() as u64;
        self.keep(&points, settled.start_from_robot);
        let in_keyframe = rotated(&covariance, -keyframe.start_from_robot.theta);
        let motion = KeyframeMotion { motion_covariance: in_keyframe.transpose().into() };
        Advance::To(settled.start_from_robot, Some(motion))
    }

    /// Begins at a scan; what was learned of odometry and clock stays.
    fn start(&mut self, geometry: &ScanGeometry, scan: &Scan) {
        let points = self.points_of(geometry, scan);
        self.state.recent.clear();
        self.surfaces = SurfaceMap::new(self.state.config.cell_m);
        (self.state.doubt, self.state.num_blind) = (None, 0);
        self.state.run_from_start = scan.odom_from_robot;
        self.keep(&points, Pose2::identity());
        self.state.latest = Some(Latest {
            timestamp_ns: scan.timestamp_ns,
            odom_from_robot: scan.odom_from_robot,
            start_from_robot: Pose2::identity(),
            motion: Pose2::identity(),
            angular_velocity_rad_per_s: scan.angular_velocity_rad_per_s,
        });
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
        if points.len() < config.min_points_of(geometry).min(config.num_check_points / 4) {
            self.state.num_blind += 1;
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
        let is_right = gain < config.check_chi2 && share > config.check_share * self.state.usual_share;
        if is_right {
            self.state.num_blind = 0;
        }
        is_right
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
    fn settle(
        &mut self,
        min_points: usize,
        points: &[Point2],
        expected: &Expectation,
        latest: &Latest,
    ) -> Settled {
        let Some(found) = self.register(min_points, points, expected, latest) else {
            let (information, _) = expected.prior.pull(&expected.untold);
            return Settled {
                start_from_robot: expected.untold,
                information,
                is_registered: false,
                inlier_share: 0.0,
            };
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
            inlier_share: found.inlier_share,
        }
    }

    /// The best of the alignments from all the places where the robot may be; none when the fit is poor.
    fn register(
        &mut self,
        min_points: usize,
        points: &[Point2],
        expected: &Expectation,
        latest: &Latest,
    ) -> Option<Alignment> {
        if points.len() < min_points {
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
