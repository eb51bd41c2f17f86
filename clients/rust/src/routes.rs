//! Every route of the API. A test holds the list against the API's document, the compiler holds it against the methods.

use std::fmt::Display;

use reqwest::Method;

use crate::pages::percent_encoded;

/// One operation of the document.
pub(crate) struct Route {
    /// Its name in the document.
    #[cfg(test)]
    pub(crate) operation: &'static str,
    pub(crate) method: Method,
    /// With names in braces.
    pub(crate) path: &'static str,
}

impl Route {
    /// The path with the names filled in, in their order.
    pub(crate) fn with(&self, names: &[&str]) -> String {
        let mut path = String::new();
        let mut names = names.iter();
        for segment in self.path.split('/').skip(1) {
            path.push('/');
            match (segment.starts_with('{'), names.as_slice().first()) {
                (true, Some(name)) => {
                    path.push_str(&percent_encoded(name));
                    names.next();
                }
                _ => path.push_str(segment),
            }
        }
        path
    }
}

/// Parameters after the question mark.
#[derive(Clone, Default)]
pub(crate) struct Query(String);

impl Query {
    /// With one more parameter, when it is there.
    pub(crate) fn and(mut self, name: &str, value: Option<impl Display>) -> Self {
        if let Some(value) = value {
            self.0.push(if self.0.is_empty() { '?' } else { '&' });
            self.0.push_str(&format!("{name}={}", percent_encoded(&value.to_string())));
        }
        self
    }

    /// Appended to a path.
    pub(crate) fn after(&self, path: String) -> String {
        path + &self.0
    }
}

macro_rules! routes {
    ($($name:ident $operation:literal $method:ident $path:literal;)*) => {
        $(pub(crate) const $name: Route = Route {
            #[cfg(test)]
            operation: $operation,
            method: Method::$method,
            path: $path,
        };)*
        /// All of them.
        #[cfg(test)]
        pub(crate) const ALL: &[Route] = &[$($name),*];
    };
}

routes! {
    LIST_SITES "list_sites" GET "/v1/sites";
    GET_SITE "get_site" GET "/v1/sites/{site}";
    MAKE_SITE "make_site" PUT "/v1/sites/{site}";
    CHANGE_SITE "change_site" PATCH "/v1/sites/{site}";
    DELETE_SITE "delete_site" DELETE "/v1/sites/{site}";
    BACKUP_SITE "backup_site" GET "/v1/sites/{site}/backup";
    RESTORE_SITE "restore_site" PUT "/v1/sites/{site}/backup";
    WATCH_SITE "watch_site" GET "/v1/sites/{site}/events";
    LIST_RUNS "list_runs" GET "/v1/sites/{site}/runs";
    GET_RUN "get_run" GET "/v1/sites/{site}/runs/{run}";
    MAKE_RUN "make_run" PUT "/v1/sites/{site}/runs/{run}";
    DELETE_RUN "delete_run" DELETE "/v1/sites/{site}/runs/{run}";
    FINISH_RUN "finish_run" POST "/v1/sites/{site}/runs/{run}/finish";
    LIST_PIECES "list_pieces" GET "/v1/sites/{site}/runs/{run}/pieces";
    APPEND_BATCH "append_batch" POST "/v1/sites/{site}/runs/{run}/batches";
    LIST_SCANS "list_scans" GET "/v1/sites/{site}/runs/{run}/scans";
    LIST_OBSERVATIONS "list_observations" GET "/v1/sites/{site}/runs/{run}/observations";
    LIST_WORDS "list_words" GET "/v1/sites/{site}/runs/{run}/words";
    GET_TRAJECTORY "get_trajectory" GET "/v1/sites/{site}/runs/{run}/trajectory";
    GET_TRAJECTORY_TUM "get_trajectory_tum" GET "/v1/sites/{site}/runs/{run}/trajectory.tum";
    LIST_KEYS "list_keys" GET "/v1/keys";
    MAKE_KEY "make_key" POST "/v1/keys";
    ROTATE_KEY "rotate_key" POST "/v1/keys/{key}/rotate";
    REVOKE_KEY "revoke_key" DELETE "/v1/keys/{key}";
    BUILD_MAP "build_map" POST "/v1/sites/{site}/builds";
    LIST_JOBS "list_jobs" GET "/v1/sites/{site}/jobs";
    GET_JOB "get_job" GET "/v1/sites/{site}/jobs/{id}";
    CANCEL_JOB "cancel_job" DELETE "/v1/sites/{site}/jobs/{id}";
    LIST_MATCHES "list_matches" GET "/v1/sites/{site}/matches";
    GET_MATCH "get_match" GET "/v1/sites/{site}/matches/{id}";
    DECIDE_MATCH "decide_match" PUT "/v1/sites/{site}/matches/{id}/decision";
    UNDECIDE_MATCH "undecide_match" DELETE "/v1/sites/{site}/matches/{id}/decision";
    GET_MAP "get_map" GET "/v1/sites/{site}/map";
    GET_GRID "get_grid" GET "/v1/sites/{site}/map/grid";
    GET_GRID_PGM "get_grid_pgm" GET "/v1/sites/{site}/map/grid.pgm";
    GET_GRID_PNG "get_grid_png" GET "/v1/sites/{site}/map/grid.png";
    GET_GRID_YAML "get_grid_yaml" GET "/v1/sites/{site}/map/grid.yaml";
    GET_GRAPH_G2O "get_graph_g2o" GET "/v1/sites/{site}/map/graph.g2o";
    GET_MAP_MCAP "get_map_mcap" GET "/v1/sites/{site}/map/map.mcap";
    GET_MAP_TUM "get_map_tum" GET "/v1/sites/{site}/map/trajectory.tum";
    GET_PICTURE_PNG "get_picture_png" GET "/v1/sites/{site}/map/picture.png";
    GET_PICTURE_SVG "get_picture_svg" GET "/v1/sites/{site}/map/picture.svg";
    OPEN_LOCALIZATION "open_localization" POST "/v1/sites/{site}/localisations";
    LIST_LOCALIZATIONS "list_localizations" GET "/v1/sites/{site}/localisations";
    GET_LOCALIZATION "get_localization" GET "/v1/sites/{site}/localisations/{id}";
    CLOSE_LOCALIZATION "close_localization" DELETE "/v1/sites/{site}/localisations/{id}";
    APPEND_LOCALIZATION_BATCH "append_localization_batch" POST "/v1/sites/{site}/localisations/{id}/batches";
    QUERY_EXAMPLE "query_example" POST "/v1/sites/{site}/queries/example";
    QUERY_EXAMPLE_EVERYWHERE "query_example_everywhere" POST "/v1/queries/example";
    QUERY_WORDS "query_words" POST "/v1/sites/{site}/queries/words";
    QUERY_WORDS_EVERYWHERE "query_words_everywhere" POST "/v1/queries/words";
    QUERY_LABELS "query_labels" POST "/v1/sites/{site}/queries/labels";
    QUERY_LABELS_EVERYWHERE "query_labels_everywhere" POST "/v1/queries/labels";
    LIST_LABELS "list_labels" GET "/v1/sites/{site}/labels";
    LIST_PLACES "list_places" GET "/v1/sites/{site}/places";
    GET_ROUTE "get_route" GET "/v1/sites/{site}/route";
    LIST_ROOMS "list_rooms" GET "/v1/sites/{site}/rooms";
    GET_ROOMS_GEOJSON "get_rooms_geojson" GET "/v1/sites/{site}/map/rooms.geojson";
    LIST_ANNOTATIONS "list_annotations" GET "/v1/sites/{site}/annotations";
    MAKE_ANNOTATION "make_annotation" POST "/v1/sites/{site}/annotations";
    GET_ANNOTATION "get_annotation" GET "/v1/sites/{site}/annotations/{id}";
    CHANGE_ANNOTATION "change_annotation" PUT "/v1/sites/{site}/annotations/{id}";
    DELETE_ANNOTATION "delete_annotation" DELETE "/v1/sites/{site}/annotations/{id}";
    LIST_CHANNELS "list_channels" GET "/v1/sites/{site}/channels";
    GET_CHANNEL "get_channel" GET "/v1/sites/{site}/channels/{channel}";
    MOVE_CHANNEL "move_channel" PUT "/v1/sites/{site}/channels/{channel}";
    DELETE_CHANNEL "delete_channel" DELETE "/v1/sites/{site}/channels/{channel}";
    ROLL_BACK_CHANNEL "roll_back_channel" POST "/v1/sites/{site}/channels/{channel}/rollback";
    LIST_CHANNEL_ROBOTS "list_channel_robots" GET "/v1/sites/{site}/channels/{channel}/robots";
    REPORT_CHANNEL_ROBOT "report_channel_robot" PUT "/v1/sites/{site}/channels/{channel}/robots/{robot}";
    LIST_CHANGES "list_changes" GET "/v1/sites/{site}/changes";
    GET_HEALTH "get_health" GET "/healthz";
    GET_READINESS "get_readiness" GET "/readyz";
    GET_METRICS "get_metrics" GET "/metrics";
    GET_UI "get_ui" GET "/ui";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_parameters_are_escaped() {
        let route = Route { operation: "", method: Method::GET, path: "/v1/sites/{site}/runs/{run}/scans" };
        assert_eq!(route.with(&["a", "b/c"]), "/v1/sites/a/runs/b%2Fc/scans");
        let query = Query::default().and("a", Some("x y")).and("b", None::<u8>).and("c", Some(7));
        assert_eq!(query.after("/p".into()), "/p?a=x%20y&c=7");
    }
}
