//! Hand-verified relative poses of the Freiburg SLAM benchmark (Kümmerle et al. 2009).

use super::FormatError;
use super::decimal_time::parse_seconds_ns;
use super::fields::{Fields, content_lines};
use crate::geometry::Pose2;

/// The true motion between two moments of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relation {
    /// Timestamp of the first scan.
    pub first_ns: i64,
    /// Timestamp of the second scan.
    pub second_ns: i64,
    /// The robot at the second moment seen from where it was at the first.
    pub first_from_second: Pose2,
}

/// Reads `t1 t2 x y z roll pitch yaw` lines (seconds, metres, radians); z, roll and pitch are not of this plane.
///
/// # Errors
/// The first line that cannot be read.
pub fn parse_relations(text: &str) -> Result<Vec<Relation>, FormatError> {
    content_lines(text)
        .map(|(line_number, line)| {
            let mut fields = Fields::new(line, line_number);
            let mut timestamp = |name: &str| {
                let word = fields.word_or(name, 0)?;
                parse_seconds_ns(word)
                    .ok_or_else(|| fields.error(format!("{name} '{word}' is not a number of seconds")))
            };
            let (first_ns, second_ns) = (timestamp("t1")?, timestamp("t2")?);
            let (x, y) = (fields.number("x")?, fields.number("y")?);
            for name in ["z", "roll", "pitch"] {
                fields.number(name)?;
            }
            let yaw_rad = fields.number("yaw")?;
            Ok(Relation { first_ns, second_ns, first_from_second: Pose2::new(x, y, yaw_rad) })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_plane_of_the_six_numbers() {
        let relations = parse_relations("90.239599 90.719599 0.42 -0.00075 0.1 0.2 0.3 0.01726\n").unwrap();
        let expected = Relation {
            first_ns: 90_239_599_000,
            second_ns: 90_719_599_000,
            first_from_second: Pose2::new(0.42, -0.00075, 0.01726),
        };
        assert_eq!(relations, vec![expected]);
        assert_eq!(parse_relations("1 2 3").unwrap_err().to_string(), "line 1: the line ends before the y");
    }
}
