//! What a simulated robot is like.

use serde::{Deserialize, Serialize};

use locution_engine::config_error::ConfigError;
use locution_engine::geometry::Pose2;
use locution_engine::scan::ScanGeometry;

/// Everything about a simulated recording but the building, the task and the seed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimulationConfig {
    /// The sensor.
    pub laser: LaserConfig,
    /// How it drives.
    pub drive: DriveConfig,
    /// How its odometry errs.
    pub odometry: OdometryNoise,
    /// Who else walks there.
    pub people: PeopleConfig,
}

/// A laser scanner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LaserConfig {
    /// Field of view, symmetric about straight ahead, degrees.
    pub field_of_view_deg: f64,
    /// Readings per scan, the first and last at the borders of the field of view.
    pub num_ranges: usize,
    /// Walls farther than this give no return.
    pub range_max_m: f64,
    /// Standard deviation of a reading.
    pub range_noise_std_m: f64,
    /// Distance of the laser ahead of the robot's centre.
    pub ahead_m: f64,
}

impl Default for LaserConfig {
    /// A half-circle scanner of the kind that recorded the public logs, with a noise of 2 cm.
    fn default() -> Self {
        Self {
            field_of_view_deg: 180.0,
            num_ranges: 181,
            range_max_m: 30.0,
            range_noise_std_m: 0.02,
            ahead_m: 0.0,
        }
    }
}

impl LaserConfig {
    /// The geometry of its scans. A full circle does not repeat its first beam.
    pub fn geometry(&self) -> ScanGeometry {
        let field_of_view_rad = self.field_of_view_deg.to_radians();
        let num_gaps = if self.field_of_view_deg >= 360.0 { self.num_ranges } else { self.num_ranges - 1 };
        ScanGeometry {
            num_ranges: self.num_ranges,
            angle_min_rad: -field_of_view_rad / 2.0,
            angle_increment_rad: field_of_view_rad / num_gaps as f64,
            range_max_m: self.range_max_m,
            robot_from_laser: Pose2::new(self.ahead_m, 0.0, 0.0),
        }
    }
}

/// How a robot drives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DriveConfig {
    /// The robot keeps at least this far from every obstacle.
    pub robot_radius_m: f64,
    /// It would rather keep this far, where there is room.
    pub comfort_m: f64,
    /// It swings from side to side by up to this much, differently every time.
    pub swing_m: f64,
    /// Top speed.
    pub speed_m_per_s: f64,
    /// How fast it speeds up and slows down.
    pub acceleration_m_per_s2: f64,
    /// How fast it turns.
    pub turn_rate_rad_per_s: f64,
    /// Time from one scan to the next.
    pub scan_period_s: f64,
}

impl Default for DriveConfig {
    fn default() -> Self {
        Self {
            robot_radius_m: 0.25,
            comfort_m: 0.8,
            swing_m: 0.25,
            speed_m_per_s: 0.7,
            acceleration_m_per_s2: 0.6,
            turn_rate_rad_per_s: 0.8,
            scan_period_s: 0.1,
        }
    }
}

/// Errors of wheel odometry. All zero is perfect odometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryNoise {
    /// Systematic error of the length, drawn once per robot.
    pub scale_std: f64,
    /// Systematic turning per metre driven, drawn once per robot.
    pub bend_std_rad_per_m: f64,
    /// Noise of the length after one metre.
    pub translation_std_m_per_sqrt_m: f64,
    /// Noise of the heading after one metre driven straight.
    pub turn_std_rad_per_sqrt_m: f64,
    /// Noise of the heading after one radian turned.
    pub turn_std_rad_per_sqrt_rad: f64,
}

impl Default for OdometryNoise {
    /// A good two-wheeled robot: about 1 % of the length and 3° of heading after 20 m with two corners.
    fn default() -> Self {
        Self {
            scale_std: 0.01,
            bend_std_rad_per_m: 0.001,
            translation_std_m_per_sqrt_m: 0.01,
            turn_std_rad_per_sqrt_m: 0.008,
            turn_std_rad_per_sqrt_rad: 0.02,
        }
    }
}

impl OdometryNoise {
    /// The same kind of odometry, `factor` times as bad; 0 is perfect.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            scale_std: self.scale_std * factor,
            bend_std_rad_per_m: self.bend_std_rad_per_m * factor,
            translation_std_m_per_sqrt_m: self.translation_std_m_per_sqrt_m * factor,
            turn_std_rad_per_sqrt_m: self.turn_std_rad_per_sqrt_m * factor,
            turn_std_rad_per_sqrt_rad: self.turn_std_rad_per_sqrt_rad * factor,
        }
    }
}

/// People who walk about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PeopleConfig {
    /// How many.
    pub num_people: usize,
    /// Their radius as the laser sees them.
    pub radius_m: f64,
    /// Their speed; each walks between 0.7 and 1.3 times as fast.
    pub speed_m_per_s: f64,
}

impl Default for PeopleConfig {
    fn default() -> Self {
        Self { num_people: 0, radius_m: 0.22, speed_m_per_s: 1.1 }
    }
}

impl SimulationConfig {
    /// Checks every value; `path` is put before the field's name.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let (laser, drive, people) = (&self.laser, &self.drive, &self.people);
        let positive = [
            ("laser.range_max_m", laser.range_max_m),
            ("laser.field_of_view_deg", laser.field_of_view_deg),
            ("drive.robot_radius_m", drive.robot_radius_m),
            ("drive.comfort_m", drive.comfort_m),
            ("drive.speed_m_per_s", drive.speed_m_per_s),
            ("drive.acceleration_m_per_s2", drive.acceleration_m_per_s2),
            ("drive.turn_rate_rad_per_s", drive.turn_rate_rad_per_s),
            ("drive.scan_period_s", drive.scan_period_s),
            ("people.radius_m", people.radius_m),
            ("people.speed_m_per_s", people.speed_m_per_s),
        ];
        let not_negative = [
            ("drive.swing_m", drive.swing_m),
            ("laser.range_noise_std_m", laser.range_noise_std_m),
            ("odometry.scale_std", self.odometry.scale_std),
            ("odometry.bend_std_rad_per_m", self.odometry.bend_std_rad_per_m),
            ("odometry.translation_std_m_per_sqrt_m", self.odometry.translation_std_m_per_sqrt_m),
            ("odometry.turn_std_rad_per_sqrt_m", self.odometry.turn_std_rad_per_sqrt_m),
            ("odometry.turn_std_rad_per_sqrt_rad", self.odometry.turn_std_rad_per_sqrt_rad),
        ];
        let error = |field: &str, problem: String| Err(ConfigError::new(format!("{path}.{field}"), problem));
        for (field, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return error(field, format!("{value} is not above zero"));
            }
        }
        for (field, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return error(field, format!("{value} is negative or not finite"));
            }
        }
        if laser.field_of_view_deg > 360.0 {
            return error(
                "laser.field_of_view_deg",
                format!("{} is more than a circle", laser.field_of_view_deg),
            );
        }
        if laser.num_ranges < 2 {
            return error("laser.num_ranges", format!("{} readings make no scan; 2 do", laser.num_ranges));
        }
        Ok(())
    }
}
