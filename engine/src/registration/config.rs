//! Settings of the registration room.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::geometry::Pose2;
use crate::scan::ScanGeometry;

/// Settings of [`Submap`](super::Submap) and [`register`](super::register).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SubmapConfig {
    /// Free space and search reach this far from the anchor, metres.
    pub radius_m: f64,
    /// Returns farther than this from the robot are not used, metres.
    pub range_limit_m: f64,
    /// Returns of a sweep are thinned to this distance, metres.
    pub point_spacing_m: f64,
    /// At most this many returns of a scan are used.
    pub max_points: usize,
    /// Edge of a surface cell, metres.
    pub cell_m: f64,
    /// Edge of a cell of free space and of the search, metres.
    pub evidence_cell_m: f64,
    /// Distance between the points that are aligned, metres.
    pub fine_spacing_m: f64,
    /// Distance between the points that are searched with, metres.
    pub coarse_spacing_m: f64,
    /// Step of the heading in the search, radians.
    pub turn_step_rad: f64,
    /// Expected distance of a return from its surface, metres.
    pub noise_m: f64,
    /// Beyond about this distance a return is an outlier, metres.
    pub outlier_m: f64,
    /// The same at the first step of the alignment, metres.
    pub first_outlier_m: f64,
    /// Points that a surface must rest on.
    pub min_count: i32,
    /// Gauss-Newton steps at most.
    pub max_iterations: usize,
    /// This many returns count as one independent measurement.
    pub correlated_returns: f64,
    /// Offsets this far are tried to see whether the fit could slide, metres.
    pub spread_half_m: f64,
    /// An offset that loses this many returns has 1/e of the weight.
    pub spread_returns_per_e: f64,
}

impl Default for SubmapConfig {
    fn default() -> Self {
        Self {
            radius_m: 12.0,
            range_limit_m: 25.0,
            point_spacing_m: 0.08,
            max_points: 180,
            cell_m: 0.2,
            evidence_cell_m: 0.1,
            fine_spacing_m: 0.1,
            coarse_spacing_m: 0.4,
            turn_step_rad: 0.02,
            noise_m: 0.03,
            outlier_m: 0.15,
            first_outlier_m: 0.3,
            min_count: 4,
            max_iterations: 10,
            correlated_returns: 10.0,
            spread_half_m: 2.4,
            spread_returns_per_e: 3.0,
        }
    }
}

/// How far wheel odometry is trusted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryNoise {
    /// Standard deviation of the distance per metre driven.
    pub distance_per_m: f64,
    /// Standard deviation of the distance that is always there, metres.
    pub distance_floor_m: f64,
    /// Standard deviation of the heading per radian turned.
    pub turn_per_rad: f64,
    /// Standard deviation of the heading per metre driven, radians.
    pub turn_per_m_rad: f64,
    /// Standard deviation of the heading that is always there, radians.
    pub turn_floor_rad: f64,
}

impl Default for OdometryNoise {
    fn default() -> Self {
        Self {
            distance_per_m: 0.1,
            distance_floor_m: 0.01,
            turn_per_rad: 0.3,
            turn_per_m_rad: 0.1,
            turn_floor_rad: 0.005,
        }
    }
}

impl OdometryNoise {
    /// Covariance of a motion's (x, y, θ) in the axes of its start.
    pub fn covariance(&self, motion: &Pose2) -> Matrix3<f64> {
        let distance_m = motion.x.hypot(motion.y);
        let distance_sd = self.distance_floor_m + self.distance_per_m * distance_m;
        let turn_sd =
            self.turn_floor_rad + self.turn_per_rad * motion.theta.abs() + self.turn_per_m_rad * distance_m;
        Matrix3::from_diagonal(&nalgebra::Vector3::new(
            distance_sd * distance_sd,
            distance_sd * distance_sd,
            turn_sd * turn_sd,
        ))
    }
}

/// How robots move, whatever their odometry says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionLimits {
    /// No robot is faster, metres per second.
    pub speed_max_m_per_s: f64,
    /// … or turns faster, radians per second.
    pub turn_speed_max_rad_per_s: f64,
    /// Odometry may say so much more than that from one scan to the next, metres.
    pub slack_m: f64,
    /// … and radians.
    pub slack_rad: f64,
    /// Standard deviation of the acceleration, metres per second squared.
    pub acceleration_m_per_s2: f64,
    /// The same of the turning speed, radians per second squared.
    pub turn_acceleration_rad_per_s2: f64,
    /// Standard deviation of the distance that is always there, metres.
    pub floor_m: f64,
    /// … and of the heading, radians.
    pub floor_rad: f64,
}

impl Default for MotionLimits {
    fn default() -> Self {
        Self {
            speed_max_m_per_s: 3.0,
            turn_speed_max_rad_per_s: 3.0,
            slack_m: 0.3,
            slack_rad: 0.3,
            acceleration_m_per_s2: 1.0,
            turn_acceleration_rad_per_s2: 2.0,
            floor_m: 0.02,
            floor_rad: 0.02,
        }
    }
}

impl MotionLimits {
    /// Covariance of (x, y, θ) of a robot that goes on as it did for some time, in its own axes. A gyroscope that was
    /// asked at both ends leaves a tenth of what the turning speed may change.
    pub fn covariance(&self, gap_s: f64, has_gyroscope: bool) -> Matrix3<f64> {
        let within =
            |acceleration: f64, speed_max: f64| (acceleration * gap_s * gap_s).min(speed_max * gap_s);
        let ahead_sd = self.floor_m + within(self.acceleration_m_per_s2, self.speed_max_m_per_s);
        let aside_sd = self.floor_m + 0.3 * within(self.acceleration_m_per_s2, self.speed_max_m_per_s);
        let share = if has_gyroscope { 0.1 } else { 1.0 };
        let turn_sd = share
            * (self.floor_rad + within(self.turn_acceleration_rad_per_s2, self.turn_speed_max_rad_per_s));
        Matrix3::from_diagonal(&nalgebra::Vector3::new(
            ahead_sd * ahead_sd,
            aside_sd * aside_sd,
            turn_sd * turn_sd,
        ))
    }

    /// True when a robot can have made this step within some time; without a clock, of which the usual interval is 0,
    /// all steps are.
    pub fn is_possible(&self, step: &Pose2, gap_s: f64, usual_s: f64) -> bool {
        usual_s <= 0.0
            || (step.x.hypot(step.y) <= self.slack_m + self.speed_max_m_per_s * gap_s
                && step.theta.abs() <= self.slack_rad + self.turn_speed_max_rad_per_s * gap_s)
    }
}

/// Fewer returns than this fit anywhere.
const NUM_POINTS_MIN: usize = 5;

/// Points of the refiner's window are kept with 16 bits a coordinate, 2 mm each.
const RANGE_LIMIT_MAX_M: f64 = 65.0;

/// Settings of [`OdometryRefiner`](super::OdometryRefiner).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RefinerConfig {
    /// A scan is registered after this much travel, metres.
    pub keyframe_distance_m: f64,
    /// … or after this much turning, radians.
    pub keyframe_turn_rad: f64,
    /// Scans of this much travel are the map to match against, metres.
    pub window_m: f64,
    /// At most this many scans are kept, however little the robot moved.
    pub max_scans: usize,
    /// Returns farther than this are not used, metres.
    pub range_limit_m: f64,
    /// Returns of a sweep are thinned to this distance, metres.
    pub point_spacing_m: f64,
    /// At most this many returns of a scan are used.
    pub max_points: usize,
    /// Fewer returns than this are not registered; of a laser with few beams it is half of them.
    pub min_points: usize,
    /// Edge of a surface cell, metres.
    pub cell_m: f64,
    /// Expected distance of a return from its surface, metres.
    pub noise_m: f64,
    /// Beyond about this distance a return is an outlier, metres.
    pub outlier_m: f64,
    /// The same at the first step of the alignment, metres.
    pub first_outlier_m: f64,
    /// Gauss-Newton steps at most.
    pub max_iterations: usize,
    /// This many returns count as one independent measurement.
    pub correlated_returns: f64,
    /// A fit with this share of returns on surfaces needs no search.
    pub good_inlier_share: f64,
    /// A fit with a smaller share is not believed: odometry stands.
    pub min_inlier_share: f64,
    /// The search must raise the share of returns on surfaces by this much to be believed.
    pub min_search_gain: f64,
    /// Half width of the correlative search, metres.
    pub search_half_m: f64,
    /// Half width of the correlative search, radians.
    pub search_half_turn_rad: f64,
    /// The same when odometry is not believed.
    pub lost_half_turn_rad: f64,
    /// Cell of the correlative search, metres.
    pub search_cell_m: f64,
    /// Returns within this distance take part in the correlative search, metres.
    pub search_radius_m: f64,
    /// Prior of the motion.
    pub odometry: OdometryNoise,
    /// What is possible without odometry.
    pub motion: MotionLimits,
    /// Returns of a scan between keyframes that are asked whether odometry is right.
    pub num_check_points: usize,
    /// A scan between keyframes is registered when that would reduce its squared deviations by more.
    pub check_chi2: f64,
    /// … or when fewer returns than this share of what is usual lie on surfaces.
    pub check_share: f64,
    /// A fit with squared deviations from odometry below this needs no rival.
    pub sound_chi2: f64,
    /// Probability that odometry begins to lie from one registered scan to the next.
    pub lie_probability: f64,
    /// Probability that it stops to.
    pub recovery_probability: f64,
    /// A run is cut when so many scans in a row leave the robot's place in doubt.
    pub num_doubtful_scans: u32,
    /// A fit with this share of returns on surfaces leaves no doubt.
    pub sure_inlier_share: f64,
    /// A lesser one does, whatever odometry says, when it sees through a larger share of what the scans before saw near
    /// by.
    pub max_seen_through: f64,
}

impl Default for RefinerConfig {
    fn default() -> Self {
        Self {
            keyframe_distance_m: 0.2,
            keyframe_turn_rad: 0.175,
            window_m: 12.0,
            max_scans: 90,
            range_limit_m: 40.0,
            point_spacing_m: 0.05,
            max_points: 180,
            min_points: 20,
            cell_m: 0.2,
            noise_m: 0.02,
            outlier_m: 0.15,
            first_outlier_m: 0.3,
            max_iterations: 10,
            correlated_returns: 3.0,
            good_inlier_share: 0.7,
            min_inlier_share: 0.3,
            min_search_gain: 0.1,
            search_half_m: 0.4,
            search_half_turn_rad: 0.2,
            lost_half_turn_rad: 0.6,
            search_cell_m: 0.1,
            search_radius_m: 20.0,
            odometry: OdometryNoise::default(),
            motion: MotionLimits::default(),
            num_check_points: 36,
            check_chi2: 12.0,
            check_share: 0.7,
            sound_chi2: 12.0,
            lie_probability: 0.001,
            recovery_probability: 0.1,
            num_doubtful_scans: 3,
            sure_inlier_share: 0.5,
            max_seen_through: 0.08,
        }
    }
}

impl SubmapConfig {
    /// Checks every value; `path` is this struct's own path.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let positive = [
            ("radius_m", self.radius_m),
            ("range_limit_m", self.range_limit_m),
            ("cell_m", self.cell_m),
            ("evidence_cell_m", self.evidence_cell_m),
            ("fine_spacing_m", self.fine_spacing_m),
            ("coarse_spacing_m", self.coarse_spacing_m),
            ("turn_step_rad", self.turn_step_rad),
            ("noise_m", self.noise_m),
            ("outlier_m", self.outlier_m),
            ("first_outlier_m", self.first_outlier_m),
            ("correlated_returns", self.correlated_returns),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must be a positive number"));
            }
        }
        Ok(())
    }
}

impl RefinerConfig {
    /// Returns that a scan of this laser must have to be registered.
    pub(super) fn min_points_of(&self, geometry: &ScanGeometry) -> usize {
        self.min_points.min((geometry.num_ranges / 2).max(NUM_POINTS_MIN))
    }

    /// Checks every value; `path` is this struct's own path.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let positive = [
            ("keyframe_distance_m", self.keyframe_distance_m),
            ("keyframe_turn_rad", self.keyframe_turn_rad),
            ("window_m", self.window_m),
            ("range_limit_m", self.range_limit_m),
            ("cell_m", self.cell_m),
            ("noise_m", self.noise_m),
            ("outlier_m", self.outlier_m),
            ("correlated_returns", self.correlated_returns),
            ("search_cell_m", self.search_cell_m),
            ("search_radius_m", self.search_radius_m),
            ("check_chi2", self.check_chi2),
            ("sound_chi2", self.sound_chi2),
            ("motion.speed_max_m_per_s", self.motion.speed_max_m_per_s),
            ("motion.turn_speed_max_rad_per_s", self.motion.turn_speed_max_rad_per_s),
            ("motion.acceleration_m_per_s2", self.motion.acceleration_m_per_s2),
            ("motion.turn_acceleration_rad_per_s2", self.motion.turn_acceleration_rad_per_s2),
            ("motion.floor_m", self.motion.floor_m),
            ("motion.floor_rad", self.motion.floor_rad),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must be a positive number"));
            }
        }
        for (field, value) in
            [("lie_probability", self.lie_probability), ("recovery_probability", self.recovery_probability)]
        {
            if !(value > 0.0 && value < 1.0) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must lie between 0 and 1"));
            }
        }
        if self.num_check_points == 0 {
            return Err(ConfigError::new(format!("{path}.num_check_points"), "must be positive"));
        }
        if self.num_doubtful_scans == 0 {
            return Err(ConfigError::new(format!("{path}.num_doubtful_scans"), "must be positive"));
        }
        if !(0.0..=1.0).contains(&self.max_seen_through) {
            return Err(ConfigError::new(format!("{path}.max_seen_through"), "must lie between 0 and 1"));
        }
        if self.range_limit_m > RANGE_LIMIT_MAX_M {
            let problem = format!("must be at most {RANGE_LIMIT_MAX_M}");
            return Err(ConfigError::new(format!("{path}.range_limit_m"), problem));
        }
        Ok(())
    }
}
