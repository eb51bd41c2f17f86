//! When two words match (thesis 4.2.3, SPEC 3.9), as exact integer windows.
//!
//! A word is compared by its three syllables: same class, sizes within a ratio, turns within an angle. Around a given
//! word this is a box: one class, an interval of sizes and an arc of turns. [`WordWindow`] is that box, so that a
//! check is three integer comparisons; the arc wraps by itself because a turn is a binary angle, 2¹⁶ units a circle.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::text::Word;

/// Units of a binary angle in half a circle.
const UNITS_PER_PI: f64 = 32768.0;

/// How much two matching words may differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WordTolerance {
    /// ε_s: largest |s_i − s_j| / max(s_i, s_j), exclusive (Eq 4.4; 25 % in thesis 5.3.1).
    pub size_ratio: f64,
    /// ε_a: largest |wrap(a_i − a_j)|, inclusive (30° in thesis 4.2.3).
    pub turn_rad: f64,
}

impl Default for WordTolerance {
    fn default() -> Self {
        Self { size_ratio: 0.25, turn_rad: PI / 6.0 }
    }
}

impl WordTolerance {
    /// Checks the values.
    ///
    /// # Errors
    /// A size ratio outside (0, 1) or an angle outside [0, π].
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(self.size_ratio > 0.0 && self.size_ratio < 1.0) {
            return Err(ConfigError::new(format!("{path}.size_ratio"), "must lie in (0, 1)"));
        }
        if !(0.0..=PI).contains(&self.turn_rad) {
            return Err(ConfigError::new(format!("{path}.turn_rad"), "must lie in [0, π]"));
        }
        Ok(())
    }

    /// Whether two words match (SPEC 3.9).
    pub fn matches(&self, a: &Word, b: &Word) -> bool {
        self.window(&Syllables::of(a)).contains(&Syllables::of(b))
    }

    /// Everything that matches `word`.
    pub fn window(&self, word: &Syllables) -> WordWindow {
        let sizes_match =
            |a: u16, b: u16| f64::from(a.abs_diff(b)) < self.size_ratio * f64::from(a.max(b)) || a == b;
        let size = f64::from(word.size);
        // The bounds are guessed in floating point and corrected by the predicate itself. Casts round down and stop at
        // the ends of the range.
        let mut size_min = (size * (1.0 - self.size_ratio)) as u16;
        while !sizes_match(word.size, size_min) {
            size_min += 1;
        }
        let mut size_max = (size / (1.0 - self.size_ratio) + 1.0) as u16;
        while !sizes_match(word.size, size_max) {
            size_max -= 1;
        }
        // One unit (0.005°) more, so that words at exactly ε_a match whichever way their turns were rounded.
        let reach = ((self.turn_rad / PI * UNITS_PER_PI) as u16).saturating_add(1).min(i16::MAX as u16);
        WordWindow {
            class: word.class,
            size_min,
            size_span: size_max - size_min,
            turn_min: word.turn.wrapping_sub(reach as i16),
            turn_span: 2 * reach,
        }
    }
}

/// A word's ⟨d, s, a⟩ as small integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Syllables {
    /// d: density class.
    pub class: u16,
    /// s: number of observations; longer words than 6.5 km count as 6.5 km.
    pub size: u16,
    /// a: turn as a binary angle, 2¹⁵ units for π.
    pub turn: i16,
}

impl Syllables {
    /// The syllables of a word.
    pub fn of(word: &Word) -> Self {
        Self {
            class: u16::from(word.class),
            size: u16::try_from(word.size).unwrap_or(u16::MAX),
            turn: binary_angle(f64::from(word.turn_rad)),
        }
    }

    /// The turn in radians, as exactly as it is kept.
    pub fn turn_rad(&self) -> f64 {
        f64::from(self.turn) / UNITS_PER_PI * PI
    }

    /// The word as it reads when its place is driven the other way: the turn changes sign.
    pub fn reversed(&self) -> Self {
        Self { turn: self.turn.wrapping_neg(), ..*self }
    }
}

/// An angle as a fraction of a circle, 2¹⁶ units; π and −π are the same unit.
pub fn binary_angle(angle_rad: f64) -> i16 {
    // The cast through i64 keeps the low 16 bits, which is exactly the wrap to one circle.
    (angle_rad / PI * UNITS_PER_PI).round() as i64 as i16
}

/// The box of words that match a given word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordWindow {
    /// The only class.
    pub class: u16,
    /// Smallest size.
    pub size_min: u16,
    /// Largest size minus smallest.
    pub size_span: u16,
    /// Where the arc of turns begins, as a binary angle.
    pub turn_min: i16,
    /// Length of the arc.
    pub turn_span: u16,
}

impl WordWindow {
    /// Whether a word lies in the box.
    #[inline]
    pub fn contains(&self, word: &Syllables) -> bool {
        (word.class == self.class) & self.contains_of_class(word.size, word.turn)
    }

    /// Whether a word of the window's class lies in the box. Branch-free, for loops over columns of words.
    #[inline]
    pub fn contains_of_class(&self, size: u16, turn: i16) -> bool {
        (size.wrapping_sub(self.size_min) <= self.size_span)
            & ((turn.wrapping_sub(self.turn_min) as u16) <= self.turn_span)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::angle_between;
    use crate::text::WordId;

    fn word(class: u8, size: u32, turn_deg: f64) -> Word {
        Word {
            id: WordId { level: 0, index: 0 },
            class,
            size,
            turn_rad: turn_deg.to_radians() as f32,
            observations: (0, size - 1),
            predecessors: vec![],
        }
    }

    #[test]
    fn the_tolerances_are_those_of_the_specification() {
        let tolerance = WordTolerance::default();
        let matches = |a: (u8, u32, f64), b: (u8, u32, f64)| {
            tolerance.matches(&word(a.0, a.1, a.2), &word(b.0, b.1, b.2))
        };
        assert!(matches((1, 16, 0.0), (1, 13, 0.0)));
        assert!(!matches((1, 16, 0.0), (1, 12, 0.0)), "a ratio of exactly 25 % is too much");
        assert!(!matches((1, 16, 0.0), (2, 16, 0.0)));
        assert!(matches((1, 16, -15.0), (1, 16, 15.0)), "an angle of exactly 30° is within");
        assert!(matches((1, 16, 90.0), (1, 16, 60.0)));
        assert!(!matches((1, 16, 0.0), (1, 16, 30.1)));
        assert!(matches((1, 16, 170.0), (1, 16, -170.0)), "turns wrap");
        assert!(matches((1, 16, 180.0), (1, 16, -180.0)));
    }

    proptest! {
        #[test]
        fn the_window_is_the_predicate(
            (size_a, size_b) in (1u32..400, 1u32..400),
            (turn_a, turn_b) in (-180.0..180.0f64, -180.0..180.0f64),
            size_ratio in 0.05..0.6f64,
        ) {
            let tolerance = WordTolerance { size_ratio, ..WordTolerance::default() };
            let difference = f64::from(size_a.abs_diff(size_b));
            let sizes = difference / f64::from(size_a.max(size_b)) < size_ratio;
            let turn = angle_between(turn_a.to_radians(), turn_b.to_radians());
            prop_assume!((turn - PI / 6.0).abs() > 4e-4);
            let expected = sizes && turn <= PI / 6.0;
            let (a, b) = (word(3, size_a, turn_a), word(3, size_b, turn_b));
            prop_assert_eq!(tolerance.matches(&a, &b), expected);
            prop_assert_eq!(tolerance.matches(&b, &a), expected);
        }
    }
}
