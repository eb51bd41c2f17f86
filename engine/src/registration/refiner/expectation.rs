//! What odometry, gyroscope and a robot that goes on as it did say of a scan before it is looked at.

use super::super::motion_prior::{MotionPrior, Witness};
use super::{Latest, OdometryRefiner, rotated};
use crate::geometry::Pose2;
use crate::scan::Scan;

/// A recording that pauses for longer than this has a gap, seconds.
const LONG_GAP_S: f64 = 2.0;

/// What is expected of a scan before it is registered.
pub(super) struct Expectation {
    /// The likeliest pose.
    pub predicted: Pose2,
    pub prior: MotionPrior,
    /// What odometry says, with its covariance, when the robot could have moved so.
    pub odometry: Option<Witness>,
    /// True when odometry is what is believed.
    pub is_by_odometry: bool,
    /// True when there is odometry that a robot can have driven, be it believed or not.
    pub is_told: bool,
    /// Where the robot is if the scan does not tell.
    pub untold: Pose2,
    /// How odometry moved from the scan before.
    pub step: Pose2,
    /// True when no robot drives so far in the time.
    pub is_far: bool,
    /// True when much more time went by than usual.
    pub is_gap: bool,
}

impl OdometryRefiner {
    pub(super) fn expect(&mut self, latest: &Latest, scan: &Scan, gap_s: f64) -> Option<Expectation> {
        let interval_s = self.state.clock.usual_s();
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
        let is_far = !config.motion.is_possible(&Pose2::new(step.x, step.y, 0.0), gap_s, interval_s);
        let is_gap = gap_s > LONG_GAP_S.max(interval_s * 3.0);
        let is_told = is_possible && !self.state.record.is_mute(&step);
        let untold = if is_told { by_odometry } else { predicted };
        Some(Expectation {
            predicted,
            prior,
            odometry,
            is_by_odometry,
            is_told,
            untold,
            step,
            is_far,
            is_gap,
        })
    }
}

/// How far the robot turned since the scan before by the rates that its gyroscope told at both.
fn turn_by_gyroscope(latest: &Latest, scan: &Scan, gap_s: f64) -> Option<f64> {
    let (before, now) = (latest.angular_velocity_rad_per_s?, scan.angular_velocity_rad_per_s?);
    let turn = 0.5 * (before + now) * gap_s;
    // Beyond a turn something else than the robot is told of.
    (turn.abs() < std::f64::consts::TAU).then_some(turn)
}
