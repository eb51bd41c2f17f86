//! The map of a site as values: where everything is, and why.

use crate::geometry::Pose2;

use super::place_match::PlaceMatch;

/// A run in the map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MappedRun {
    /// The frame in which the poses are given; runs of one component share it.
    pub component: u32,
    /// Poses of the run's keyframes, in order.
    pub map_from_keyframes: Vec<Pose2>,
}

/// What the map builder found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SiteMap {
    /// Claims of places driven twice, best first by nothing: in a fixed order.
    pub matches: Vec<PlaceMatch>,
    /// Registrations that fit where they are but do not constrain the map, each with its reason; in a fixed order.
    pub refused: Vec<PlaceMatch>,
    /// Runs in the order they were given.
    pub runs: Vec<MappedRun>,
    /// Number of components.
    pub num_components: u32,
}
