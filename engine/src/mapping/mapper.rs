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
use super::watch::{MapStage, MappingError, Watch};

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
) -> Result<SiteMap, MappingError> {
    map_site_watched(config, runs, decisions, memo, Watch::nobody())
}

/// Builds the map of a site while somebody watches how far it is, who may end it. What was registered until then is
/// remembered.
///
/// # Errors
/// Whatever the pose graph cannot solve; [`MappingError::Stopped`].
pub fn map_site_watched(
    config: &MappingConfig,
    runs: &[RunRecord<'_>],
    decisions: &[Decision],
    memo: &mut RegistrationMemo,
    watch: Watch<'_>,
) -> Result<SiteMap, MappingError> {
    memo.prepare(&config.submap);
    let site = SiteAnchors::new(runs, config);
    if site.driven().is_empty() {
        return Ok(SiteMap::default());
    }
    let judgements = Judgements::new(decisions, &site);
    let workshop =
        Workshop { site: &site, judgements: &judgements, memo, span: watch.stage(MapStage::Settling) };
    let driven = site.driven();
    let alone = (driven.par_iter().enumerate())
        .map(|(idx, &run)| Component::alone(workshop.part(idx, driven.len()), run))
        .collect::<Result<Vec<_>, _>>()?;
    let joined = join(alone, Workshop { span: watch.stage(MapStage::Joining), ..workshop })?;
    Ok(finished(joined, &site, &judgements, runs))
}
