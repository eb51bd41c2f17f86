//! The TUM trajectory format, which common trajectory evaluation tools read.
//!
//! `timestamp tx ty tz qx qy qz qw`, seconds and metres, one pose per line, `#` starts a comment.

use std::fmt::Write as _;

use crate::geometry::Pose2;

/// Nanoseconds per second.
const SECOND_NS: i64 = 1_000_000_000;

/// Writes stamped poses of the plane; positions with 6 and orientations with 9 decimals, time exactly.
pub fn write_tum(poses: impl IntoIterator<Item = (i64, Pose2)>) -> String {
    let mut text = String::new();
    for (timestamp_ns, pose) in poses {
        let sign = if timestamp_ns < 0 { "-" } else { "" };
        let (seconds, rest) =
            (timestamp_ns.unsigned_abs() / SECOND_NS as u64, timestamp_ns.unsigned_abs() % SECOND_NS as u64);
        let (qz, qw) = (pose.theta / 2.0).sin_cos();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{sign}{seconds}.{rest:09} {:.6} {:.6} 0 0 0 {qz:.9} {qw:.9}", pose.x, pose.y);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact_and_headings_half_angles() {
        let poses = [
            (1_234_567_890_123_456_789, Pose2::new(1.5, -2.25, std::f64::consts::PI)),
            (-1_500_000_000, Pose2::new(0.0, 0.0, -0.5)),
        ];
        let written = write_tum(poses);
        let lines: Vec<&str> = written.lines().collect();
        assert_eq!(lines[0], "1234567890.123456789 1.500000 -2.250000 0 0 0 1.000000000 0.000000000");
        assert_eq!(lines[1], "-1.500000000 0.000000 0.000000 0 0 0 -0.247403959 0.968912422");
    }
}
