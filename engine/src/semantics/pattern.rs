//! Routes by pattern: "a corridor over 10 m, then a left corner, then a bifurcation".

use serde::{Deserialize, Serialize};

use super::label::PlaceLabel;
use super::places::{PlaceMap, Visit};
use super::route::Turn;

/// What one place of a route must be; what is not given may be anything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlacePattern {
    /// Its label.
    pub label: Option<PlaceLabel>,
    /// Least way through it, metres.
    pub length_min_m: Option<f64>,
    /// Greatest way through it, metres.
    pub length_max_m: Option<f64>,
    /// How it is left.
    pub turn: Option<Turn>,
}

/// A stretch of driving that fits a pattern.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PatternMatch {
    /// The passes, in the order of the pattern.
    pub visits: Vec<Visit>,
    /// The pattern fits when driving the other way: the passes are later ones first.
    pub is_reversed: bool,
    /// Product of the confidences of the places, in [0, 1].
    pub confidence: f64,
}

impl PlacePattern {
    fn fits(&self, map: &PlaceMap, visit: &Visit, is_reversed: bool) -> bool {
        // Driven the other way, entering and leaving change places and a left turn is a right turn.
        let turn_rad = if is_reversed { -visit.turn_rad } else { visit.turn_rad };
        self.label.is_none_or(|label| map.places[visit.place as usize].label == label)
            && self.length_min_m.is_none_or(|length_m| visit.length_m >= length_m)
            && self.length_max_m.is_none_or(|length_m| visit.length_m <= length_m)
            && self.turn.is_none_or(|turn| Turn::of(turn_rad) == turn)
    }
}

/// All stretches of driving, either way, whose places fit the pattern one after the other: surest first, then in
/// order of run and travel. An empty pattern fits nothing. O(visits · pattern).
pub fn find_pattern(map: &PlaceMap, pattern: &[PlacePattern]) -> Vec<PatternMatch> {
    if pattern.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for run in &map.visits {
        for window in run.windows(pattern.len()) {
            for is_reversed in [false, true] {
                let mut visits = window.to_vec();
                if is_reversed {
                    visits.reverse();
                }
                if visits.iter().zip(pattern).all(|(visit, place)| place.fits(map, visit, is_reversed)) {
                    let sure = |visit: &Visit| f64::from(map.places[visit.place as usize].confidence);
                    let confidence = visits.iter().map(sure).product();
                    found.push(PatternMatch { visits, is_reversed, confidence });
                }
            }
        }
    }
    found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    found
}
