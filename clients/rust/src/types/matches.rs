//! Matches and what people say of them.

use serde::{Deserialize, Serialize};

use super::values::{Direction, Pose};

/// What found a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// Chains of words.
    Words,
    /// Density profiles.
    Profile,
    /// Nearness in the map made so far.
    Spatial,
}

impl Channel {
    /// Its name in the API.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Words => "words",
            Self::Profile => "profile",
            Self::Spatial => "spatial",
        }
    }
}

/// What became of a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MatchState {
    /// Found, not decided.
    Candidate,
    /// It holds the map together.
    Verified,
    /// Seen and refused.
    Rejected,
}

impl MatchState {
    /// Its name in the API.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Candidate => "candidate",
            Self::Verified => "verified",
            Self::Rejected => "rejected",
        }
    }
}

/// Why a match does not constrain the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
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
    /// It contradicts the other matches.
    Inconsistent,
    /// A person said no.
    Vetoed,
}

/// A stretch of driving.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Name of the run.
    pub run: String,
    /// First observation, inclusive.
    pub first: u32,
    /// Last observation, inclusive.
    pub last: u32,
    /// Timestamp of the first, nanoseconds; `None` in map versions of earlier programs, as what follows.
    pub first_timestamp_ns: Option<i64>,
    /// Timestamp of the last, nanoseconds.
    pub last_timestamp_ns: Option<i64>,
    /// Component of the map.
    pub component: Option<u32>,
    /// Where it was half way, in the component's frame.
    pub map_from_middle: Option<Pose>,
}

/// What a person said of a pair of places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DecisionKind {
    /// It is not the same place.
    Veto,
    /// It is the same place, whatever the evidence.
    Confirm,
}

impl DecisionKind {
    /// Its name in the API.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Veto => "veto",
            Self::Confirm => "confirm",
        }
    }
}

/// How one submap lies on the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Registration {
    /// Number of the keyframe of the earlier run.
    pub earlier_keyframe: u32,
    /// Number of the keyframe of the later run.
    pub later_keyframe: u32,
    /// Pose of the later keyframe in the frame of the earlier.
    pub earlier_from_later: Pose,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
    /// Share of what both saw that agrees, from 0 to 1.
    pub agreement: f64,
}

/// What speaks for and against a match.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Surprise of the most surprising chain of words through both stretches; null when none was weighed.
    pub bits: Option<f64>,
    /// Number of chains this surprising that chance would bring in this site; null when too many to count.
    pub expected_chance_matches: Option<f64>,
    /// RMS distance of the two driven shapes after rigid alignment, metres.
    pub shape_residual_m: Option<f64>,
    /// Correlation of the aligned density profiles, from -1 to 1.
    pub density_correlation: Option<f64>,
    /// Evidence of the best candidate at a different place, relative to this one's: 1 is fully ambiguous.
    pub ambiguity: Option<f64>,
    /// Registration of the local submaps.
    pub registration: Option<Registration>,
}

/// The claim that two stretches of driving went through the same place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Match {
    /// Its name in this version of the map.
    pub id: String,
    /// The stretch driven first.
    pub earlier: Interval,
    /// The stretch that revisits it.
    pub later: Interval,
    /// Which way the later stretch was driven.
    pub direction: Direction,
    /// What found it.
    pub channel: Channel,
    /// What speaks for and against it.
    pub evidence: Evidence,
    /// Probability that it is right, from 0 to 1.
    pub probability: f64,
    /// What became of it.
    pub state: MatchState,
    /// Why it was rejected.
    pub reason: Option<RejectionReason>,
    /// What a person said of this pair of places; it counts at the next build.
    pub decision: Option<DecisionKind>,
}
