//! Headings of particles in turns, in [−½, ½]: wrapping is a subtraction and sine and cosine are short polynomials
//! without branches, so that loops over particles run in vector registers.

use std::f32::consts::TAU;

/// The same heading in [−½, ½]; exact for |turns| below four million.
#[inline]
pub(super) fn wrap_turns(turns: f32) -> f32 {
    /// Adding and taking away 1.5 · 2²³ rounds to the nearest integer.
    const ROUNDER: f32 = 12_582_912.0;
    turns - ((turns + ROUNDER) - ROUNDER)
}

/// Sine and cosine of a heading within [−½, ½] turns; the error stays below 10⁻⁵.
#[inline]
pub(super) fn sin_cos_turns(turns: f32) -> (f32, f32) {
    let unsigned = turns.abs();
    let folded = unsigned.min(0.5 - unsigned);
    (sine_of_quarter(folded.copysign(turns)), sine_of_quarter(0.25 - unsigned))
}

/// Sine of at most a quarter turn either way, by its Taylor series.
#[inline]
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
    fn wrapping_keeps_the_direction() {
        for (turns, wrapped) in [(0.25, 0.25), (0.75, -0.25), (-1.25, -0.25), (3.0, 0.0)] {
            assert!((wrap_turns(turns) - wrapped).abs() < 1e-6, "{turns}");
        }
    }
}
