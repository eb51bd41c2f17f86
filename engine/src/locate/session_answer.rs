//! What a session answers: a state, places with their probabilities, and what is missing to be sure.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose2;
pub use crate::recall::LocalizationState;

/// One answer to "where am I".
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// The component of the map whose frame the pose is in.
    pub component: u32,
    /// Pose of the robot in the map.
    pub map_from_robot: Pose2,
    /// Covariance of (x, y, θ) in the map's axes, row by row.
    pub covariance: [[f64; 3]; 3],
    /// Probability that the robot is here, in [0, 1].
    pub probability: f64,
}

/// What is missing before a robot counts as found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Missing {
    /// Too little was driven.
    Travel,
    /// That the robot is not in this map is too probable.
    Elsewhere,
    /// Another place of the map is too probable.
    Alternatives,
    /// The best place has not been the best one for long enough.
    Persistence,
    /// What was seen last contradicts the best place.
    RecentScans,
    /// The pose could slide too far, as it can along a plain corridor.
    Position,
}

/// The answer of a session.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LocalizationEstimate {
    /// Whether the robot is found.
    pub state: LocalizationState,
    /// Distance driven since the session began, metres.
    pub travel_m: f64,
    /// Where the robot may be now, most probable first.
    pub hypotheses: Vec<Hypothesis>,
    /// Probability that the robot is nowhere in this map; with those of all places 1.
    pub probability_elsewhere: f64,
    /// What is missing to be found; empty when it is.
    pub missing: Vec<Missing>,
    /// Whether the best place is the one that was declared; none without a declaration or a place.
    pub prior_agrees: Option<bool>,
}
