//! Angles in turns, in [−½, ½]: wrapping is a subtraction, and sine, cosine and their reverse are short polynomials
//! without branches, so that loops over particles and cells run in vector registers.

use std::f32::consts::TAU;

/// The same heading in [−½, ½]; exact for |turns| below four million.
#[inline(always)]
pub(crate) fn wrap_turns(turns: f32) -> f32 {
    /// Adding and taking away 1.5 · 2²³ rounds to the nearest integer.
    const ROUNDER: f32 = 12_582_912.0;
    turns - ((turns + ROUNDER) - ROUNDER)
}

/// The largest integer not above a number in [0, 2²²); of any other number, some 32 bits.
///
/// A conversion of the language saturates, which no vector instruction does.
#[inline(always)]
pub(crate) fn floor_to_u32(number: f32) -> u32 {
    /// Of a number below 2²² plus this one, the low bits are the nearest integer.
    const SHIFT: f32 = 8_388_608.0;
    let sum = number + SHIFT;
    (sum.to_bits() & 0x007f_ffff).wrapping_sub(u32::from(sum - SHIFT > number))
}

/// Direction of (x, y) in [−½, ½] turns; the error stays below 2 · 10⁻⁶ (Abramowitz and Stegun, 4.4.47). NaN of
/// nothing.
#[inline(always)]
pub(crate) fn direction_in_turns(x: f32, y: f32) -> f32 {
    let (across, up) = (x.abs(), y.abs());
    let is_steep = across < up;
    let slope = if is_steep { across / up } else { up / across };
    let square = slope * slope;
    let tail = 0.180_141 + square * (-0.085_133 + square * 0.020_835_1);
    let octant = slope * (0.999_866 + square * (-0.330_299_5 + square * tail)) * (1.0 / TAU);
    let quadrant = if is_steep { 0.25 - octant } else { octant };
    let half = if x < 0.0 { 0.5 - quadrant } else { quadrant };
    half.copysign(y)
}

/// Sine and cosine of a heading within [−½, ½] turns; the error stays below 10⁻⁵.
#[inline(always)]
pub(crate) fn sin_cos_turns(turns: f32) -> (f32, f32) {
    let unsigned = turns.abs();
    let folded = unsigned.min(0.5 - unsigned);
    (sine_of_quarter(folded.copysign(turns)), sine_of_quarter(0.25 - unsigned))
}

/// Sine of at most a quarter turn either way, by its Taylor series.
#[inline(always)]
fn sine_of_quarter(turns: f32) -> f32 {
    let angle = turns * TAU;
    let square = angle * angle;
    let tail = 1.0 / 120.0 + square * (-1.0 / 5040.0 + square * (1.0 / 362_880.0));
    angle + angle * square * (-1.0 / 6.0 + square * tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_close() {
        for step in -5000..=5000 {
            let turns = step as f32 / 10_000.0;
            let (sin, cos) = sin_cos_turns(turns);
            let angle = f64::from(turns) * std::f64::consts::TAU;
            assert!((f64::from(sin) - angle.sin()).abs() < 1e-5, "sine at {turns}");
            assert!((f64::from(cos) - angle.cos()).abs() < 1e-5, "cosine at {turns}");
        }
    }

    #[test]
    fn directions_are_close() {
        for step in -5000..5000 {
            let angle = f64::from(step) / 5000.0 * std::f64::consts::PI;
            let (x, y) = ((angle.cos() * 0.01) as f32, (angle.sin() * 0.01) as f32);
            let exact = f64::from(y).atan2(f64::from(x));
            let close = f64::from(direction_in_turns(x, y)) * std::f64::consts::TAU;
            assert!((close - exact).abs() < 1.2e-5, "{close} is not {exact}");
        }
        assert!(direction_in_turns(0.0, 0.0).is_nan());
    }

    #[test]
    fn flooring_is_exact() {
        for number in [0.0, 0.49, 0.5, 0.99, 1.0, 1.5, 2.5, 3.0, 1999.999, 4_194_303.0, 4_194_302.8] {
            assert_eq!(floor_to_u32(number), number.floor() as u32, "{number}");
        }
    }

    #[test]
    fn wrapping_keeps_the_direction() {
        for (turns, wrapped) in [(0.25, 0.25), (0.75, -0.25), (-1.25, -0.25), (3.0, 0.0)] {
            assert!((wrap_turns(turns) - wrapped).abs() < 1e-6, "{turns}");
        }
    }
}
