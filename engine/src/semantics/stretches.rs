//! A run as a person tells it: stretches of one label, and questions in their words, "a corridor over 10 m, then a left
//! corner, then a bifurcation".

use super::label::PlaceLabel;
use crate::geometry::Pose2;
use crate::recording::RunTrajectory;
use crate::text::Observation;

/// Stretches shorter than this between two of one label do not part them when asked for by label, metres.
const FLICKER_M: f64 = 0.5;

/// A stretch of driving through places of one label.
#[derive(Clone, Debug, PartialEq)]
pub struct LabeledStretch {
    /// What kind of place.
    pub label: PlaceLabel,
    /// First observation, inclusive.
    pub first: u64,
    /// Last observation, inclusive.
    pub last: u64,
    /// Timestamps of the two, nanoseconds.
    pub timestamps_ns: (i64, i64),
    /// Metres along it.
    pub length_m: f64,
    /// Radians turned from its first to its last observation, left positive.
    pub turn_rad: f64,
    /// Mean share of what was seen that agrees with the label.
    pub confidence: f64,
    /// Its middle in the frame of the map.
    pub map_from_middle: Pose2,
}

/// The stretches of a run, from the label of each of its first observations and the confidence in it.
pub fn labeled_stretches(
    labels: &[(PlaceLabel, f32)],
    observations: &[Observation],
    trajectory: &RunTrajectory,
) -> Vec<LabeledStretch> {
    let mut stretches = Vec::new();
    let mut first = 0;
    for group in labels.chunk_by(|a, b| a.0 == b.0) {
        let end = first + group.len();
        let Some(driven) = observations.get(first..end) else { break };
        let (start, last, middle) = (&driven[0], &driven[driven.len() - 1], &driven[driven.len() / 2]);
        let sum: f64 = group.iter().map(|(_, confidence)| f64::from(*confidence)).sum();
        let own = middle.run_from_robot;
        stretches.push(LabeledStretch {
            label: group[0].0,
            first: first as u64,
            last: end as u64 - 1,
            timestamps_ns: (start.timestamp_ns, last.timestamp_ns),
            length_m: last.travel_m - start.travel_m,
            turn_rad: start.run_from_robot.between(&last.run_from_robot).theta,
            confidence: sum / group.len() as f64,
            map_from_middle: trajectory.at(middle.scan_seq, &own).unwrap_or(own),
        });
        first = end;
    }
    stretches
}

/// What one stretch of a pattern must be.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelPattern {
    /// What kind of place.
    pub label: PlaceLabel,
    /// Metres along it, at least.
    pub length_min_m: f64,
    /// Metres along it, at most.
    pub length_max_m: f64,
    /// Which way it turns: left (positive), right (negative); `None`: either.
    pub is_left: Option<bool>,
}

impl LabelPattern {
    fn accepts(&self, stretch: &LabeledStretch, is_reversed: bool) -> bool {
        let turn_rad = if is_reversed { -stretch.turn_rad } else { stretch.turn_rad };
        stretch.label == self.label
            && (self.length_min_m..=self.length_max_m).contains(&stretch.length_m)
            && self.is_left.is_none_or(|is_left| is_left == (turn_rad > 0.0))
    }
}

/// Where a pattern fits.
#[derive(Clone, Debug, PartialEq)]
pub struct PatternMatch {
    /// The stretches, in the order of the pattern.
    pub stretches: Vec<LabeledStretch>,
    /// Whether the run drove them the other way round.
    pub is_reversed: bool,
    /// The least sure of its labels.
    pub confidence: f64,
}

/// Where the stretches of a run fit a pattern one after the other, driven either way, in order of travel. An empty
/// pattern fits nothing. O(stretches · pattern).
pub fn find_pattern(stretches: &[LabeledStretch], pattern: &[LabelPattern]) -> Vec<PatternMatch> {
    if pattern.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for window in without_flicker(stretches).windows(pattern.len()) {
        for is_reversed in [false, true] {
            let mut driven = window.to_vec();
            if is_reversed {
                driven.reverse();
            }
            if pattern.iter().zip(&driven).all(|(pattern, stretch)| pattern.accepts(stretch, is_reversed)) {
                let confidence = driven.iter().map(|stretch| stretch.confidence).fold(1.0, f64::min);
                found.push(PatternMatch { stretches: driven, is_reversed, confidence });
            }
        }
    }
    found
}

/// Joins stretches of one label that only a short other one parts.
fn without_flicker(stretches: &[LabeledStretch]) -> Vec<LabeledStretch> {
    let mut joined: Vec<LabeledStretch> = Vec::new();
    for stretch in stretches {
        if stretch.length_m < FLICKER_M && !joined.is_empty() {
            continue;
        }
        match joined.last_mut() {
            Some(last) if last.label == stretch.label => {
                let (a_m, b_m) = (last.length_m.max(1e-9), stretch.length_m.max(1e-9));
                last.confidence = (last.confidence * a_m + stretch.confidence * b_m) / (a_m + b_m);
                last.last = stretch.last;
                last.timestamps_ns.1 = stretch.timestamps_ns.1;
                last.length_m += stretch.length_m;
                last.turn_rad += stretch.turn_rad;
            }
            _ => joined.push(stretch.clone()),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretch(label: PlaceLabel, length_m: f64, turn_rad: f64, confidence: f64) -> LabeledStretch {
        LabeledStretch {
            label,
            first: 0,
            last: 0,
            timestamps_ns: (0, 0),
            length_m,
            turn_rad,
            confidence,
            map_from_middle: Pose2::identity(),
        }
    }

    fn any(label: PlaceLabel) -> LabelPattern {
        LabelPattern { label, length_min_m: 0.0, length_max_m: f64::INFINITY, is_left: None }
    }

    /// A corridor of 12 m with a flicker in it, a left corner, a hall.
    fn driven() -> Vec<LabeledStretch> {
        vec![
            stretch(PlaceLabel::Corridor, 8.0, 0.0, 0.9),
            stretch(PlaceLabel::Hall, 0.2, 0.0, 0.3),
            stretch(PlaceLabel::Corridor, 4.0, 0.0, 0.6),
            stretch(PlaceLabel::Corner, 3.0, 1.5, 0.7),
            stretch(PlaceLabel::Hall, 5.0, 0.0, 0.8),
        ]
    }

    #[test]
    fn patterns_fit_driving_either_way() {
        let long = LabelPattern { length_min_m: 10.0, ..any(PlaceLabel::Corridor) };
        let corner = |is_left| LabelPattern { is_left: Some(is_left), ..any(PlaceLabel::Corner) };
        let left = find_pattern(&driven(), &[long.clone(), corner(true)]);
        assert!(left.len() == 1 && !left[0].is_reversed);
        assert!((left[0].confidence - 0.7).abs() < 1e-12, "the corridor is sure by its length, 0.8");
        let right = find_pattern(&driven(), &[corner(false), long.clone()]);
        assert!(right.len() == 1 && right[0].is_reversed);
        assert_eq!(right[0].stretches[0].label, PlaceLabel::Corner);
        assert!(find_pattern(&driven(), &[long, corner(false)]).is_empty());
    }

    #[test]
    fn what_cannot_fit_is_not_found() {
        assert!(find_pattern(&driven(), &[any(PlaceLabel::DeadEnd)]).is_empty());
        assert!(find_pattern(&driven(), &[]).is_empty());
        let more = vec![any(PlaceLabel::Corridor); 9];
        assert!(find_pattern(&driven(), &more).is_empty());
    }
}
