//! Laser messages as the readings of one fixed laser.

use anyhow::{Result, ensure};
use locution_engine::scan::ScanGeometry;

use super::frames::Mounting;
use super::messages::LaserMessage;

/// Beams that are off by less than this are the same.
const ANGLE_TOLERANCE_RAD: f64 = 1e-4;

/// The beams of a run: those of its first message, from right to left as seen from above.
///
/// A laser that hangs upside down, or turns clockwise, sends them the other way round. Some lasers send a reading more
/// or less from turn to turn; each beam then takes the reading nearest to it.
pub struct BeamLayout {
    /// The laser as the run says it.
    pub geometry: ScanGeometry,
    sign: f64,
    range_max_m: f32,
}

impl BeamLayout {
    /// The layout of a first message.
    ///
    /// # Errors
    /// A message that does not describe a laser.
    pub fn new(first: &LaserMessage, mounting: &Mounting, range_max_m: Option<f64>) -> Result<Self> {
        let num_ranges = first.ranges_m.len();
        ensure!(num_ranges >= 2, "a scan of {num_ranges} readings");
        let increment_rad = first.angle_increment_rad;
        ensure!(increment_rad != 0.0 && increment_rad.is_finite(), "an angle_increment of {increment_rad}");
        let range_max_m = range_max_m.unwrap_or(f64::from(first.range_max_m));
        ensure!(
            range_max_m > 0.0 && range_max_m.is_finite(),
            "the scans state a range_max of {range_max_m}; --range-max says it in metres"
        );
        let sign = if mounting.is_upside_down { -1.0 } else { 1.0 };
        let (angle_min_rad, angle_increment_rad) = ordered(first, sign);
        let robot_from_laser = mounting.robot_from_laser;
        let geometry =
            ScanGeometry { num_ranges, angle_min_rad, angle_increment_rad, range_max_m, robot_from_laser };
        Ok(Self { geometry, sign, range_max_m: range_max_m as f32 })
    }

    /// The readings of a message at the beams of the run: infinite where they met nothing, 0 where they say nothing
    /// (REP 117) or no reading is near.
    pub fn ranges_m(&self, message: &LaserMessage) -> Vec<f32> {
        let cleaned = |&range_m: &f32| {
            if range_m.is_nan() || range_m < message.range_min_m || range_m <= 0.0 {
                0.0
            } else if range_m >= self.range_max_m {
                f32::INFINITY
            } else {
                range_m
            }
        };
        let mut ranges_m: Vec<f32> = message.ranges_m.iter().map(cleaned).collect();
        if self.sign * message.angle_increment_rad < 0.0 {
            ranges_m.reverse();
        }
        let (min_rad, increment_rad) = ordered(message, self.sign);
        let geometry = &self.geometry;
        let is_same = ranges_m.len() == geometry.num_ranges
            && (min_rad - geometry.angle_min_rad).abs() < ANGLE_TOLERANCE_RAD
            && (increment_rad - geometry.angle_increment_rad).abs() * ranges_m.len() as f64
                <= ANGLE_TOLERANCE_RAD;
        if is_same {
            return ranges_m;
        }
        let nearest = |beam_idx: usize| {
            let reading = ((geometry.beam_angle_rad(beam_idx) - min_rad) / increment_rad).round();
            if reading < 0.0 { 0.0 } else { ranges_m.get(reading as usize).copied().unwrap_or(0.0) }
        };
        (0..geometry.num_ranges).map(nearest).collect()
    }
}

/// Direction of the rightmost beam and the angle to the next.
fn ordered(message: &LaserMessage, sign: f64) -> (f64, f64) {
    let first_rad = sign * message.angle_min_rad;
    let increment_rad = sign * message.angle_increment_rad;
    if increment_rad > 0.0 {
        return (first_rad, increment_rad);
    }
    let num_gaps = message.ranges_m.len().saturating_sub(1) as f64;
    (first_rad + num_gaps * increment_rad, -increment_rad)
}
