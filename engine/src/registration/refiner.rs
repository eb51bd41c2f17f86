//! Odometry refined by registration: every 0.2 m a scan is matched against the recent dozen metres of scans.

use std::collections::VecDeque;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::config::RefinerConfig;
use super::correlative::{LikelihoodGrid, LocalWindow};
use super::point_to_line::{Alignment, AlignmentSettings, align};
use super::points::{thinned_points, transformed};
use super::surface_map::SurfaceMap;
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

/// Grain of the points of the window: with 16 bits a coordinate they reach 65 m from the robot, beyond any range limit.
const POINT_GRAIN_M: f64 = 0.002;

/// A scan that still belongs to the window: points in the axes of the run, in grains from where the robot was.
///
/// Everything that is computed from a point uses it as rounded here, so that what is added to the surfaces can be taken
/// away again exactly, by this process or the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RecentScan {
    travel_mm: u64,
    robot_grains: (i32, i32),
    offsets: Box<[(i16, i16)]>,
}

impl RecentScan {
    fn new(travel_mm: u64, run_from_robot: &Pose2, points: &[Point2]) -> Self {
        let grains = |meters: f64| (meters / POINT_GRAIN_M).round() as i32;
        let robot_grains = (grains(run_from_robot.x), grains(run_from_robot.y));
        let offset = |point: Point2| {
            let along =
                |meters: f64, robot: i32| grains(meters).saturating_sub(robot).clamp(-32_768, 32_767) as i16;
            (along(point.x, robot_grains.0), along(point.y, robot_grains.1))
        };
        let offsets = transformed(points, run_from_robot).into_iter().map(offset).collect();
        Self { travel_mm, robot_grains, offsets }
    }

    /// The points in the run's frame, metres.
    fn points(&self) -> impl Iterator<Item = Point2> + '_ {
        let meters = |robot: i32, offset: i16| f64::from(robot.saturating_add(offset.into())) * POINT_GRAIN_M;
        let (x, y) = self.robot_grains;
        self.offsets.iter().map(move |&(dx, dy)| Point2::new(meters(x, dx), meters(y, dy)))
    }
}

/// Poses of the last registered scan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Anchor {
    odom_from_robot: Pose2,
    run_from_robot: Pose2,
}

/// What is kept of a refiner between processes; the surface map follows from the scans.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct RefinerState {
    config: RefinerConfig,
    anchor: Option<Anchor>,
    travel_mm: u64,
    recent: VecDeque<RecentScan>,
}

/// Refines the odometry of one run, scan by scan; a plain value of bounded size.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(from = "RefinerState", into = "RefinerState")]
pub struct OdometryRefiner {
    state: RefinerState,
    surfaces: SurfaceMap,
}

impl From<RefinerState> for OdometryRefiner {
    fn from(state: RefinerState) -> Self {
        let mut surfaces = SurfaceMap::new(state.config.cell_m);
        for scan in &state.recent {
            for point in scan.points() {
                surfaces.insert(&point);
            }
        }
        Self { state, surfaces }
    }
}

impl From<OdometryRefiner> for RefinerState {
    fn from(refiner: OdometryRefiner) -> Self {
        refiner.state
    }
}

impl OdometryRefiner {
    /// A refiner that has seen nothing.
    pub fn new(config: &RefinerConfig) -> Self {
        RefinerState { config: config.clone(), anchor: None, travel_mm: 0, recent: VecDeque::new() }.into()
    }

    /// Takes the next scan of the run.
    ///
    /// Between keyframes the pose is the last keyframe's composed with odometry. A scan that fits the recent scans
    /// badly keeps its odometry, with a covariance that says so.
    pub fn refine(&mut self, geometry: &ScanGeometry, scan: &Scan) -> Refined {
        let Some(anchor) = self.state.anchor else {
            return self.start(geometry, scan);
        };
        let motion = anchor.odom_from_robot.between(&scan.odom_from_robot);
        let predicted = anchor.run_from_robot.compose(&motion);
        let config = &self.state.config;
        let distance_m = motion.x.hypot(motion.y);
        if distance_m < config.keyframe_distance_m && motion.theta.abs() < config.keyframe_turn_rad {
            return Refined { run_from_robot: predicted, keyframe: None };
        }
        let points = self.points_of(geometry, scan);
        let odometry_covariance = config.odometry.covariance(&motion);
        let alignment = self.register(&points, &anchor.run_from_robot, &predicted, &odometry_covariance);
        let (run_from_robot, covariance) = match alignment {
            Some(alignment) => {
                let in_run = alignment.information.try_inverse().unwrap_or(odometry_covariance);
                (alignment.map_from_points, rotated(&in_run, -anchor.run_from_robot.theta))
            }
            None => (predicted, odometry_covariance),
        };
        self.state.travel_mm += (distance_m * 1000.0).round() as u64;
        self.keep(&points, run_from_robot, scan.odom_from_robot);
        Refined {
            run_from_robot,
            keyframe: Some(KeyframeMotion { motion_covariance: covariance.transpose().into() }),
        }
    }

    fn start(&mut self, geometry: &ScanGeometry, scan: &Scan) -> Refined {
        let points = self.points_of(geometry, scan);
        self.keep(&points, scan.odom_from_robot, scan.odom_from_robot);
        Refined {
            run_from_robot: scan.odom_from_robot,
            keyframe: Some(KeyframeMotion { motion_covariance: [[0.0; 3]; 3] }),
        }
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

    /// Correlative search around the prediction, then point-to-line steps; none when the fit is poor.
    fn register(
        &self,
        points: &[Point2],
        anchor: &Pose2,
        predicted: &Pose2,
        odometry_covariance: &Matrix3<f64>,
    ) -> Option<Alignment> {
        let config = &self.state.config;
        if points.len() < config.min_points {
            return None;
        }
        let in_run = rotated(odometry_covariance, anchor.theta);
        let prior = in_run.try_inverse()?;
        let settings = AlignmentSettings {
            noise_m: config.noise_m,
            outlier_m: config.outlier_m,
            first_outlier_m: config.first_outlier_m,
            min_count: 3,
            max_iterations: config.max_iterations,
            correlated_returns: config.correlated_returns,
        };
        let first = align(&self.surfaces, points, predicted, &prior, predicted, &settings);
        if first.inlier_share >= config.good_inlier_share {
            return Some(first);
        }
        let start = self.search(points, predicted)?;
        let second = align(&self.surfaces, points, predicted, &prior, &start, &settings);
        let best =
            if second.inlier_share > first.inlier_share + config.min_search_gain { second } else { first };
        (best.inlier_share >= config.min_inlier_share).then_some(best)
    }

    fn search(&self, points: &[Point2], predicted: &Pose2) -> Option<Pose2> {
        let config = &self.state.config;
        let mut grid =
            LikelihoodGrid::around(&predicted.position(), config.search_radius_m, config.search_cell_m);
        for scan in &self.state.recent {
            for point in scan.points() {
                grid.mark(&point);
            }
        }
        let window = LocalWindow {
            half_x_m: config.search_half_m,
            half_y_m: config.search_half_m,
            half_turn_rad: config.search_half_turn_rad,
        };
        grid.best_pose(points, predicted, &window)
    }

    fn keep(&mut self, points: &[Point2], run_from_robot: Pose2, odom_from_robot: Pose2) {
        let scan = RecentScan::new(self.state.travel_mm, &run_from_robot, points);
        for point in scan.points() {
            self.surfaces.insert(&point);
        }
        self.state.recent.push_back(scan);
        self.state.anchor = Some(Anchor { odom_from_robot, run_from_robot });
        let window_mm = (self.state.config.window_m * 1000.0) as u64;
        while self.state.recent.len() > self.state.config.max_scans
            || self.state.recent.front().is_some_and(|scan| scan.travel_mm + window_mm < self.state.travel_mm)
        {
            let Some(old) = self.state.recent.pop_front() else { break };
            for point in old.points() {
                self.surfaces.remove(&point);
            }
        }
    }
}

/// The covariance of (x, y, θ) in axes turned by `angle_rad`.
pub(crate) fn rotated(covariance: &Matrix3<f64>, angle_rad: f64) -> Matrix3<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    turn * covariance * turn.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::testing::{Wall, drifting, drive, laser, polygon, sense};

    fn offices() -> Vec<Wall> {
        let mut walls = polygon(&[(0.0, 0.0), (14.0, 0.0), (14.0, 9.0), (0.0, 9.0)]);
        walls.extend(polygon(&[(5.0, 3.0), (9.0, 3.0), (9.0, 6.0), (5.0, 6.0)]));
        walls.extend(polygon(&[(2.0, 7.5), (2.6, 7.5), (2.6, 8.2), (2.0, 8.2)]));
        walls
    }

    fn recording() -> (Vec<Pose2>, Vec<Scan>) {
        let truth = drive(&[(1.5, 1.5), (12.0, 1.5), (12.0, 7.5), (2.0, 7.0)], 0.1);
        let odometry = drifting(&truth, 1.03, 0.02);
        let scans =
            truth.iter().zip(&odometry).map(|(at, odom)| sense(&offices(), &laser(), at, odom)).collect();
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
}
