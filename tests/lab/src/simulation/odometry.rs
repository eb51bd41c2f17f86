//! Wheel odometry that drifts: a systematic error of its own per robot, and noise that grows with the motion.

use rand::Rng;

use super::config::OdometryNoise;
use super::gaussian::standard_normal;
use locution_engine::geometry::Pose2;

/// Odometry of one robot from power-on, where it starts at the origin.
#[derive(Clone, Debug)]
pub(super) struct DriftingOdometry {
    noise: OdometryNoise,
    length_factor: f64,
    bend_rad_per_m: f64,
    last_true: Option<Pose2>,
    odom_from_robot: Pose2,
}

impl DriftingOdometry {
    /// Draws this robot's systematic error.
    pub(super) fn new(noise: &OdometryNoise, rng: &mut impl Rng) -> Self {
        Self {
            noise: noise.clone(),
            length_factor: 1.0 + noise.scale_std * standard_normal(rng),
            bend_rad_per_m: noise.bend_std_rad_per_m * standard_normal(rng),
            last_true: None,
            odom_from_robot: Pose2::identity(),
        }
    }

    /// What odometry says when the robot has truly moved to this pose.
    pub(super) fn advance(&mut self, world_from_robot: &Pose2, rng: &mut impl Rng) -> Pose2 {
        let motion = self.last_true.map_or(Pose2::identity(), |last| last.between(world_from_robot));
        self.last_true = Some(*world_from_robot);
        let length_m = motion.x.hypot(motion.y);
        // Three draws every time keep the stream of random numbers independent of the motion.
        let (along, aside, turn) = (standard_normal(rng), standard_normal(rng), standard_normal(rng));
        let spread_m = self.noise.translation_std_m_per_sqrt_m * length_m.sqrt();
        let spread_rad = (self.noise.turn_std_rad_per_sqrt_m.powi(2) * length_m
            + self.noise.turn_std_rad_per_sqrt_rad.powi(2) * motion.theta.abs())
        .sqrt();
        let measured = Pose2::new(
            motion.x * self.length_factor + spread_m * along,
            motion.y * self.length_factor + 0.3 * spread_m * aside,
            motion.theta + self.bend_rad_per_m * length_m + spread_rad * turn,
        );
        self.odom_from_robot = self.odom_from_robot.compose(&measured);
        self.odom_from_robot
    }
}
