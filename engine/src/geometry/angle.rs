//! Angles wrapped to (−π, π].

use std::f64::consts::{PI, TAU};

/// The same direction as `angle_rad`, in (−π, π].
///
/// Non-finite input is returned as NaN.
pub fn wrap_angle(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let wrapped = angle_rad.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}

/// The smallest unsigned angle between two directions, in [0, π].
pub fn angle_between(a_rad: f64, b_rad: f64) -> f64 {
    wrap_angle(a_rad - b_rad).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_to_the_half_open_interval() {
        assert_eq!(wrap_angle(PI), PI);
        assert_eq!(wrap_angle(-PI), PI);
        assert!((wrap_angle(3.0 * PI / 2.0) + PI / 2.0).abs() < 1e-12);
        assert!((wrap_angle(-7.0) - (TAU - 7.0)).abs() < 1e-12);
        assert!(wrap_angle(f64::NAN).is_nan());
    }
}
