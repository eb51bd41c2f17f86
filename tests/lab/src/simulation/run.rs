//! One simulated recording: plan, drive, sense.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use super::config::SimulationConfig;
use super::drive::drive_along;
use super::gaussian::standard_normal;
use super::odometry::DriftingOdometry;
use super::path::{smooth_path, sway};
use super::people::People;
use super::planner::{PlanError, Planner, WaysFrom};
use super::ray_cast::cast_scan;
use super::world::World;
use locution_engine::config_error::ConfigError;
use locution_engine::formats::TruthPose;
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::scan::{Scan, ScanGeometry};

/// What the robot is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Drive from waypoint to waypoint in this order, starting at the first.
    Route(Vec<Point2>),
    /// Drive about for at least this many metres from a random place (or a given one) to random places.
    Wander {
        /// Length to drive.
        length_m: f64,
        /// Where to begin; random when `None`.
        start: Option<Point2>,
    },
}

/// A recording and where the robot truly was at each of its scans.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedRun {
    /// The laser.
    pub geometry: ScanGeometry,
    /// Scans with drifting odometry that begins at the origin.
    pub scans: Vec<Scan>,
    /// One pose per scan, in the world's frame.
    pub truth: Vec<TruthPose>,
}

/// Why a run could not be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SimulationError {
    /// A configuration value that cannot work.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A task that cannot be driven.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A route of fewer than two waypoints, or a length that is not a positive number.
    #[error("a task needs two waypoints or a positive length in metres")]
    EmptyTask,
    /// No place of the world is connected to a place five metres off.
    #[error("the world has no room to wander in")]
    NoRoom,
}

/// Simulates one robot in one world. Same arguments, same bytes.
///
/// # Errors
/// See [`SimulationError`].
pub fn simulate_run(
    world: &World,
    task: &Task,
    config: &SimulationConfig,
    seed: u64,
) -> Result<SimulatedRun, SimulationError> {
    config.validate("simulation")?;
    // Streams of their own: more people or noise do not change where the robot goes.
    let mut task_rng = stream(seed, 0);
    let mut people_rng = stream(seed, 1);
    let mut odometry_rng = stream(seed, 2);
    let mut laser_rng = stream(seed, 3);
    let driver = Driver { world, planner: Planner::new(world, config.drive.robot_radius_m), config };
    let poses = match task {
        Task::Route(waypoints) => driver.follow(waypoints, &mut task_rng)?,
        Task::Wander { length_m, start } => driver.wander(*length_m, *start, &mut task_rng)?,
    };
    let geometry = config.laser.geometry();
    let mut people = People::new(&config.people, driver.reachable_places(&poses[0])?, &mut people_rng);
    let mut odometry = DriftingOdometry::new(&config.odometry, &mut odometry_rng);
    let (mut scans, mut truth) = (Vec::with_capacity(poses.len()), Vec::with_capacity(poses.len()));
    for (idx, world_from_robot) in poses.into_iter().enumerate() {
        people.walk(config.drive.scan_period_s, &driver.planner, &mut people_rng);
        let exact = cast_scan(world, &people.discs(), &geometry, &world_from_robot);
        let ranges_m = exact
            .into_iter()
            .map(|range_m| noisy_reading(range_m, config.laser.range_noise_std_m, &mut laser_rng))
            .collect();
        // Microseconds, as the logs write them.
        let timestamp_ns = (idx as f64 * config.drive.scan_period_s * 1e6).round() as i64 * 1000;
        let odom_from_robot = odometry.advance(&world_from_robot, &mut odometry_rng);
        scans.push(Scan { timestamp_ns, odom_from_robot, ranges_m });
        truth.push(TruthPose { timestamp_ns, truth_from_robot: world_from_robot });
    }
    Ok(SimulatedRun { geometry, scans, truth })
}

fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    rng
}

/// A reading in whole millimetres, as the logs write them; infinite stays infinite.
fn noisy_reading(range_m: f64, noise_std_m: f64, rng: &mut impl Rng) -> f32 {
    let noisy_m = range_m + noise_std_m * standard_normal(rng);
    ((noisy_m.max(0.01) * 1000.0).round() / 1000.0) as f32
}

/// Plans and drives in one world.
struct Driver<'a> {
    world: &'a World,
    planner: Planner,
    config: &'a SimulationConfig,
}

impl Driver<'_> {
    fn follow(&self, waypoints: &[Point2], rng: &mut impl Rng) -> Result<Vec<Pose2>, SimulationError> {
        if waypoints.len() < 2 {
            return Err(SimulationError::EmptyTask);
        }
        // One way through all waypoints, so that the robot does not stop at each of them.
        let comfort_m = self.comfort_m(rng);
        let mut way: Vec<Point2> = Vec::new();
        // Long routes drive the same legs again and again.
        let mut planned: Vec<(&[Point2], Vec<Point2>)> = Vec::new();
        for pair in waypoints.windows(2) {
            let known = planned.iter().find(|(ends, _)| *ends == pair);
            let leg = match known {
                Some((_, leg)) => leg.clone(),
                None => self.planner.way_to(&self.planner.ways_from(&pair[0], comfort_m)?, &pair[1])?,
            };
            way.extend(leg.iter().skip(usize::from(!way.is_empty())));
            if known.is_none() {
                planned.push((pair, leg));
            }
        }
        let mut poses = Vec::new();
        self.drive(&way, comfort_m, &mut poses, rng);
        Ok(poses)
    }

    fn wander(
        &self,
        length_m: f64,
        start: Option<Point2>,
        rng: &mut impl Rng,
    ) -> Result<Vec<Pose2>, SimulationError> {
        if !(length_m > 0.0 && length_m.is_finite()) {
            return Err(SimulationError::EmptyTask);
        }
        let mut here = match start {
            Some(start) => start,
            None => self.random_start(rng)?,
        };
        let mut poses: Vec<Pose2> = Vec::new();
        let mut driven_m = 0.0;
        while driven_m < length_m {
            let comfort_m = self.comfort_m(rng);
            let ways = self.planner.ways_from(&here, comfort_m)?;
            let goal = self.random_goal(&ways, &here, &poses, rng).ok_or(SimulationError::NoRoom)?;
            let way = self.planner.way_to(&ways, &goal)?;
            let from = poses.len();
            self.drive(&way, comfort_m, &mut poses, rng);
            driven_m += poses[from.saturating_sub(1)..]
                .windows(2)
                .map(|pair| pair[0].distance(&pair[1]))
                .sum::<f64>();
            here = poses.last().map_or(here, Pose2::position);
        }
        Ok(poses)
    }

    /// Robots do not keep the same distance from the walls every time.
    fn comfort_m(&self, rng: &mut impl Rng) -> f64 {
        self.config.drive.comfort_m * rng.random_range(0.75..1.25)
    }

    fn drive(&self, way: &[Point2], comfort_m: f64, poses: &mut Vec<Pose2>, rng: &mut impl Rng) {
        let config = &self.config.drive;
        let straight = smooth_path(self.world, way, comfort_m);
        let path = sway(self.world, &straight, (config.swing_m, config.robot_radius_m + 0.1), rng);
        let Some(start) = poses.last().copied().or_else(|| start_pose(&path)) else { return };
        if poses.is_empty() {
            poses.push(start);
        }
        poses.extend(drive_along(&path, &start, config));
    }

    /// A random place from which at least 5 m can be driven.
    fn random_start(&self, rng: &mut impl Rng) -> Result<Point2, SimulationError> {
        let cells = self.planner.standing_cells();
        for _ in 0..100 {
            if cells.is_empty() {
                break;
            }
            let place = self.planner.center(cells[rng.random_range(0..cells.len())]);
            let ways = self.planner.ways_from(&place, self.config.drive.comfort_m)?;
            // A pocket between two pieces of furniture is no place to start from.
            if cells.iter().filter(|&&cell| ways.reaches(cell)).count() * 4 > cells.len() {
                return Ok(place);
            }
        }
        Err(SimulationError::NoRoom)
    }

    /// The least visited of five random places that can be reached and are at least 5 m off.
    fn random_goal(
        &self,
        ways: &WaysFrom,
        here: &Point2,
        poses: &[Pose2],
        rng: &mut impl Rng,
    ) -> Option<Point2> {
        let reachable: Vec<usize> = self
            .planner
            .standing_cells()
            .into_iter()
            .filter(|&cell| ways.reaches(cell) && self.planner.center(cell).distance(here) > 5.0)
            .collect();
        if reachable.is_empty() {
            return None;
        }
        let visits = |place: &Point2| {
            poses.iter().step_by(10).filter(|pose| pose.position().distance(place) < 3.0).count()
        };
        (0..5)
            .map(|_| self.planner.center(reachable[rng.random_range(0..reachable.len())]))
            .min_by_key(visits)
    }

    /// Centres of all cells that can be reached from where the robot starts.
    fn reachable_places(&self, start: &Pose2) -> Result<Vec<Point2>, SimulationError> {
        if self.config.people.num_people == 0 {
            return Ok(Vec::new());
        }
        let ways = self.planner.ways_from(&start.position(), self.config.drive.comfort_m)?;
        let cells = self.planner.standing_cells().into_iter();
        Ok(cells.filter(|&cell| ways.reaches(cell)).map(|cell| self.planner.center(cell)).collect())
    }
}

fn start_pose(path: &[Point2]) -> Option<Pose2> {
    let (first, ahead) = (path.first()?, path.get(4).or(path.last())?);
    Some(Pose2::new(first.x, first.y, (ahead.y - first.y).atan2(ahead.x - first.x)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::OdometryNoise;

    const OFFICE: &str = "
        ########################################
        #.........#.........#.........#........#
        #.........#.........#.........#........#
        #.........#.........#.........#........#
        #....................................  #
        ####..########..########..#######..#####
        #......................................#
        #......................................#
        #......................................#
        ####..####################..############
        #............#.........................#
        #............#.........................#
        #......................................#
        #............#.........................#
        ########################################";

    fn config() -> SimulationConfig {
        let mut config = SimulationConfig::default();
        config.people.num_people = 3;
        config
    }

    #[test]
    fn the_same_seed_gives_the_same_run_and_another_does_not() {
        let world = World::drawn(OFFICE);
        let task = Task::Wander { length_m: 40.0, start: None };
        let run = |seed| simulate_run(&world, &task, &config(), seed).unwrap();
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }

    #[test]
    fn wandering_covers_the_distance_and_never_collides() {
        let world = World::drawn(OFFICE);
        for seed in 0..5 {
            let task = Task::Wander { length_m: 60.0, start: None };
            let run = simulate_run(&world, &task, &config(), seed).unwrap();
            let poses: Vec<Pose2> = run.truth.iter().map(|pose| pose.truth_from_robot).collect();
            let driven_m: f64 = poses.windows(2).map(|pair| pair[0].distance(&pair[1])).sum();
            assert!((60.0..90.0).contains(&driven_m), "{driven_m}");
            assert!(poses.iter().all(|pose| world.clearance_m(&pose.position()) > 0.15));
            assert!(run.scans.iter().all(|scan| scan.ranges_m.len() == 181 && scan.ranges_m[90] > 0.0));
        }
    }

    #[test]
    fn a_route_passes_its_waypoints() {
        let world = World::drawn(OFFICE);
        let waypoints = vec![
            Point2::new(2.0, 6.0),
            Point2::new(2.5, 3.5),
            Point2::new(18.0, 3.5),
            Point2::new(14.0, 1.2),
        ];
        let run = simulate_run(&world, &Task::Route(waypoints.clone()), &config(), 1).unwrap();
        for waypoint in waypoints {
            let nearest = run.truth.iter().map(|pose| pose.truth_from_robot.position().distance(&waypoint));
            assert!(nearest.fold(f64::INFINITY, f64::min) < 0.6);
        }
        assert!(matches!(
            simulate_run(&world, &Task::Route(vec![]), &config(), 1),
            Err(SimulationError::EmptyTask)
        ));
    }

    #[test]
    fn perfect_odometry_is_the_truth_seen_from_the_start() {
        let world = World::drawn(OFFICE);
        let mut config = config();
        config.odometry = OdometryNoise::default().scaled(0.0);
        let run = simulate_run(&world, &Task::Wander { length_m: 30.0, start: None }, &config, 3).unwrap();
        let start = run.truth[0].truth_from_robot;
        for (scan, truth) in run.scans.iter().zip(&run.truth) {
            assert_eq!(scan.timestamp_ns, truth.timestamp_ns);
            let expected = start.between(&truth.truth_from_robot);
            assert!(scan.odom_from_robot.distance(&expected) < 1e-6);
        }
    }

    #[test]
    fn odometry_drifts_but_not_wildly() {
        let world = World::drawn(OFFICE);
        let run = simulate_run(&world, &Task::Wander { length_m: 60.0, start: None }, &config(), 5).unwrap();
        let (first, last) = (run.truth[0].truth_from_robot, run.truth[run.truth.len() - 1].truth_from_robot);
        let error_m = run.scans[run.scans.len() - 1].odom_from_robot.distance(&first.between(&last));
        assert!((0.05..15.0).contains(&error_m), "{error_m}");
    }
}
