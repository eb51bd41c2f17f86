//! True poses at some scans of a recording: lines of `timestamp x y theta`.

use std::fmt::Write as _;

use super::FormatError;
use super::decimal_time::{format_seconds, parse_seconds_ns};
use super::fields::{Fields, content_lines};
use crate::geometry::Pose2;

/// Where the robot truly was at one scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthPose {
    /// Timestamp of the scan, exactly as in its log.
    pub timestamp_ns: i64,
    /// Pose in the truth's frame, which is not the odometry's.
    pub truth_from_robot: Pose2,
}

/// Reads `timestamp x y theta` lines (seconds, metres, radians); `#` begins a comment line.
///
/// # Errors
/// The first line that cannot be read.
pub fn parse_truth(text: &str) -> Result<Vec<TruthPose>, FormatError> {
    content_lines(text)
        .map(|(line_number, line)| {
            let mut fields = Fields::new(line, line_number);
            let word = fields.word_or("timestamp", 0)?;
            let timestamp_ns = parse_seconds_ns(word)
                .ok_or_else(|| fields.error(format!("timestamp '{word}' is not a number of seconds")))?;
            Ok(TruthPose { timestamp_ns, truth_from_robot: fields.pose("pose")? })
        })
        .collect()
}

/// Writes what [`parse_truth`] reads, micrometres and microradians.
pub fn truth_text(poses: &[TruthPose]) -> String {
    let mut text = String::from("# timestamp x y theta\n");
    for pose in poses {
        let Pose2 { x, y, theta } = pose.truth_from_robot;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} {x:.6} {y:.6} {theta:.6}", format_seconds(pose.timestamp_ns));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_back_what_it_wrote() {
        let poses = vec![
            TruthPose {
                timestamp_ns: 976_052_890_244_111_000,
                truth_from_robot: Pose2::new(0.600_266, -0.032_033, -3.0),
            },
            TruthPose { timestamp_ns: 25_466_000, truth_from_robot: Pose2::new(40.0291, 41.4063, 0.5) },
        ];
        assert_eq!(parse_truth(&truth_text(&poses)), Ok(poses));
    }

    #[test]
    fn says_which_line_is_wrong() {
        let error = parse_truth("# comment\n\n1.5 1 2 3\n1.6 1 two 3\n").unwrap_err();
        assert_eq!(error.to_string(), "line 4: pose is 'two', not a finite number");
        assert_eq!(parse_truth("x 1 2 3").unwrap_err().line, 1);
    }
}
