//! Where the beams of a FLASER message point, which the message itself does not say.
//!
//! A SICK laser of 180 degrees is meant where nothing else is stated; other lasers are described by PARAM lines at
//! the head of the log, in degrees or, in some logs, in radians:
//! - `PARAM laser_front_laser_fov 239.77 host time`,
//! - `PARAM laser_front_laser_resolution 0.3516 host time`.

use std::f64::consts::{PI, TAU};

use super::Fields;

/// Direction of the first beam and the angle from one to the next, in the laser's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamAngles {
    /// Direction of the first beam.
    pub min_rad: f64,
    /// From one beam to the next.
    pub increment_rad: f64,
}

/// Numbers of readings of the common laser of 180 degrees.
const COMMON_NUM_RANGES: [usize; 5] = [90, 180, 181, 360, 361];
/// A stated resolution below this is in radians: no laser is finer than 0.05 degrees, none coarser than 0.05 rad.
const RADIANS_BELOW: f64 = 0.05;
/// How far a stated resolution may be from that of field of view and number of readings.
const RESOLUTION_TOLERANCE: f64 = 0.02;

/// What PARAM lines say of the front laser.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct StatedLaser {
    field_of_view_rad: Option<f64>,
    /// In the unit of the log.
    resolution: Option<f64>,
}

impl StatedLaser {
    /// Notes the rest of a PARAM line if it is about the front laser's angles. The last line of a kind counts.
    pub(super) fn note(&mut self, fields: &mut Fields<'_>) {
        let Some(name) = fields.next_word().map(str::to_ascii_lowercase) else { return };
        let is_front =
            ["front_laser_", "frontlaser_", "laser_laser1_"].iter().any(|part| name.contains(part));
        let value = fields.next_word().and_then(|word| word.parse::<f64>().ok());
        let Some(value) = value.filter(|value| is_front && *value > 0.0 && value.is_finite()) else { return };
        if name.ends_with("_fov") || name.ends_with("_field_of_view") {
            // More than a full turn can only be degrees.
            self.field_of_view_rad = Some(if value <= TAU + 1e-3 { value } else { value.to_radians() });
        } else if name.ends_with("_resolution") {
            self.resolution = Some(value);
        }
    }

    /// The beams of a message of `num_ranges` readings; `field_of_view_deg` wins over the log.
    ///
    /// # Errors
    /// Angles that cannot be told, or statements that contradict the number of readings.
    pub(super) fn beams(
        &self,
        num_ranges: usize,
        field_of_view_deg: Option<f64>,
    ) -> Result<BeamAngles, String> {
        // An even number of readings leaves out the last beam of the field of view, as a SICK does with 180 of 181.
        let num_gaps = num_ranges - num_ranges % 2;
        if let Some(field_of_view_deg) = field_of_view_deg {
            return beams_over(field_of_view_deg.to_radians(), num_gaps);
        }
        let is_common = COMMON_NUM_RANGES.contains(&num_ranges);
        match (self.field_of_view_rad, self.resolution) {
            (Some(field_of_view_rad), None) => beams_over(field_of_view_rad, num_gaps),
            (Some(field_of_view_rad), Some(resolution)) => {
                let fits = |num_gaps: &usize| {
                    let increment_rad = field_of_view_rad / *num_gaps as f64;
                    let error = |stated_rad: f64| (stated_rad / increment_rad - 1.0).abs();
                    error(resolution).min(error(resolution.to_radians()))
                };
                let candidates = [num_gaps, num_ranges - 1, num_ranges];
                let best = candidates.into_iter().min_by(|a, b| fits(a).total_cmp(&fits(b)));
                match best.filter(|gaps| fits(gaps) <= RESOLUTION_TOLERANCE) {
                    Some(num_gaps) => beams_over(field_of_view_rad, num_gaps),
                    None if is_common => beams_over(field_of_view_rad, num_gaps),
                    None => Err(format!(
                        "{num_ranges} readings over {:.2} degrees do not have the resolution {resolution} that the \
                         log states; {HOW_TO_STATE}",
                        field_of_view_rad.to_degrees()
                    )),
                }
            }
            (None, Some(resolution)) if !is_common => {
                let resolution_rad =
                    if resolution < RADIANS_BELOW { resolution } else { resolution.to_radians() };
                beams_over(resolution_rad * num_gaps as f64, num_gaps)
            }
            _ if is_common || is_thinned(num_ranges) => beams_over(PI, num_gaps),
            _ => Err(format!(
                "a FLASER message of {num_ranges} readings does not tell which angle they cover; {HOW_TO_STATE}"
            )),
        }
    }
}

const HOW_TO_STATE: &str = "state the laser's field of view (--fov DEGREES), or begin the log with a line \
                            'PARAM laser_front_laser_fov DEGREES'";

/// Whether this may be a scan over 180 degrees of which only every so manieth whole degree was kept, both ends
/// included: 61 readings are 3 degrees apart.
fn is_thinned(num_ranges: usize) -> bool {
    num_ranges < 180 && 180 % (num_ranges - 1) == 0 && num_ranges % 2 == 1
}

/// `num_gaps` increments that begin at half the field of view to the right.
fn beams_over(field_of_view_rad: f64, num_gaps: usize) -> Result<BeamAngles, String> {
    if !(field_of_view_rad > 0.0 && field_of_view_rad <= TAU * 1.001) {
        return Err(format!(
            "a field of view of {:.2} degrees; {HOW_TO_STATE}",
            field_of_view_rad.to_degrees()
        ));
    }
    Ok(BeamAngles { min_rad: -0.5 * field_of_view_rad, increment_rad: field_of_view_rad / num_gaps as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stated(lines: &[&str]) -> StatedLaser {
        let mut laser = StatedLaser::default();
        for line in lines {
            laser.note(&mut Fields::new(line, 1));
        }
        laser
    }

    fn degrees(laser: &StatedLaser, num_ranges: usize) -> (f64, f64) {
        let beams = laser.beams(num_ranges, None).unwrap();
        (beams.min_rad.to_degrees(), beams.increment_rad.to_degrees())
    }

    fn is_near(found: (f64, f64), expected: (f64, f64)) -> bool {
        (found.0 - expected.0).abs() < 1e-3 && (found.1 - expected.1).abs() < 1e-4
    }

    #[test]
    fn the_number_of_readings_tells_the_angles_of_the_common_laser_only() {
        let nothing = StatedLaser::default();
        for (num_ranges, increment_deg) in
            [(90, 2.0), (180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5), (61, 3.0), (11, 18.0)]
        {
            assert!(is_near(degrees(&nothing, num_ranges), (-90.0, increment_deg)), "{num_ranges}");
        }
        for num_ranges in [2, 100, 682, 720, 1081] {
            let problem = nothing.beams(num_ranges, None).unwrap_err();
            assert!(problem.contains("--fov") && problem.contains("PARAM"), "{problem}");
            assert!(nothing.beams(num_ranges, Some(270.0)).is_ok());
        }
    }

    #[test]
    fn parameters_state_degrees_or_radians() {
        let expected = (-119.885, 239.77 / 682.0);
        for lines in [
            &["laser_front_laser_fov 239.77 nohost 0", "laser_front_laser_resolution 0.3516 nohost 0"][..],
            &["laser_front_laser_fov 4.184776 nohost 0", "laser_front_laser_resolution 0.006137 nohost 0"],
            &["laser_front_laser_resolution 0.3516 nohost 0", "laser_front_laser_fov 239.77 nohost 0"],
            &["robot_frontlaser_fov 4.184776 h 0", "robot_frontlaser_resolution 0.3516 h 0"],
            &["laser_laser1_fov 239.77 nohost 0"],
        ] {
            assert!(is_near(degrees(&stated(lines), 682), expected), "{lines:?}");
        }
        assert!(is_near(degrees(&stated(&["laser_front_laser_fov 3.14159 h 0"]), 181), (-90.0, 1.0)));
        assert!(is_near(degrees(&stated(&["laser_front_laser_resolution 0.25 h 0"]), 1081), (-135.0, 0.25)));
    }

    #[test]
    fn what_is_stated_of_other_lasers_does_not_count() {
        let others =
            stated(&["laser_rear_laser_fov 90 h 0", "laser_laser2_fov 270 h 0", "robot_width 0.5 h 0"]);
        assert_eq!(others, StatedLaser::default());
        assert_eq!(
            stated(&["laser_front_laser_fov none h 0", "laser_front_laser_fov"]),
            StatedLaser::default()
        );
    }

    #[test]
    fn statements_that_contradict_the_readings_are_told() {
        let laser = stated(&["laser_front_laser_fov 180 h 0", "laser_front_laser_resolution 1.0 h 0"]);
        assert!(laser.beams(682, None).unwrap_err().contains("resolution 1"));
        assert!(
            is_near(degrees(&laser, 361), (-90.0, 0.5)),
            "the head of the log was left as it is delivered"
        );
        assert!(stated(&["laser_front_laser_fov 500 h 0"]).beams(682, None).is_err());
    }
}
