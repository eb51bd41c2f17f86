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
        angle_min_rad: geometry.angle_min_rad,
        angle_increment_rad: geometry.angle_increment_rad,
        range_max_m: geometry.range_max_m,
        robot_from_laser: wire_pose(&geometry.robot_from_laser),
    }
}

/// A scan as the API writes it; what is no return by the geometry is none on the wire.
pub fn wire_scan(geometry: &ScanGeometry, scan: &Scan) -> wire::Scan {
    let reading = |&range_m: &f32| if geometry.is_return(range_m) { range_m } else { f32::INFINITY };
    wire::Scan {
        timestamp_ns: scan.timestamp_ns,
        odom_from_robot: wire_pose(&scan.odom_from_robot),
        ranges_m: scan.ranges_m.iter().map(reading).collect(),
    }
}
