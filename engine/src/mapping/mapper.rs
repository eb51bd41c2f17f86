//! From runs to one map, the conductor.

use rayon::prelude::*;

use super::component::{Component, Workshop};
use super::config::MappingConfig;
use super::finish::finished;
use super::joining::join;
use super::judgements::Judgements;
use super::memo::RegistrationMemo;
use super::place_match::Decision;
use super::run::RunRecord;
use super::site_anchors::SiteAnchors;
use super::site_map::SiteMap;
use crate::pose_graph::PoseGraphError;

/// Builds the map of a site: every run is settled on its own, then runs are joined, the surest first.
///
/// The map follows from what was recorded, not from the order of `runs`: that only numbers the components, says which
/// of two runs is called the earlier, and in whose frame a component stands.
///
/// # Errors
/// Whatever the pose graph cannot solve.
pub fn map_site(
    config: &MappingConfig,
    runs: &[RunRecord<'_>],
    decisions: &[Decision],
    memo: &mut RegistrationMemo,
) -> Result<SiteMap, PoseGraphError> {
    memo.prepare(&config.submap);
    let site = SiteAnchors::new(runs, config);
    if site.driven().is_empty() {
        return Ok(SiteMap::default());
    }
    let judgements = Judgements::new(decisions, &site);
    let workshop = Workshop { site: &site, judgements: &judgements, memo };
    let alone = site
        .driven()
        .into_par_iter()
        .map(|run| Component::alone(workshop, run))
        .collect::<Result<Vec<_>, _>>()?;
    let joined = join(alone, workshop)?;
    Ok(finished(joined, &site, &judgements, runs))
}
