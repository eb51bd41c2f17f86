//! Where a robot is, and where a recording was made.

use serde::{Deserialize, Serialize};

use super::matches::Channel;
use super::runs::Geometry;
use super::values::{Direction, Pose};

/// How sure an answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocalizationState {
    /// No place of the map explains what is seen.
    Lost,
    /// Several places do, or one does not well enough.
    Ambiguous,
    /// One place does, and no other.
    Converged,
}

/// A place where the robot may be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// The component of the map whose frame the pose is in.
    pub component: u32,
    /// Where.
    pub map_from_robot: Pose,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
    /// Probability; what is missing to 1 is that of being elsewhere.
    pub probability: f64,
}

/// A localisation as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Localization {
    /// Its name.
    pub id: String,
    /// The map version it looks in.
    pub map_version: u64,
    /// How sure it is.
    pub state: LocalizationState,
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Metres driven since it began.
    pub travel_m: f64,
    /// Likeliest first.
    pub hypotheses: Vec<Hypothesis>,
    /// Seconds until it is forgotten, unless scans come or somebody asks for it by its name.
    pub expires_in_s: f64,
    /// Probability that the robot is not in this map; with those of all places 1.
    pub probability_elsewhere: f64,
    /// What is missing to be found; empty when it is.
    pub missing: Vec<Missing>,
    /// Whether the likeliest place is the one that was declared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior_agrees: Option<bool>,
}

/// What is missing before a robot counts as found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
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

/// A rough pose that is declared; it is weighed, not believed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PosePrior {
    /// The component of the map whose frame the pose is in.
    pub component: u32,
    /// Where.
    pub map_from_robot: Pose,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
}

/// Opens a localisation: a robot, its laser, and what is known of where it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NewLocalization {
    /// The robot, for the log.
    pub robot: Option<String>,
    /// The laser.
    pub geometry: Geometry,
    /// Where the robot is said to be when the session begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<PosePrior>,
    /// The area it is said to be in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<String>,
}

/// What speaks for and against a place, by the stage that found it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExampleEvidence {
    /// What proposed the place.
    pub channel: Channel,
    /// Standard deviations by which the density profiles differ less than over the whole site.
    pub profile_score: f64,
    /// 1 when all densities are equal.
    pub resemblance: f64,
    /// Share of the outline that the search laid onto surfaces.
    pub outline: f64,
    /// Share of the example's returns about which the map has an opinion.
    pub coverage: f64,
    /// Of these, the share that lie where the map saw free space.
    pub contradicted: f64,
    /// Share of the map's surfaces there that the example saw through.
    pub contradicts: f64,
}

/// A place where an example may end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExamplePlace {
    /// The component of the map whose frame the pose is in.
    pub component: u32,
    /// Where.
    pub map_from_robot: Pose,
    /// Covariance of (x, y, θ), row by row; long along a plain corridor.
    pub covariance: [[f64; 3]; 3],
    /// Probability, over all sites asked; what is missing to 1 is that of being elsewhere.
    pub probability: f64,
    /// The run whose stretch reads like the example.
    pub run: String,
    /// First and last observation of that stretch.
    pub observations: [u32; 2],
    /// Which way it was driven.
    pub direction: Direction,
    /// What speaks for and against the place.
    pub evidence: ExampleEvidence,
}

/// Where the example ends, in one site.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExampleAnswer {
    /// The site.
    pub site: String,
    /// The map version looked in.
    pub map_version: u64,
    /// `lost` means "not here".
    pub state: LocalizationState,
    /// Metres that the example drives.
    pub travel_m: f64,
    /// Places where the robot was at the end of the example, likeliest first.
    pub places: Vec<ExamplePlace>,
    /// Probability that the example was not made in this site.
    pub probability_elsewhere: f64,
}
