//! Writes the CARMEN messages that [`super::read_carmen_log`] reads.

use std::fmt::Write as _;

use super::decimal_time::format_seconds;
use crate::geometry::Pose2;
use crate::scan::{Scan, ScanGeometry};

/// Comment lines that name the messages, for the head of a log.
pub fn carmen_header(title: &str) -> String {
    format!(
        "# {title}\n\
         # ODOM x y theta tv rv accel ipc_timestamp ipc_hostname logger_timestamp\n\
         # ROBOTLASER1 laser_type start_angle field_of_view angular_resolution maximum_range accuracy remission_mode \
         num_readings [range_readings] num_remissions [] laser_x laser_y laser_theta robot_x robot_y robot_theta \
         laser_tv laser_rv forward_safety_dist side_safety_dist turn_axis ipc_timestamp ipc_hostname \
         logger_timestamp\n"
    )
}

/// One scan as an `ODOM` and a `ROBOTLASER1` line: millimetres, micrometres for poses. What is no return is written
/// as the maximum range.
pub fn carmen_scan_lines(geometry: &ScanGeometry, scan: &Scan, host: &str) -> String {
    let robot = scan.odom_from_robot;
    let laser = robot.compose(&geometry.robot_from_laser);
    let time = format_seconds(scan.timestamp_ns);
    let pose = |pose: Pose2| format!("{:.6} {:.6} {:.6}", pose.x, pose.y, pose.theta);
    let field_of_view_rad = geometry.angle_increment_rad * geometry.num_ranges.saturating_sub(1) as f64;
    let mut text = format!("ODOM {} 0 0 0 {time} {host} {time}\n", pose(robot));
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "ROBOTLASER1 0 {:.9} {field_of_view_rad:.9} {:.9} {:.3} 0.01 0 {}",
        geometry.angle_min_rad, geometry.angle_increment_rad, geometry.range_max_m, geometry.num_ranges
    );
    for &range_m in &scan.ranges_m {
        let written_m = if geometry.is_return(range_m) { f64::from(range_m) } else { geometry.range_max_m };
        let _ = write!(text, " {written_m:.3}");
    }
    let _ = writeln!(text, " 0 {} {} 0 0 0 0 0 {time} {host} {time}", pose(laser), pose(robot));
    text
}

#[cfg(test)]
mod tests {
    use super::super::{CarmenOptions, read_carmen_log};
    use super::*;

    #[test]
    fn a_written_log_reads_back() {
        let geometry = ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -1.5,
            angle_increment_rad: 1.5,
            range_max_m: 30.0,
            robot_from_laser: Pose2::new(0.2, -0.1, 0.3),
        };
        let scans: Vec<Scan> = (0..5)
            .map(|idx| Scan {
                timestamp_ns: 1_000_000 * idx,
                odom_from_robot: Pose2::new(0.1 * idx as f64, 1.0, -0.5),
                angular_velocity_rad_per_s: None,
                ranges_m: vec![1.25, 30.0, 2.5],
            })
            .collect();
        let mut text = carmen_header("a test");
        for scan in &scans {
            text += &carmen_scan_lines(&geometry, scan, "simulated");
        }
        let log = read_carmen_log(text.lines(), &CarmenOptions::default()).unwrap();
        assert_eq!(log.geometry, geometry);
        assert_eq!(log.scans.len(), 5);
        for (read, written) in log.scans.iter().zip(&scans) {
            assert_eq!((read.timestamp_ns, &read.ranges_m), (written.timestamp_ns, &written.ranges_m));
            assert!(read.odom_from_robot.distance(&written.odom_from_robot) < 1e-6);
        }
        assert!(!log.geometry.is_return(log.scans[0].ranges_m[1]));
    }
}
