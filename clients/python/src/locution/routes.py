"""Every operation of the API; a test compares this list with the document."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import quote


@dataclass(frozen=True)
class Route:
    """A method and a path with names in braces."""

    operation: str
    method: str
    path: str

    def of(self, *names: str) -> str:
        """The path with its names filled in, in order."""
        parts = self.path.split("{")
        filled = [parts[0]]
        for name, part in zip(names, parts[1:], strict=True):
            filled.append(quote(name, safe="") + part.partition("}")[2])
        return "".join(filled)


GET_HEALTH = Route("get_health", "GET", "/healthz")
GET_READINESS = Route("get_readiness", "GET", "/readyz")
GET_METRICS = Route("get_metrics", "GET", "/metrics")
GET_UI = Route("get_ui", "GET", "/ui")
LIST_PIECES = Route("list_pieces", "GET", "/v1/sites/{site}/runs/{run}/pieces")
LIST_KEYS = Route("list_keys", "GET", "/v1/keys")
MAKE_KEY = Route("make_key", "POST", "/v1/keys")
REVOKE_KEY = Route("revoke_key", "DELETE", "/v1/keys/{key}")
ROTATE_KEY = Route("rotate_key", "POST", "/v1/keys/{key}/rotate")
QUERY_EXAMPLE_EVERYWHERE = Route("query_example_everywhere", "POST", "/v1/queries/example")
QUERY_LABELS_EVERYWHERE = Route("query_labels_everywhere", "POST", "/v1/queries/labels")
QUERY_WORDS_EVERYWHERE = Route("query_words_everywhere", "POST", "/v1/queries/words")
LIST_SITES = Route("list_sites", "GET", "/v1/sites")
GET_SITE = Route("get_site", "GET", "/v1/sites/{site}")
MAKE_SITE = Route("make_site", "PUT", "/v1/sites/{site}")
CHANGE_SITE = Route("change_site", "PATCH", "/v1/sites/{site}")
DELETE_SITE = Route("delete_site", "DELETE", "/v1/sites/{site}")
BACKUP_SITE = Route("backup_site", "GET", "/v1/sites/{site}/backup")
RESTORE_SITE = Route("restore_site", "PUT", "/v1/sites/{site}/backup")
BUILD_MAP = Route("build_map", "POST", "/v1/sites/{site}/builds")
LIST_ANNOTATIONS = Route("list_annotations", "GET", "/v1/sites/{site}/annotations")
MAKE_ANNOTATION = Route("make_annotation", "POST", "/v1/sites/{site}/annotations")
GET_ANNOTATION = Route("get_annotation", "GET", "/v1/sites/{site}/annotations/{id}")
CHANGE_ANNOTATION = Route("change_annotation", "PUT", "/v1/sites/{site}/annotations/{id}")
DELETE_ANNOTATION = Route("delete_annotation", "DELETE", "/v1/sites/{site}/annotations/{id}")
LIST_CHANNELS = Route("list_channels", "GET", "/v1/sites/{site}/channels")
GET_CHANNEL = Route("get_channel", "GET", "/v1/sites/{site}/channels/{channel}")
MOVE_CHANNEL = Route("move_channel", "PUT", "/v1/sites/{site}/channels/{channel}")
DELETE_CHANNEL = Route("delete_channel", "DELETE", "/v1/sites/{site}/channels/{channel}")
ROLL_BACK_CHANNEL = Route("roll_back_channel", "POST", "/v1/sites/{site}/channels/{channel}/rollback")
LIST_CHANNEL_ROBOTS = Route("list_channel_robots", "GET", "/v1/sites/{site}/channels/{channel}/robots")
REPORT_CHANNEL_ROBOT = Route("report_channel_robot", "PUT", "/v1/sites/{site}/channels/{channel}/robots/{robot}")
LIST_CHANGES = Route("list_changes", "GET", "/v1/sites/{site}/changes")
WATCH_SITE = Route("watch_site", "GET", "/v1/sites/{site}/events")
LIST_JOBS = Route("list_jobs", "GET", "/v1/sites/{site}/jobs")
GET_JOB = Route("get_job", "GET", "/v1/sites/{site}/jobs/{id}")
CANCEL_JOB = Route("cancel_job", "DELETE", "/v1/sites/{site}/jobs/{id}")
LIST_LABELS = Route("list_labels", "GET", "/v1/sites/{site}/labels")
LIST_LOCALIZATIONS = Route("list_localizations", "GET", "/v1/sites/{site}/localisations")
OPEN_LOCALIZATION = Route("open_localization", "POST", "/v1/sites/{site}/localisations")
GET_LOCALIZATION = Route("get_localization", "GET", "/v1/sites/{site}/localisations/{id}")
CLOSE_LOCALIZATION = Route("close_localization", "DELETE", "/v1/sites/{site}/localisations/{id}")
APPEND_LOCALIZATION_BATCH = Route("append_localization_batch", "POST", "/v1/sites/{site}/localisations/{id}/batches")
GET_MAP = Route("get_map", "GET", "/v1/sites/{site}/map")
GET_GRAPH_G2O = Route("get_graph_g2o", "GET", "/v1/sites/{site}/map/graph.g2o")
GET_GRID = Route("get_grid", "GET", "/v1/sites/{site}/map/grid")
GET_GRID_PGM = Route("get_grid_pgm", "GET", "/v1/sites/{site}/map/grid.pgm")
GET_GRID_PNG = Route("get_grid_png", "GET", "/v1/sites/{site}/map/grid.png")
GET_GRID_YAML = Route("get_grid_yaml", "GET", "/v1/sites/{site}/map/grid.yaml")
GET_PICTURE_PNG = Route("get_picture_png", "GET", "/v1/sites/{site}/map/picture.png")
GET_PICTURE_SVG = Route("get_picture_svg", "GET", "/v1/sites/{site}/map/picture.svg")
GET_ROOMS_GEOJSON = Route("get_rooms_geojson", "GET", "/v1/sites/{site}/map/rooms.geojson")
GET_MAP_MCAP = Route("get_map_mcap", "GET", "/v1/sites/{site}/map/map.mcap")
GET_MAP_TUM = Route("get_map_tum", "GET", "/v1/sites/{site}/map/trajectory.tum")
LIST_MATCHES = Route("list_matches", "GET", "/v1/sites/{site}/matches")
GET_MATCH = Route("get_match", "GET", "/v1/sites/{site}/matches/{id}")
DECIDE_MATCH = Route("decide_match", "PUT", "/v1/sites/{site}/matches/{id}/decision")
UNDECIDE_MATCH = Route("undecide_match", "DELETE", "/v1/sites/{site}/matches/{id}/decision")
LIST_PLACES = Route("list_places", "GET", "/v1/sites/{site}/places")
QUERY_EXAMPLE = Route("query_example", "POST", "/v1/sites/{site}/queries/example")
QUERY_LABELS = Route("query_labels", "POST", "/v1/sites/{site}/queries/labels")
QUERY_WORDS = Route("query_words", "POST", "/v1/sites/{site}/queries/words")
LIST_ROOMS = Route("list_rooms", "GET", "/v1/sites/{site}/rooms")
GET_ROUTE = Route("get_route", "GET", "/v1/sites/{site}/route")
LIST_RUNS = Route("list_runs", "GET", "/v1/sites/{site}/runs")
GET_RUN = Route("get_run", "GET", "/v1/sites/{site}/runs/{run}")
MAKE_RUN = Route("make_run", "PUT", "/v1/sites/{site}/runs/{run}")
DELETE_RUN = Route("delete_run", "DELETE", "/v1/sites/{site}/runs/{run}")
APPEND_BATCH = Route("append_batch", "POST", "/v1/sites/{site}/runs/{run}/batches")
FINISH_RUN = Route("finish_run", "POST", "/v1/sites/{site}/runs/{run}/finish")
LIST_OBSERVATIONS = Route("list_observations", "GET", "/v1/sites/{site}/runs/{run}/observations")
LIST_SCANS = Route("list_scans", "GET", "/v1/sites/{site}/runs/{run}/scans")
GET_TRAJECTORY = Route("get_trajectory", "GET", "/v1/sites/{site}/runs/{run}/trajectory")
GET_TRAJECTORY_TUM = Route("get_trajectory_tum", "GET", "/v1/sites/{site}/runs/{run}/trajectory.tum")
LIST_WORDS = Route("list_words", "GET", "/v1/sites/{site}/runs/{run}/words")
