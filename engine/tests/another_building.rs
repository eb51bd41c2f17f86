//! A robot in a building that the map does not hold: never told a place, and told so.
//!
//! Skipped where the case is absent; `LOCUTION_CASES` says where cases are.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use locution_engine::config::EngineConfig;
use locution_engine::locate::{LocalizationState, SiteSession};
use locution_lab::open_world::{Part, PreparedMap};

fn case() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/cases");
    let cases = std::env::var_os("LOCUTION_CASES").map_or(beside, PathBuf::from);
    let folder = cases.join("another-building");
    if !folder.is_dir() {
        eprintln!("skipped: {} is not there", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn a_robot_in_another_building_is_told_that_it_is_elsewhere() {
    let Some(folder) = case() else { return };
    let config = EngineConfig::default();
    let map = PreparedMap::of(&Part::read(&folder, "map").unwrap(), &config, None).unwrap();
    let stranger = Part::read(&folder, "stranger").unwrap();
    let mut session =
        SiteSession::new(stranger.geometry.clone(), Arc::new(config.session()), map.session_map, None);
    for scan in &stranger.scans {
        session.push(scan);
        assert_ne!(session.state(), LocalizationState::Converged, "after {:.1} m", session.travel_m());
    }
    let answer = session.estimate();
    assert_eq!(answer.state, LocalizationState::Lost, "{answer:?}");
    assert!(answer.probability_elsewhere > 0.5 && !answer.missing.is_empty(), "{answer:?}");
}
