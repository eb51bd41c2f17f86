//! The whole API on one screen.

use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::{forms, page};
use super::resources::{
    backups, batches, changes, jobs, labels, localizations, maps, matches, operations, places, runs, sites,
    texts, word_queries,
};
use crate::state::AppState;

/// Every route, with its documentation.
pub(crate) fn routes() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(operations::healthz))
        .routes(routes!(operations::readyz))
        .routes(routes!(operations::metrics))
        .routes(routes!(page::ui))
        .routes(routes!(sites::list_sites))
        .routes(routes!(sites::make_site, sites::get_site, sites::delete_site))
        .routes(routes!(backups::backup_site, backups::restore_site))
        .routes(routes!(runs::list_runs))
        .routes(routes!(runs::make_run, runs::get_run))
        .routes(routes!(runs::finish_run))
        .routes(routes!(batches::append_batch))
        .routes(routes!(batches::list_scans))
        .routes(routes!(texts::list_observations))
        .routes(routes!(texts::list_words))
        .routes(routes!(texts::get_trajectory))
        .routes(routes!(texts::get_trajectory_tum))
        .routes(routes!(jobs::build_map))
        .routes(routes!(jobs::list_jobs))
        .routes(routes!(jobs::get_job))
        .routes(routes!(matches::list_matches))
        .routes(routes!(matches::get_match))
        .routes(routes!(matches::decide_match, matches::undecide_match))
        .routes(routes!(maps::get_map))
        .routes(routes!(forms::get_grid))
        .routes(routes!(forms::get_grid_pgm))
        .routes(routes!(forms::get_grid_png))
        .routes(routes!(forms::get_grid_yaml))
        .routes(routes!(forms::get_graph_g2o))
        .routes(routes!(forms::get_map_tum))
        .routes(routes!(forms::get_picture_png))
        .routes(routes!(forms::get_picture_svg))
        .routes(routes!(localizations::open_localization))
        .routes(routes!(localizations::get_localization, localizations::close_localization))
        .routes(routes!(localizations::localize))
        .routes(routes!(localizations::query_example))
        .routes(routes!(word_queries::query_words))
        .routes(routes!(word_queries::query_words_everywhere))
        .routes(routes!(labels::list_labels))
        .routes(routes!(labels::query_labels))
        .routes(routes!(places::list_places))
        .routes(routes!(places::get_route))
        .routes(routes!(changes::list_changes))
        .routes(routes!(localizations::query_example_everywhere))
}
