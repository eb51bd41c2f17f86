//! What changed between two sessions: a drawn office, driven twice, with a cabinet moved in between.

use locution_engine::geometry::{Point2, Pose2};
use locution_lab::simulation::World;
use locution_tests::{Api, TestServer};
use serde_json::{Value, json};

use crate::drawn::{Block, drawn_world, drive_route};

/// A corridor round a block with rooms beside it that make every part of it its own.
const FLOOR: [Block; 9] = [
    (1.0, 1.0, 29.0, 3.5),
    (1.0, 16.5, 29.0, 19.0),
    (1.0, 1.0, 3.5, 19.0),
    (26.5, 1.0, 29.0, 19.0),
    (6.0, 3.5, 7.2, 7.0),
    (10.0, 3.5, 15.0, 8.0),
    (19.0, 14.5, 20.0, 16.5),
    (22.0, 12.0, 26.5, 16.5),
    (3.5, 10.0, 5.5, 11.5),
];
const CABINET_BEFORE: Block = (18.0, 1.0, 19.2, 1.6);
const CABINET_AFTER: Block = (12.0, 6.4, 13.0, 7.4);
const ROUTE: [(f64, f64); 9] = [
    (4.0, 2.2),
    (12.5, 2.5),
    (12.5, 4.8),
    (14.0, 2.4),
    (27.5, 2.4),
    (27.7, 17.7),
    (2.2, 17.7),
    (2.2, 2.4),
    (20.0, 2.4),
];

fn office(cabinet: Block) -> World {
    drawn_world((600, 400), &FLOOR, &[cabinet])
}

/// Drives a session and answers where it truly began.
async fn post_session(api: &Api, run: &str, cabinet: Block, seed: u64) -> Pose2 {
    api.put("/v1/sites/a", &json!({})).await.ok();
    drive_route(api, ("a", run), &office(cabinet), &ROUTE, seed).await
}

fn number(value: &Value, name: &str) -> f64 {
    value[name].as_f64().unwrap()
}

/// True for a change of a kind about where a block of the world is.
fn is_at(change: &Value, kind: &str, (x0, y0, x1, y1): Block, world_from_map: &Pose2) -> bool {
    let center = Point2::new(number(&change["centre"], "x"), number(&change["centre"], "y"));
    let place = world_from_map.transform_point(&center);
    let reach_m = 0.4;
    change["kind"] == kind
        && (x0 - reach_m..x1 + reach_m).contains(&place.x)
        && (y0 - reach_m..y1 + reach_m).contains(&place.y)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cabinet_that_was_moved_is_listed_where_it_was_and_where_it_is() {
    let server = TestServer::start().await;
    let api = &server.api;
    let start = post_session(api, "monday", CABINET_BEFORE, 3).await;
    api.get("/v1/sites/a/changes").await.problem(409, "not-ready");
    post_session(api, "friday", CABINET_AFTER, 4).await;
    let job = api.post("/v1/sites/a/builds?wait=true", &json!({})).await.ok();
    assert_eq!(job["state"], "done", "{job}");

    let changes = api.all("/v1/sites/a/changes").await;
    let first = &api.get("/v1/sites/a/runs/monday/trajectory?frame=map").await.ok()["poses"][0];
    let map_from_start = Pose2::new(number(first, "x"), number(first, "y"), number(first, "theta"));
    let world_from_map = start.compose(&map_from_start.inverse());
    let went = |change: &Value| is_at(change, "disappeared", CABINET_BEFORE, &world_from_map);
    let came = |change: &Value| is_at(change, "appeared", CABINET_AFTER, &world_from_map);
    assert!(changes.iter().any(went) && changes.iter().any(came), "{changes:?}");
    assert!(changes.iter().all(|change| went(change) || came(change)), "nothing else changed: {changes:?}");

    for change in &changes {
        assert_eq!(change["last_as_before"]["run"], "monday", "{change}");
        assert_eq!(change["first_as_after"]["run"], "friday", "{change}");
    }

    // Asked the other way round, what went has come.
    let backwards = api.all("/v1/sites/a/changes?before=friday&after=monday").await;
    let came_back = |change: &Value| is_at(change, "appeared", CABINET_BEFORE, &world_from_map);
    assert!(backwards.iter().any(came_back), "{backwards:?}");
    let twice = api.get("/v1/sites/a/changes?before=monday&after=monday").await;
    assert_eq!(twice.problem(422, "invalid-value")["field"], "before");
    api.get("/v1/sites/a/changes?after=sunday").await.problem(404, "not-found");
    api.get("/v1/sites/a/changes?since=monday").await.problem(400, "malformed-query");
    server.stop().await;
}
