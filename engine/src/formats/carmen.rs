//! CARMEN text logs: the format in which most public 2D laser recordings are kept.
//!
//! One message a line. Two kinds carry a scan of the front laser together with raw odometry:
//! - `FLASER n r1..rn x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp`,
//! - `ROBOTLASER1 type start fov resolution range_max accuracy remission n r1..rn m remissions..
//!   laser_x laser_y laser_theta robot_x robot_y robot_theta … ipc_timestamp host logger_timestamp`.
//!
//! `x y theta` is where the laser was and `odom_*` where the robot was, both by odometry, which gives the mounting
//! of the laser. Some logs carry a *corrected* pose in `x y theta`, so odometry is only ever read from `odom_*`.
//! PARAM lines may say which angle a FLASER message covers; all other messages are passed over.

use super::decimal_time::parse_seconds_ns;
use super::fields::without_mark;
use super::flaser_beams::{BeamAngles, StatedLaser};
use super::{Fields, FormatError};
use crate::geometry::Pose2;
use crate::scan::{Scan, ScanGeometry};

/// Which message carried a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CarmenMessage {
    /// The older message; its beam angles are stated by the log, or follow from the number of readings.
    Flaser,
    /// The newer message; it describes its sensor.
    RobotLaser1,
}

/// One scan as a line tells it, before anything is known of the rest of the log.
#[derive(Clone, Debug, PartialEq)]
pub struct CarmenScan {
    /// The message.
    pub message: CarmenMessage,
    /// Where the beams point, where the message says it.
    pub beams: Option<BeamAngles>,
    /// Maximum range, where the message says it.
    pub range_max_m: Option<f64>,
    /// The laser seen from the robot, by the two poses of the line.
    pub robot_from_laser: Pose2,
    /// Timestamp (ipc_timestamp), odometry of the robot and readings.
    pub scan: Scan,
}

/// What the reader is told about a log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CarmenOptions {
    /// Readings at or above this are "no return"; `None` infers it from the log.
    pub range_max_m: Option<f64>,
    /// Angle that the readings of a FLASER message cover; `None` takes it from the log. The newer message says it.
    pub field_of_view_deg: Option<f64>,
    /// Pass over lines that cannot be read, such as a last line that was cut off, instead of failing.
    pub skip_malformed: bool,
}

/// A whole recording: what all scans share, and the scans in file order.
#[derive(Clone, Debug, PartialEq)]
pub struct CarmenLog {
    /// The laser.
    pub geometry: ScanGeometry,
    /// Scans in file order, which is their true order even where timestamps jitter.
    pub scans: Vec<Scan>,
    /// Lines passed over because they could not be read, with the reason.
    pub skipped: Vec<FormatError>,
}

/// Reads one line; `None` when it carries no scan of the front laser.
///
/// # Errors
/// A scan message that is cut off or holds something that is not a number, with `line_number` (from 1).
pub fn parse_carmen_line(line: &str, line_number: usize) -> Result<Option<CarmenScan>, FormatError> {
    let mut fields = Fields::new(line, line_number);
    match fields.next_word() {
        Some("FLASER") => parse_flaser(&mut fields).map(Some),
        Some("ROBOTLASER1") => parse_robot_laser(&mut fields).map(Some),
        _ => Ok(None),
    }
}

/// Reads a log line by line. Only messages of the kind that is seen first are taken.
///
/// The maximum range is the option's, else the smaller of what the messages say and what the readings show (see
/// [`CarmenOptions`]); the laser's mounting is the median over all lines.
///
/// # Errors
/// The first line that cannot be read (unless the options pass over them) or whose scan has another number of
/// readings or other angles than the first; a log without any scan, or whose readings cover an angle that nothing
/// tells, or are no metres.
pub fn read_carmen_log<'a>(
    lines: impl IntoIterator<Item = &'a str>,
    options: &CarmenOptions,
) -> Result<CarmenLog, FormatError> {
    let mut reader = CarmenReader::new(*options);
    for line in lines {
        reader.push_line(line)?;
    }
    reader.finish()
}

/// The push form of [`read_carmen_log`], for callers who stream a file.
#[derive(Clone, Debug)]
pub struct CarmenReader {
    options: CarmenOptions,
    num_lines: usize,
    laser: StatedLaser,
    /// The scan that was taken first, and its line.
    first: Option<(usize, CarmenScan)>,
    mountings: Vec<Pose2>,
    scans: Vec<Scan>,
    skipped: Vec<FormatError>,
}

impl CarmenReader {
    /// A reader that has seen no line.
    pub fn new(options: CarmenOptions) -> Self {
        let (mountings, scans, skipped) = (Vec::new(), Vec::new(), Vec::new());
        let laser = StatedLaser::default();
        Self { options, num_lines: 0, laser, first: None, mountings, scans, skipped }
    }

    /// Takes the next line, without its line feed.
    ///
    /// # Errors
    /// As [`read_carmen_log`].
    pub fn push_line(&mut self, line: &str) -> Result<(), FormatError> {
        self.num_lines += 1;
        let line = if self.num_lines == 1 { without_mark(line) } else { line };
        if let Some(parameter) = line.strip_prefix("PARAM ") {
            self.laser.note(&mut Fields::new(parameter, self.num_lines));
            return Ok(());
        }
        let taken = parse_carmen_line(line, self.num_lines).and_then(|scan| self.take(scan));
        match taken {
            Err(error) if self.options.skip_malformed => self.skipped.push(error),
            other => other?,
        }
        Ok(())
    }

    fn take(&mut self, scan: Option<CarmenScan>) -> Result<(), FormatError> {
        let Some(scan) = scan else { return Ok(()) };
        if let Some((_, first)) = &self.first {
            if first.message != scan.message {
                return Ok(());
            }
            if first.scan.ranges_m.len() != scan.scan.ranges_m.len() {
                let (given, expected) = (scan.scan.ranges_m.len(), first.scan.ranges_m.len());
                let problem = format!("{given} readings, but the first scan of the log has {expected}");
                return Err(FormatError::new(self.num_lines, problem));
            }
            let differ = |a: BeamAngles, b: BeamAngles| {
                (a.min_rad - b.min_rad).abs() > 1e-6 || (a.increment_rad - b.increment_rad).abs() > 1e-9
            };
            if first.beams.zip(scan.beams).is_some_and(|(a, b)| differ(a, b)) {
                return Err(FormatError::new(
                    self.num_lines,
                    "beam angles differ from the first scan of the log",
                ));
            }
        }
        self.mountings.push(scan.robot_from_laser);
        self.scans.push(scan.scan.clone());
        self.first.get_or_insert((self.num_lines, scan));
        Ok(())
    }

    /// The recording.
    ///
    /// # Errors
    /// No line carried a scan; nothing tells the angles of the beams; the readings are no metres.
    pub fn finish(self) -> Result<CarmenLog, FormatError> {
        let Some((line, first)) = &self.first else {
            return Err(FormatError::new(self.num_lines, "the log holds no FLASER or ROBOTLASER1 message"));
        };
        let num_ranges = first.scan.ranges_m.len();
        let beams = match first.beams {
            Some(beams) => beams,
            None => self
                .laser
                .beams(num_ranges, self.options.field_of_view_deg)
                .map_err(|problem| FormatError::new(*line, problem))?,
        };
        check_meters(&self.scans, *line)?;
        let geometry = ScanGeometry {
            num_ranges,
            angle_min_rad: beams.min_rad,
            angle_increment_rad: beams.increment_rad,
            range_max_m: self
                .options
                .range_max_m
                .unwrap_or_else(|| range_max_m(first.range_max_m, &self.scans)),
            robot_from_laser: median_mounting(&self.mountings),
        };
        Ok(CarmenLog { geometry, scans: self.scans, skipped: self.skipped })
    }
}

fn parse_flaser(fields: &mut Fields<'_>) -> Result<CarmenScan, FormatError> {
    let ranges_m = parse_readings(fields)?;
    let odom_from_laser = fields.pose("laser pose")?;
    let odom_from_robot = fields.pose("odometry pose")?;
    let timestamp_ns = parse_timestamp(fields)?;
    Ok(CarmenScan {
        message: CarmenMessage::Flaser,
        beams: None,
        range_max_m: None,
        robot_from_laser: odom_from_robot.between(&odom_from_laser),
        scan: Scan { timestamp_ns, odom_from_robot, angular_velocity_rad_per_s: None, ranges_m },
    })
}

fn parse_robot_laser(fields: &mut Fields<'_>) -> Result<CarmenScan, FormatError> {
    fields.number("laser type")?;
    let angle_min_rad = fields.number("start angle")?;
    let field_of_view_rad = fields.number("field of view")?;
    let resolution_rad = fields.number("angular resolution")?;
    for (name, angle_rad) in [("start angle", angle_min_rad), ("field of view", field_of_view_rad)] {
        if angle_rad.abs() > 1.001 * std::f64::consts::TAU {
            return Err(fields.error(format!("{name} is {angle_rad} rad, more than a full turn: degrees?")));
        }
    }
    // Through 32 bits like the readings, so that a reading of the same text is not below it.
    let range_max_m = f64::from(fields.number("maximum range")? as f32);
    fields.number("accuracy")?;
    fields.number("remission mode")?;
    let ranges_m = parse_readings(fields)?;
    let num_remissions = fields.count("number of remissions")?;
    for _ in 0..num_remissions {
        fields.number("remission")?;
    }
    let odom_from_laser = fields.pose("laser pose")?;
    let odom_from_robot = fields.pose("robot pose")?;
    for name in
        ["translational velocity", "rotational velocity", "forward distance", "side distance", "turn axis"]
    {
        fields.number(name)?;
    }
    let timestamp_ns = parse_timestamp(fields)?;
    let angle_increment_rad =
        if resolution_rad == 0.0 { field_of_view_rad / ranges_m.len() as f64 } else { resolution_rad };
    Ok(CarmenScan {
        message: CarmenMessage::RobotLaser1,
        beams: Some(BeamAngles { min_rad: angle_min_rad, increment_rad: angle_increment_rad }),
        range_max_m: (range_max_m > 0.0).then_some(range_max_m),
        robot_from_laser: odom_from_robot.between(&odom_from_laser),
        scan: Scan { timestamp_ns, odom_from_robot, angular_velocity_rad_per_s: None, ranges_m },
    })
}

/// Count and readings. What is not a positive finite number of metres is an error code of the sensor and becomes ∞,
/// "no return".
fn parse_readings(fields: &mut Fields<'_>) -> Result<Vec<f32>, FormatError> {
    let num_ranges = fields.count("number of readings")?;
    if num_ranges < 2 {
        return Err(fields.error(format!("a scan of {num_ranges} readings")));
    }
    // The count is a claim until the readings are there, so it reserves no more than the line could hold.
    let mut ranges_m = Vec::with_capacity(num_ranges.min(4096));
    for idx in 0..num_ranges {
        let word = fields.word_or("reading", idx)?;
        let range_m: f32 =
            word.parse().map_err(|_| fields.error(format!("reading {idx} is '{word}', not a number")))?;
        ranges_m.push(if range_m.is_finite() && range_m >= 0.0 { range_m } else { f32::INFINITY });
    }
    Ok(ranges_m)
}

fn parse_timestamp(fields: &mut Fields<'_>) -> Result<i64, FormatError> {
    let word = fields.word_or("ipc_timestamp", 0)?;
    parse_seconds_ns(word)
        .ok_or_else(|| fields.error(format!("ipc_timestamp '{word}' is not a number of seconds")))
}

/// No laser sees farther than this, metres.
const PLAUSIBLE_RANGE_M: f32 = 200.0;

/// Refuses a log most of whose readings are no metres.
fn check_meters(scans: &[Scan], line: usize) -> Result<(), FormatError> {
    let readings = || scans.iter().flat_map(|scan| &scan.ranges_m).filter(|range| range.is_finite());
    let num_far = readings().filter(|&&range| range > PLAUSIBLE_RANGE_M).count();
    if 2 * num_far > readings().count() {
        let problem = "most readings of the log are beyond 200 m: they must be metres, not millimetres";
        return Err(FormatError::new(line, problem));
    }
    Ok(())
}

/// Where "no return" begins.
///
/// Sensors report "no return" as one value or a few neighbouring codes at the top of their scale (81.83, 81.87 and
/// 81.91 m, say), and logs seldom say which. The codes are recognised by how often they occur: the smallest value
/// within 3 % of the largest reading that makes up at least 1 % of the readings in that band. When hardly anything
/// lies in the band (below 1 in 10,000 readings) the largest reading was a wall, and the maximum is set above it.
fn range_max_m(stated_m: Option<f64>, scans: &[Scan]) -> f64 {
    let readings = || scans.iter().flat_map(|scan| &scan.ranges_m).copied().filter(|range| range.is_finite());
    let largest = readings().fold(0.0f32, f32::max);
    let mut band: Vec<f32> = readings().filter(|&range| range >= 0.97 * largest).collect();
    band.sort_by(f32::total_cmp);
    let inferred_m = if band.len() * 10_000 >= readings().count() {
        let frequent = band.chunk_by(|a, b| a == b).find(|same| same.len() * 100 >= band.len());
        frequent.map_or(f64::from(largest), |same| f64::from(same[0]))
    } else {
        f64::from(largest) + 0.01
    };
    // A log without a single reading above zero still needs a maximum that a geometry may have.
    stated_m.map_or(inferred_m, |stated_m| stated_m.min(inferred_m)).max(0.01)
}

/// The mounting that the two poses of each line agree on, to a tenth of a millimetre and of a milliradian.
///
/// Where they do not agree, the first pose is not odometry (it was corrected by somebody's SLAM) and says nothing
/// about the mounting; the laser is then taken to sit at the robot's centre.
fn median_mounting(mountings: &[Pose2]) -> Pose2 {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let coordinate = |of: fn(&Pose2) -> f64| median(mountings.iter().map(of).collect());
    let center =
        Pose2::new(coordinate(|pose| pose.x), coordinate(|pose| pose.y), coordinate(|pose| pose.theta));
    let spread_m = median(mountings.iter().map(|pose| pose.distance(&center)).collect());
    let spread_rad = median(mountings.iter().map(|pose| center.between(pose).theta.abs()).collect());
    if spread_m > 0.02 || spread_rad > 0.02 {
        return Pose2::identity();
    }
    let rounded = |value: f64| (value * 1e4).round() / 1e4 + 0.0;
    Pose2::new(rounded(center.x), rounded(center.y), rounded(center.theta))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flaser(ranges: &str, poses: &str, timestamp: &str) -> String {
        format!("FLASER {} {ranges} {poses} {timestamp} host 0.1", ranges.split(' ').count())
    }

    fn read(text: &str) -> Result<CarmenLog, FormatError> {
        read_carmen_log(text.lines(), &CarmenOptions::default())
    }

    #[test]
    fn flaser_gives_odometry_mounting_and_exact_time() {
        let line = flaser("1.5 2.5 81.83 0 0", "1.0 2.25 1.5707963 1.0 2.0 1.5707963", "976052857.337284");
        let log = read(&format!("# comment\nPARAM x 1 nohost 0\nODOM 0 0 0 0 0 0 1 h 1\n{line}\n")).unwrap();
        assert_eq!(log.geometry.num_ranges, 5);
        assert_eq!(log.geometry.robot_from_laser, Pose2::new(0.25, 0.0, 0.0));
        assert_eq!(log.geometry.range_max_m, f64::from(81.83f32));
        assert_eq!(log.scans.len(), 1);
        assert_eq!(log.scans[0].timestamp_ns, 976_052_857_337_284_000);
        assert_eq!(log.scans[0].odom_from_robot.position(), crate::geometry::Point2::new(1.0, 2.0));
        assert!(!log.geometry.is_return(log.scans[0].ranges_m[2]) && log.geometry.is_return(2.5));
    }

    #[test]
    fn flaser_angles_follow_from_the_number_of_readings() {
        for (num_ranges, increment_deg, last_deg) in
            [(180, 1.0, 89.0), (181, 1.0, 90.0), (360, 0.5, 89.5), (361, 0.5, 90.0)]
        {
            let ranges = vec!["1.0"; num_ranges].join(" ");
            let geometry = read(&flaser(&ranges, "0 0 0 0 0 0", "1.0")).unwrap().geometry;
            assert!((geometry.angle_increment_rad.to_degrees() - increment_deg).abs() < 1e-9);
            assert!((geometry.beam_angle_rad(0).to_degrees() + 90.0).abs() < 1e-9);
            assert!((geometry.beam_angle_rad(num_ranges - 1).to_degrees() - last_deg).abs() < 1e-9);
        }
    }

    #[test]
    fn robotlaser1_describes_its_sensor() {
        let line = "ROBOTLASER1 0 -2.0 4.0 2.0 4.0 0.01 0 3 1.0 4.095 0.007 2 7 8 \
                    0.145 0 0 0 0 0 0.5 0.1 0 0 0 212.387282 mines 212.387282";
        let log = read(line).unwrap();
        let geometry = ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -2.0,
            angle_increment_rad: 2.0,
            range_max_m: 4.0,
            robot_from_laser: Pose2::new(0.145, 0.0, 0.0),
        };
        assert_eq!(log.geometry, geometry);
        assert_eq!(log.scans[0].timestamp_ns, 212_387_282_000);
    }

    #[test]
    fn neighbouring_codes_are_all_no_return_and_a_wall_is_not() {
        let codes = ["81.83", "81.87", "81.91", "81.91", "3.0"];
        let log = read(&flaser(&codes.join(" "), "0 0 0 0 0 0", "1")).unwrap();
        assert_eq!(log.geometry.range_max_m, f64::from(81.83f32));
        // One far wall among very many near ones is a wall.
        let ranges: Vec<String> = (0..30_000).map(|idx| format!("{}", f64::from(idx % 7) + 1.0)).collect();
        let line = flaser(&format!("{} 12.5", ranges.join(" ")), "0 0 0 0 0 0", "1");
        let options = CarmenOptions { field_of_view_deg: Some(270.0), ..CarmenOptions::default() };
        let log = read_carmen_log([line.as_str()], &options).unwrap();
        assert!(log.geometry.is_return(12.5));
    }

    #[test]
    fn a_log_may_begin_with_a_byte_order_mark_and_end_its_lines_as_windows_does() {
        let line = flaser("1 2 2", "0 0 0 0 0 0", "1");
        let mut reader = CarmenReader::new(CarmenOptions::default());
        for line in [format!("\u{feff}{line}\r"), format!("{line}\r")] {
            reader.push_line(&line).unwrap();
        }
        assert_eq!(reader.finish().unwrap().scans.len(), 2);
    }

    #[test]
    fn parameters_of_the_log_tell_the_angles() {
        let line = flaser(&vec!["1.0"; 682].join(" "), "0 0 0 0 0 0", "1.0");
        let problem = read(&line).unwrap_err();
        assert!(problem.line == 1 && problem.problem.contains("682 readings"), "{problem}");
        let parameter = "PARAM laser_front_laser_fov 239.77 nohost 0\n";
        let geometry = read(&format!("{parameter}{line}")).unwrap().geometry;
        assert!((geometry.angle_increment_rad - 0.006_136).abs() < 1e-6);
        assert!((geometry.angle_min_rad + 2.092_388).abs() < 1e-6);
    }

    #[test]
    fn what_cannot_be_metres_or_radians_is_told() {
        let millimetres = flaser("1000 2000 3000", "0 0 0 0 0 0", "1");
        assert!(read(&millimetres).unwrap_err().problem.contains("metres"));
        let degrees = "ROBOTLASER1 0 -90 180 1 80 0.01 0 3 1 2 3 0 0 0 0 0 0 0 0 0 0 0 0 1 h 1";
        assert!(read(degrees).unwrap_err().problem.contains("degrees"));
    }

    #[test]
    fn an_option_sets_the_maximum_range() {
        let options = CarmenOptions { range_max_m: Some(30.0), ..CarmenOptions::default() };
        let line = flaser("1 2 81.83", "0 0 0 0 0 0", "1");
        assert_eq!(read_carmen_log([line.as_str()], &options).unwrap().geometry.range_max_m, 30.0);
    }

    #[test]
    fn a_corrected_laser_pose_says_nothing_about_the_mounting() {
        let lines: Vec<String> =
            (0..9).map(|idx| flaser("1 2 2", &format!("{idx} {} 0.5 0 0 0", 2 * idx), "1")).collect();
        let log = read(&lines.join("\n")).unwrap();
        assert_eq!(log.geometry.robot_from_laser, Pose2::identity());
    }

    #[test]
    fn errors_say_line_and_cause() {
        let good = flaser("1 2 2", "0 0 0 0 0 0", "1");
        for (bad, problem) in [
            ("FLASER", "the line ends before the number of readings"),
            ("FLASER x 1 2", "number of readings is 'x', not a count"),
            ("FLASER 1 2.0 0 0 0 0 0 0 1 h 1", "a scan of 1 readings"),
            ("FLASER 3 1.0 2.0", "the line ends before reading 2"),
            ("FLASER 2 1.0 wall 0 0 0 0 0 0 1 h 1", "reading 1 is 'wall', not a number"),
            ("FLASER 2 1.0 2.0 0 0 0 0 nan 0 1 h 1", "odometry pose is 'nan', not a finite number"),
            ("FLASER 2 1.0 2.0 0 0 0 0 0 0 now h 1", "ipc_timestamp 'now' is not a number of seconds"),
            ("FLASER 2 1 2 0 0 0 0 0 0 1 h 1", "2 readings, but the first scan of the log has 3"),
        ] {
            let error = read(&format!("{good}\n{bad}\n")).unwrap_err();
            assert_eq!((error.line, error.problem.as_str()), (2, problem));
        }
        assert_eq!(
            read("# nothing\n").unwrap_err().problem,
            "the log holds no FLASER or ROBOTLASER1 message"
        );
        assert!(read(&format!("FLASER {}", usize::MAX)).is_err());
    }

    #[test]
    fn malformed_lines_can_be_passed_over() {
        let options = CarmenOptions { skip_malformed: true, ..CarmenOptions::default() };
        let good = flaser("1 2 2", "0 0 0 0 0 0", "1");
        let text = format!("{good}\n{good}\n{}", &good[..12]);
        let log = read_carmen_log(text.lines(), &options).unwrap();
        assert_eq!((log.scans.len(), log.skipped.len(), log.skipped[0].line), (2, 1, 3));
    }
}
