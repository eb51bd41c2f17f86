//! Values of the engine as the API writes them.

use locution_client as wire;
use locution_engine::geometry::Pose2;
use locution_engine::scan::{Scan, ScanGeometry};

/// A pose as the API writes it.
pub fn wire_pose(pose: &Pose2) -> wire::Pose {
    wire::Pose { x: pose.x, y: pose.y, theta: pose.theta }
}

/// A laser as the API writes it.
pub fn wire_geometry(geometry: &ScanGeometry) -> wire::Geometry {
    wire::Geometry {
        num_ranges: geometry.num_ranges,
        num_ranges_min: None,
        angle_min_rad: geometry.angle_min_rad,
        angle_increment_rad: geometry.angle_increment_rad,
        range_max_m: geometry.range_max_m,
        range_min_m: 0.0,
        robot_from_laser: wire_pose(&geometry.robot_from_laser),
    }
}

/// A scan as the API writes it; what is no return by the geometry is none on the wire, and zero says nothing there, too.
pub fn wire_scan(geometry: &ScanGeometry, scan: &Scan) -> wire::Scan {
    let is_told = |range_m: f32| range_m == 0.0 || geometry.is_return(range_m);
    let reading = |&range_m: &f32| if is_told(range_m) { range_m } else { f32::INFINITY };
    wire::Scan {
        timestamp_ns: scan.timestamp_ns,
        odom_from_robot: Some(wire_pose(&scan.odom_from_robot)),
        angular_velocity_rad_per_s: scan.angular_velocity_rad_per_s,
        ranges_m: scan.ranges_m.iter().map(reading).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_that_says_nothing_does_not_become_free_ground() {
        let geometry = ScanGeometry {
            num_ranges: 4,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            range_max_m: 10.0,
            robot_from_laser: Pose2::identity(),
        };
        let scan = Scan {
            timestamp_ns: 1,
            odom_from_robot: Pose2::identity(),
            angular_velocity_rad_per_s: None,
            ranges_m: vec![0.0, 2.5, 10.0, f32::NAN],
        };
        assert_eq!(wire_scan(&geometry, &scan).ranges_m, [0.0, 2.5, f32::INFINITY, f32::INFINITY]);
    }
}
