//! One sweep of a 2D laser with the odometry at its time (thesis section 2.1).

use serde::{Deserialize, Serialize};

use crate::geometry::{Point2, Pose2};

/// What all scans of a run share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScanGeometry {
    /// Readings per scan.
    pub num_ranges: usize,
    /// Direction of the first beam in the laser's frame.
    pub angle_min_rad: f64,
    /// From one beam to the next; negative when the sweep runs clockwise.
    pub angle_increment_rad: f64,
    /// A reading at or above this, NaN or infinite, means "no return".
    pub range_max_m: f64,
    /// Where the laser sits on the robot.
    pub robot_from_laser: Pose2,
}

impl ScanGeometry {
    /// Direction of a beam in the laser's frame.
    pub fn beam_angle_rad(&self, beam_idx: usize) -> f64 {
        self.angle_min_rad + beam_idx as f64 * self.angle_increment_rad
    }

    /// True when the reading met an obstacle: finite, positive and below the sensor's maximum.
    pub fn is_return(&self, range_m: f32) -> bool {
        range_m.is_finite() && range_m > 0.0 && f64::from(range_m) < self.range_max_m
    }

    /// End points of all returns not farther than `limit_m`, in the robot's frame, with their beam index.
    pub fn endpoints<'a>(
        &'a self,
        ranges_m: &'a [f32],
        limit_m: f64,
    ) -> impl Iterator<Item = (usize, Point2)> + 'a {
        self.endpoints_of_every(1, ranges_m, limit_m)
    }

    /// The same of one beam in every `stride`.
    pub fn endpoints_of_every<'a>(
        &'a self,
        stride: usize,
        ranges_m: &'a [f32],
        limit_m: f64,
    ) -> impl Iterator<Item = (usize, Point2)> + 'a {
        ranges_m.iter().enumerate().step_by(stride).filter_map(move |(beam_idx, &range_m)| {
            let range = f64::from(range_m);
            if !self.is_return(range_m) || range > limit_m {
                return None;
            }
            let (sin, cos) = self.beam_angle_rad(beam_idx).sin_cos();
            let in_laser = Point2::new(range * cos, range * sin);
            Some((beam_idx, self.robot_from_laser.transform_point(&in_laser)))
        })
    }
}

/// One sweep. Its place in the run is its sequence number, never its timestamp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// As the robot's clock said, nanoseconds; stored and served, never used to sort.
    pub timestamp_ns: i64,
    /// Raw odometry of the robot at the time of the scan; of a robot without odometry always the same.
    pub odom_from_robot: Pose2,
    /// How fast the robot turned then by a gyroscope of its own, counter-clockwise; none where it has none.
    pub angular_velocity_rad_per_s: Option<f64>,
    /// Readings in metres, in the order of the geometry's beams. Zero says nothing, as does a reading that is missing at
    /// the end.
    pub ranges_m: Vec<f32>,
}
