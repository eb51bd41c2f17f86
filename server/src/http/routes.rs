//! The whole API on one screen.

use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::resources::{
    annotations, backups, batches, changes, channels, events, jobs, keys, labels, localizations, maps,
    matches, operations, places, rooms, runs, sites, texts, word_queries,
};
use super::{forms, page};
use crate::auth::{Rule, Ruled};
use crate::config::Scope;
use crate::state::AppState;

/// Every route, with what it asks of a key and its documentation.
pub(crate) fn routes() -> OpenApiRouter<AppState> {
    const OPEN: Rule = Rule::OPEN;
    const READ: Rule = Rule::of(Scope::Read);
    const WRITE: Rule = Rule::of(Scope::Write);
    const ADMIN: Rule = Rule::of(Scope::Admin);
    OpenApiRouter::new()
        .ruled(OPEN, routes!(operations::healthz))
        .ruled(OPEN, routes!(operations::readyz))
        .ruled(READ.at_once(), routes!(operations::metrics))
        .ruled(OPEN, routes!(page::ui))
        .ruled(ADMIN, routes!(keys::list_keys, keys::make_key))
        .ruled(ADMIN, routes!(keys::rotate_key))
        .ruled(ADMIN, routes!(keys::revoke_key))
        .ruled(READ, routes!(sites::list_sites))
        .ruled(READ, routes!(sites::get_site))
        .ruled(ADMIN, routes!(sites::make_site, sites::change_site, sites::delete_site))
        .ruled(ADMIN, routes!(backups::backup_site))
        .ruled(ADMIN.with_stream(), routes!(backups::restore_site))
        .ruled(READ, routes!(events::watch_site))
        .ruled(READ, routes!(runs::list_runs))
        .ruled(READ, routes!(runs::get_run))
        .ruled(WRITE, routes!(runs::make_run, runs::delete_run))
        .ruled(WRITE, routes!(runs::finish_run))
        .ruled(READ, routes!(runs::list_pieces))
        .ruled(WRITE.with_scans(), routes!(batches::append_batch))
        .ruled(READ, routes!(batches::list_scans))
        .ruled(READ, routes!(texts::list_observations))
        .ruled(READ, routes!(texts::list_words))
        .ruled(READ, routes!(texts::get_trajectory))
        .ruled(READ, routes!(texts::get_trajectory_tum))
        .ruled(WRITE, routes!(jobs::build_map))
        .ruled(READ, routes!(jobs::list_jobs))
        .ruled(READ, routes!(jobs::get_job))
        .ruled(WRITE, routes!(jobs::cancel_job))
        .ruled(READ, routes!(matches::list_matches))
        .ruled(READ, routes!(matches::get_match))
        .ruled(WRITE, routes!(matches::decide_match, matches::undecide_match))
        .ruled(READ, routes!(maps::get_map))
        .ruled(READ, routes!(channels::list_channels))
        .ruled(READ, routes!(channels::get_channel))
        .ruled(ADMIN, routes!(channels::move_channel_to, channels::delete_channel_of))
        .ruled(ADMIN, routes!(channels::roll_back_channel))
        .ruled(READ, routes!(channels::list_channel_robots))
        .ruled(WRITE, routes!(channels::report_channel_robot))
        .ruled(READ, routes!(forms::get_grid))
        .ruled(READ, routes!(forms::get_grid_pgm))
        .ruled(READ, routes!(forms::get_grid_png))
        .ruled(READ, routes!(forms::get_grid_yaml))
        .ruled(READ, routes!(forms::get_graph_g2o))
        .ruled(READ, routes!(forms::get_map_tum))
        .ruled(READ, routes!(forms::get_map_mcap))
        .ruled(READ, routes!(forms::get_picture_png))
        .ruled(READ, routes!(forms::get_picture_svg))
        .ruled(READ, routes!(localizations::list_localizations, localizations::open_localization))
        .ruled(READ, routes!(localizations::get_localization, localizations::close_localization))
        .ruled(READ.with_scans(), routes!(localizations::localize))
        .ruled(READ.with_scans(), routes!(localizations::query_example))
        .ruled(READ, routes!(word_queries::query_words))
        .ruled(READ, routes!(word_queries::query_words_everywhere))
        .ruled(READ, routes!(labels::list_labels))
        .ruled(READ, routes!(labels::query_labels))
        .ruled(READ, routes!(labels::query_labels_everywhere))
        .ruled(READ, routes!(places::list_places))
        .ruled(READ, routes!(places::get_route))
        .ruled(READ, routes!(rooms::list_rooms))
        .ruled(READ, routes!(rooms::get_rooms_geojson))
        .ruled(READ, routes!(annotations::list_annotations))
        .ruled(READ, routes!(annotations::get_annotation))
        .ruled(WRITE, routes!(annotations::make_annotation))
        .ruled(WRITE, routes!(annotations::change_annotation_of, annotations::delete_annotation_of))
        .ruled(READ, routes!(changes::list_changes))
        .ruled(READ.with_scans(), routes!(localizations::query_example_everywhere))
}
