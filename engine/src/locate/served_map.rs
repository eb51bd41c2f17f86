//! What sessions read of one version of a map, computed once and shared by all of them.

use super::global_search::SearchPyramid;
use super::likelihood_field::{LikelihoodField, LikelihoodFieldConfig};
use crate::occupancy::GridMap;

/// A map prepared for sessions.
#[derive(Clone, Debug)]
pub struct ServedMap {
    /// The cells.
    pub grid: GridMap,
    /// Likelihood of beam ends.
    pub likelihood: LikelihoodField,
    /// Bounds for the search over all poses.
    pub pyramid: SearchPyramid,
}

impl ServedMap {
    /// Computes the likelihood field and the bounds of a map.
    pub fn build(grid: GridMap, likelihood: &LikelihoodFieldConfig) -> Self {
        let likelihood = LikelihoodField::build(&grid, likelihood);
        let pyramid = SearchPyramid::build(&grid, &likelihood);
        Self { grid, likelihood, pyramid }
    }
}
