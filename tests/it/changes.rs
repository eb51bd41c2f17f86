//! What changed between two sessions: a drawn office, driven twice, with a cabinet moved in between.

use locution_engine::geometry::{Point2, Pose2};
use locution_lab::simulation::{SimulationConfig, Task, World, simulate_run};
use locution_tests::{Api, TestServer};
use serde_json::{Value, json};

/// A rectangle of floor or of furniture: lower left and upper right corner, metres.
type Block = (f64, f64, f64, f64);

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
    let (width, height, resolution_m) = (600, 400, 0.05);
    let mut is_free = vec![false; width * height];
    let mut draw = |(x0, y0, x1, y1): Block, value: bool| {
        for y in (y0 / resolution_m) as usize..(y1 / resolution_m) as usize {
            for x in (x0 / resolution_m) as usize..(x1 / resolution_m) as usize {
                is_free[y * width + x] = value;
            }
        }
    };
    FLOOR.into_iter().for_each(|block| draw(block, true));
    draw(cabinet, false);
    World::new(width, height, resolution_m, Point2::new(0.0, 0.0), is_free).unwrap()
}

/// Drives a session and answers where it truly began.
async fn post_session(api: &Api, run: &str, cabinet: Block, seed: u64) -> Pose2 {
    let task = Task::Route(ROUTE.iter().map(|&(x, y)| Point2::new(x, y)).collect());
    let simulated = simulate_run(&office(cabinet), &task, &SimulationConfig::default(), seed).unwrap();
    let geometry = &simulated.geometry;
    let pose = |pose: &Pose2| json!({"x": pose.x, "y": pose.y, "theta": pose.theta});
    let made = json!({"geometry": {
        "num_ranges": geometry.num_ranges,
        "angle_min_rad": geometry.angle_min_rad,
        "angle_increment_rad": geometry.angle_increment_rad,
        "range_max_m": geometry.range_max_m,
        "robot_from_laser": pose(&geometry.robot_from_laser),
    }});
    api.put("/v1/sites/a", &json!({})).await.ok();
    api.put(&format!("/v1/sites/a/runs/{run}"), &made).await.ok();
    let reading = |&range_m: &f32| if geometry.is_return(range_m) { json!(range_m) } else { Value::Null };
    let scan = |scan: &locution_engine::scan::Scan| {
        json!({
            "timestamp_ns": scan.timestamp_ns,
            "odom_from_robot": pose(&scan.odom_from_robot),
            "ranges_m": scan.ranges_m.iter().map(reading).collect::<Vec<_>>(),
        })
    };
    let scans: Vec<Value> = simulated.scans.iter().map(scan).collect();
    api.post_all("a", run, &scans, 200).await;
    api.post(&format!("/v1/sites/a/runs/{run}/finish"), &json!({})).await.ok();
    simulated.truth[0].truth_from_robot
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
