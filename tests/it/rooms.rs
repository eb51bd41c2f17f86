//! Rooms and what people draw into a map: through builds, restarts, merges and deletions.

use locution_engine::geometry::{Point2, Pose2};
use locution_lab::simulation::World;
use locution_tests::{Api, TestServer};
use serde_json::{Value, json};

use crate::drawn::{Block, drawn_world, drive_route};

/// A corridor round a block with rooms beside it.
const FLOOR: [Block; 9] = [
    (1.0, 1.0, 29.0, 3.5),
    (1.0, 16.5, 29.0, 19.0),
    (1.0, 1.0, 3.5, 19.0),
    (26.5, 1.0, 29.0, 19.0),
    (6.5, 3.5, 7.5, 4.5),
    (5.0, 4.5, 10.0, 8.0),
    (16.5, 3.5, 17.5, 4.5),
    (14.0, 4.5, 19.0, 8.0),
    (22.0, 12.0, 26.5, 16.5),
];
/// Round the block, with a look into both rooms.
const ROUTE: [(f64, f64); 10] = [
    (4.0, 2.2),
    (7.0, 2.3),
    (7.0, 6.0),
    (7.0, 2.4),
    (17.0, 2.4),
    (17.0, 6.0),
    (17.0, 2.4),
    (27.5, 2.4),
    (27.7, 17.7),
    (2.2, 17.7),
];

fn office() -> World {
    drawn_world((600, 400), &FLOOR, &[])
}

async fn post_run(api: &Api, run: &str, corners: &[(f64, f64)], seed: u64) -> Pose2 {
    drive_route(api, ("office", run), &office(), corners, seed).await
}

async fn build(api: &Api) {
    api.post("/v1/sites/office/builds?wait=true", &json!({})).await.ok();
}

/// The pose of the first keyframe of a run in the serving map.
async fn first_pose(api: &Api, run: &str) -> Pose2 {
    let map = api.get("/v1/sites/office/map").await.ok();
    let runs = map["runs"].as_array().unwrap();
    let pose = &runs.iter().find(|mapped| mapped["run"] == run).unwrap()["poses"][0];
    let number = |name: &str| pose[name].as_f64().unwrap();
    Pose2::new(number("x"), number("y"), number("theta"))
}

fn holds(room: &Value, point: &Point2) -> bool {
    let rings = room["geometry"]["coordinates"].as_array().unwrap();
    let crosses = |two: &[Value]| {
        let at = |idx: usize, axis: usize| two[idx][axis].as_f64().unwrap();
        (at(0, 1) > point.y) != (at(1, 1) > point.y)
            && point.x < at(0, 0) + (point.y - at(0, 1)) / (at(1, 1) - at(0, 1)) * (at(1, 0) - at(0, 0))
    };
    let count = |ring: &Value| ring.as_array().unwrap().windows(2).filter(|two| crosses(two)).count();
    rings.iter().map(count).sum::<usize>() % 2 == 1
}

/// The room at a point of the plan.
async fn room_at(api: &Api, map_from_plan: &Pose2, x: f64, y: f64) -> Value {
    let point = map_from_plan.transform_point(&Point2::new(x, y));
    let rooms = api.all("/v1/sites/office/rooms").await;
    rooms.iter().find(|room| holds(room, &point)).unwrap_or_else(|| panic!("{rooms:#?}")).clone()
}

fn point(point: &Point2) -> Value {
    json!({"type": "Point", "coordinates": [point.x, point.y]})
}

fn distance(annotation: &Value, to: &Point2) -> f64 {
    let at = |axis: usize| annotation["geometry"]["coordinates"][axis].as_f64().unwrap();
    Point2::new(at(0), at(1)).distance(to)
}

#[tokio::test(flavor = "multi_thread")]
async fn rooms_and_annotations_keep_their_places_through_every_rebuild() {
    let server = TestServer::start().await;
    let api = &server.api;
    api.put("/v1/sites/office", &json!({})).await.ok();
    api.get("/v1/sites/office/rooms").await.problem(409, "not-ready");
    let start = post_run(api, "a", &ROUTE[..7], 11).await;
    build(api).await;
    let map_from_plan = first_pose(api, "a").await.compose(&start.inverse());

    let kitchen = room_at(api, &map_from_plan, 16.0, 6.0).await;
    let corridor = room_at(api, &map_from_plan, 12.0, 2.2).await;
    assert_eq!(corridor["label"], "corridor");
    assert!(kitchen["neighbours"].as_array().unwrap().contains(&corridor["id"]), "{kitchen}");
    assert!((kitchen["area_m2"].as_f64().unwrap() - 17.5).abs() < 4.0, "{kitchen}");

    let dock = map_from_plan.transform_point(&Point2::new(16.2, 6.5));
    let annotations = "/v1/sites/office/annotations";
    let name = json!({"kind": "room", "name": "Kitchen", "geometry": point(&dock)});
    let named = api.post(annotations, &name).await.ok();
    let room = room_at(api, &map_from_plan, 16.0, 6.0).await;
    assert_eq!((&room["name"], &room["id"]), (&json!("Kitchen"), &kitchen["id"]));

    // From the left end of the corridor the kitchen is behind its second door on the left.
    let from = map_from_plan.transform_point(&Point2::new(4.2, 2.2));
    let way =
        format!("/v1/sites/office/route?from_x={}&from_y={}&to_x={}&to_y={}", from.x, from.y, dock.x, dock.y);
    let route = api.get(&way).await.ok();
    let told = route["description"].as_str().unwrap();
    assert!(told.contains("through the second door on the left into Kitchen"), "{told}");

    // More runs, another frame perhaps, and a restart in between.
    let tag = api.get("/v1/sites/office/map/rooms.geojson").await.headers["etag"].clone();
    let start_b = post_run(api, "b", &ROUTE, 12).await;
    build(api).await;
    let server = server.restart().await;
    let api = &server.api;
    let map_from_plan = first_pose(api, "b").await.compose(&start_b.inverse());
    let room = room_at(api, &map_from_plan, 16.0, 6.0).await;
    assert_eq!((&room["name"], &room["id"]), (&json!("Kitchen"), &kitchen["id"]));
    assert_eq!(room_at(api, &map_from_plan, 12.0, 2.2).await["id"], corridor["id"]);
    let one = format!("{annotations}/{}", named["id"].as_str().unwrap());
    let there = map_from_plan.transform_point(&Point2::new(16.2, 6.5));
    assert!(distance(&api.get(&one).await.ok(), &there) < 0.3);
    assert!(distance(&api.get(&format!("{one}?version=1")).await.ok(), &dock) < 1e-6);
    let collection = api.get("/v1/sites/office/map/rooms.geojson").await;
    assert_ne!(collection.headers["etag"], tag);
    let features = collection.ok()["features"].as_array().unwrap().clone();
    for kind in ["room", "door", "annotation"] {
        assert!(features.iter().any(|feature| feature["properties"]["feature"] == kind), "{kind}");
    }

    // The run on which it was drawn goes; the other has driven there, too.
    api.delete("/v1/sites/office/runs/a").await.ok();
    build(api).await;
    let map_from_plan = first_pose(api, "b").await.compose(&start_b.inverse());
    let there = map_from_plan.transform_point(&Point2::new(16.2, 6.5));
    assert!(distance(&api.get(&one).await.ok(), &there) < 0.3);
    assert_eq!(room_at(api, &map_from_plan, 16.0, 6.0).await["name"], "Kitchen");

    let area = json!({"kind": "no-go", "name": "Stairs", "geometry": {"type": "LineString",
        "coordinates": [[there.x, there.y], [there.x + 1.0, there.y]]}});
    let tag = api.get("/v1/sites/office/map/rooms.geojson").await.headers["etag"].clone();
    assert_eq!(api.put(&one, &area).await.ok()["geometry"]["type"], "LineString");
    assert_ne!(api.get("/v1/sites/office/map/rooms.geojson").await.headers["etag"], tag);
    assert_eq!(api.all(&format!("{annotations}?kind=no-go")).await.len(), 1);
    assert_eq!(api.delete(&one).await.status, 204);
    api.delete(&one).await.problem(404, "not-found");
    api.put(&one, &area).await.problem(404, "not-found");
    assert!(api.all(annotations).await.is_empty());
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_drawn_is_refused_by_its_field() {
    let server = TestServer::start().await;
    let api = &server.api;
    api.put("/v1/sites/office", &json!({})).await.ok();
    let annotations = "/v1/sites/office/annotations";
    let good = json!({"kind": "dock", "name": "Dock", "geometry": {"type": "Point", "coordinates": [0, 0]}});
    api.post(annotations, &good).await.problem(409, "not-ready");
    post_run(api, "a", &ROUTE[..2], 5).await;
    build(api).await;
    let with = |member: &str, value: Value| {
        let mut body = good.clone();
        body[member] = value;
        body
    };
    for (body, field) in [
        (with("kind", json!("no go")), "kind"),
        (with("name", json!(" ")), "name"),
        (with("name", json!("x".repeat(201))), "name"),
        (with("geometry", json!({"type": "Point", "coordinates": [1e9, 0]})), "geometry.coordinates[0]"),
        (with("geometry", json!({"type": "LineString", "coordinates": [[0, 0]]})), "geometry.coordinates"),
    ] {
        assert_eq!(api.post(annotations, &body).await.problem(422, "invalid-value")["field"], field);
    }
    api.post(annotations, &with("component", json!(7))).await.problem(404, "not-found");
    assert_eq!(api.post(annotations, &with("colour", json!(1))).await.status, 400);
    assert_eq!(api.post(annotations, &with("geometry", json!({"type": "Circle"}))).await.status, 400);
    server.stop().await;
}
