//! The TUM trajectory format, which common trajectory evaluation tools read.
//!
//! `timestamp tx ty tz qx qy qz qw`, seconds and metres, one pose per line, `#` starts a comment.

use std::fmt::Write as _;

use crate::formats::GraphTextError;
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

/// Reads stamped poses; height, roll and pitch are dropped.
///
/// # Errors
/// [`GraphTextError`] naming the first line that has not eight finite numbers or a zero quaternion.
pub fn read_tum(text: &str) -> Result<Vec<(i64, Pose2)>, GraphTextError> {
    let mut poses = Vec::new();
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with('#') || line.trim().is_empty() {
            continue;
        }
        let at_line = |problem: &str| GraphTextError { line: index + 1, problem: problem.to_string() };
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [time, numbers @ ..] = words.as_slice() else { continue };
        let timestamp_ns = parse_seconds(time).ok_or_else(|| at_line("the time stamp is not in seconds"))?;
        let numbers: Vec<f64> = numbers.iter().filter_map(|word| word.parse().ok()).collect();
        let [x, y, z, qx, qy, qz, qw] = numbers[..] else {
            return Err(at_line("a time stamp and seven numbers were expected"));
        };
        let norm = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
        if !([x, y, z, norm].iter().all(|number| number.is_finite()) && norm > 0.0) {
            return Err(at_line("the numbers must be finite and the quaternion not zero"));
        }
        let theta = (2.0 * (qw * qz + qx * qy)).atan2(qw * qw + qx * qx - qy * qy - qz * qz);
        poses.push((timestamp_ns, Pose2::new(x, y, theta)));
    }
    Ok(poses)
}

/// Decimal seconds as whole nanoseconds, without a detour through a float that could not hold them.
fn parse_seconds(word: &str) -> Option<i64> {
    let (sign, digits) = word.strip_prefix('-').map_or((1, word), |rest| (-1, rest));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !are_digits(whole) || !are_digits(fraction) {
        // Exponents are rare and do not deserve exactness.
        let seconds: f64 = word.parse().ok()?;
        return seconds.is_finite().then_some((seconds * SECOND_NS as f64).round() as i64);
    }
    let nanoseconds: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    let whole: i64 = if whole.is_empty() { 0 } else { whole.parse().ok()? };
    whole.checked_mul(SECOND_NS)?.checked_add(nanoseconds.parse().ok()?).map(|magnitude| sign * magnitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_it_wrote() {
        let poses = [
            (1_234_567_890_123_456_789, Pose2::new(1.5, -2.25, 3.1)),
            (-1_500_000_000, Pose2::new(0.0, 0.0, -0.5)),
        ];
        let read = read_tum(&write_tum(poses)).unwrap();
        for (written, read) in poses.iter().zip(&read) {
            assert_eq!(written.0, read.0);
            assert!(written.1.distance(&read.1) < 1e-6 && (written.1.theta - read.1.theta).abs() < 1e-8);
        }
    }

    #[test]
    fn skips_comments_and_names_bad_lines() {
        assert_eq!(read_tum("# head\n\n1 0 0 0 0 0 0 1\n").unwrap(), [(SECOND_NS, Pose2::identity())]);
        assert_eq!(read_tum("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 0\n").unwrap_err().line, 2);
        assert_eq!(read_tum("1 0 0 0 0 0 1\n").unwrap_err().line, 1);
        assert_eq!(read_tum("x 0 0 0 0 0 0 1\n").unwrap_err().line, 1);
    }
}
