//! A match: the claim that two stretches of driving went through the same place, with its evidence.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose2;
use crate::text::{Direction, Interval};

/// Which way of looking found the candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// A chain of matching words (thesis 4.2.3, 5.2.3).
    Words,
    /// Aligned density profiles (Eq 5.3 as a search).
    Profile,
    /// Neighbours in the optimised graph within its uncertainty.
    Spatial,
}

/// Relative pose of two submaps from registration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Registration {
    /// Keyframe at the origin of the earlier submap, index into its run's keyframes.
    pub earlier_keyframe: u32,
    /// Keyframe at the origin of the later submap.
    pub later_keyframe: u32,
    /// Pose of the later keyframe seen from the earlier one.
    pub earlier_from_later: Pose2,
    /// Covariance of (x, y, θ) in the earlier keyframe's axes, row by row; long along a plain corridor.
    pub covariance: [[f64; 3]; 3],
    /// Share of returns and free space, of both submaps, that agree: 1 is perfect.
    pub agreement: f64,
}

impl Registration {
    /// The same, with the earlier keyframe seen from the later one.
    pub(crate) fn seen_from_later(&self) -> Self {
        let inverse = self.earlier_from_later.inverse();
        let (sin, cos) = self.earlier_from_later.theta.sin_cos();
        let by_pose = Matrix3::new(-cos, -sin, inverse.y, sin, -cos, -inverse.x, 0.0, 0.0, -1.0);
        let covariance = Matrix3::from_fn(|row, column| self.covariance[row][column]);
        Self {
            earlier_keyframe: self.later_keyframe,
            later_keyframe: self.earlier_keyframe,
            earlier_from_later: inverse,
            covariance: (by_pose * covariance * by_pose.transpose()).transpose().into(),
            agreement: self.agreement,
        }
    }
}

/// Everything known for or against a match.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Surprise of the text match, −log2 of its chance probability.
    pub bits: f64,
    /// Number of matches this good that chance would bring in this site (an E-value).
    pub expected_chance_matches: f64,
    /// RMS distance of the two driven shapes after rigid alignment, metres.
    pub shape_residual_m: Option<f64>,
    /// Correlation of the aligned density profiles, in [−1, 1].
    pub density_correlation: Option<f64>,
    /// Evidence of the best candidate at a different place, relative to this one's: 1 is fully ambiguous.
    pub ambiguity: Option<f64>,
    /// Registration of the local submaps.
    pub registration: Option<Registration>,
}

/// Why a candidate does not constrain the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RejectionReason {
    /// Too few bits.
    WeakText,
    /// The driven shapes differ.
    Shape,
    /// The density profiles differ.
    Density,
    /// The submaps do not fit.
    Registration,
    /// Another place fits as well.
    Ambiguous,
    /// It contradicts the other matches (pairwise consistency or the robust graph).
    Inconsistent,
    /// A person said no.
    Vetoed,
}

/// What became of a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", content = "reason", rename_all = "snake_case")]
pub enum MatchState {
    /// Found, not decided.
    Candidate,
    /// A constraint of the graph.
    Verified,
    /// Seen and refused.
    Rejected(RejectionReason),
}

/// The claim that two intervals of driving went through the same place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaceMatch {
    /// The stretch that was driven first (or stands in the run listed first).
    pub earlier: Interval,
    /// The stretch that revisits it.
    pub later: Interval,
    /// Same or opposite way.
    pub direction: Direction,
    /// What found it.
    pub channel: Channel,
    /// What speaks for it.
    pub evidence: Evidence,
    /// Probability that it is right, in [0, 1]; matches are ranked by it.
    pub probability: f64,
    /// Candidate, verified or rejected.
    pub state: MatchState,
}

/// A person's word on a pair of places; it holds for every match whose intervals overlap both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Decision {
    /// The stretch that was driven first.
    pub earlier: Interval,
    /// The stretch that revisits it.
    pub later: Interval,
    /// Same or opposite way.
    pub direction: Direction,
    /// True: it is the same place, whatever the evidence. False: it is not.
    pub is_same_place: bool,
}

impl Decision {
    /// Whether it was made on the pair of places of a match.
    pub fn is_about(&self, found: &PlaceMatch) -> bool {
        self.direction == found.direction
            && self.earlier.overlaps(&found.earlier)
            && self.later.overlaps(&found.later)
    }
}
