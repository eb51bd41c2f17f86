//! From runs to one map, the conductor.

use super::config::MappingConfig;
use super::foundation::{Foundation, MapSettings};
use super::memo::RegistrationMemo;
use super::place_match::Decision;
use super::run::RunRecord;
use super::site_map::SiteMap;
use super::watch::{MappingError, Watch};

/// Builds the map of a site from nothing: generation after generation, in the order in which the site lists its runs.
///
/// Within a generation every run is settled on its own, then runs are joined, the surest first. A generation follows from
/// what was recorded, not from the order of its runs: that only numbers the components, says which of two runs is called
/// the earlier, and in whose frame a component stands.
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
    let settings = MapSettings { mapping: config, matching: None };
    let mut foundation = Foundation::default();
    let mut generations = runs.chunks(config.generation_runs.max(1));
    let Some(mut generation) = generations.next() else { return Ok(SiteMap::default()) };
    for next in generations {
        let extended = foundation.extended(settings, generation, decisions, memo, watch)?;
        // All but the last are full.
        foundation = extended.foundation.unwrap_or(foundation);
        generation = next;
    }
    Ok(foundation.extended(settings, generation, decisions, memo, watch)?.map)
}
