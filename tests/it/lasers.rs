//! Lasers and robots of every kind: what they say is taken, or told why it cannot be.

use std::f64::consts::PI;
use std::path::PathBuf;

use locution_tests::{Answer, Api, TestServer, drive, geometry};
use reqwest::Method;
use serde_json::{Value, json};

async fn make(api: &Api, run: &str, geometry: &Value) -> Answer {
    api.put("/v1/sites/a", &json!({})).await.ok();
    api.put(&format!("/v1/sites/a/runs/{run}"), &json!({"geometry": geometry})).await
}

async fn words_of(api: &Api, run: &str) -> String {
    api.post(&format!("/v1/sites/a/runs/{run}/finish"), &json!({})).await.ok();
    api.get_text(&format!("/v1/sites/a/runs/{run}/words")).await
}

fn with(mut geometry: Value, field: &str, value: Value) -> Value {
    geometry[field] = value;
    geometry
}

#[tokio::test(flavor = "multi_thread")]
async fn readings_below_the_minimum_say_nothing() {
    let server = TestServer::start().await;
    let api = &server.api;
    // The robot's own mast stands before a fifth of the beams.
    let masked = |reading: Value| {
        let mut scans = drive(250, 4);
        for scan in &mut scans {
            for beam in 30..48 {
                scan["ranges_m"][beam] = reading.clone();
            }
        }
        scans
    };
    make(api, "near", &with(geometry(), "range_min_m", json!(0.5))).await.ok();
    api.post_all("a", "near", &masked(json!(0.4)), 125).await;
    make(api, "nothing", &geometry()).await.ok();
    api.post_all("a", "nothing", &masked(json!(0.0)), 125).await;
    make(api, "believed", &geometry()).await.ok();
    api.post_all("a", "believed", &masked(json!(0.4)), 125).await;
    assert_eq!(api.get("/v1/sites/a/runs/near").await.ok()["geometry"]["range_min_m"], 0.5);
    let stored = api.get("/v1/sites/a/runs/near/scans?limit=1").await.ok();
    assert_eq!(stored["items"][0]["ranges_m"][30], 0.0);
    let near = words_of(api, "near").await;
    assert_eq!(near, words_of(api, "nothing").await);
    assert_ne!(near, words_of(api, "believed").await);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn minus_infinity_is_too_near_to_tell() {
    let server = TestServer::start().await;
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/cases");
    let cases = std::env::var_os("LOCUTION_CASES").map_or_else(beside, PathBuf::from);
    let case = cases.join("readings-below-the-minimum");
    let Ok(run) = std::fs::read(case.join("run.json")) else {
        println!("skipped: the case {} is absent", case.display());
        return;
    };
    let run: Value = serde_json::from_slice(&run).unwrap();
    let api = &server.api;
    api.put("/v1/sites/a", &json!({})).await.ok();
    api.put("/v1/sites/a/runs/r", &run).await.ok();
    let post = async |file: &str| {
        let headers = [("content-type", "application/cbor")];
        let body = std::fs::read(case.join(file)).unwrap();
        api.send(Method::POST, "/v1/sites/a/runs/r/batches", &headers, body).await.unwrap()
    };
    post("batch.cbor").await.ok();
    let stored = api.get("/v1/sites/a/runs/r/scans").await.ok();
    assert_eq!(stored["items"][0]["ranges_m"][0], 0.0);
    // Two batches one after the other are no batch.
    let problem = post("two.cbor").await.problem(400, "malformed-body");
    assert!(problem["detail"].as_str().unwrap().contains("trailing"), "{problem}");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn readings_in_thousandths_and_angles_in_degrees_are_told() {
    let server = TestServer::start().await;
    let api = &server.api;
    for (field, value, word) in [
        ("angle_min_rad", json!(-90.0), "degrees"),
        ("angle_increment_rad", json!(2.0), "degrees"),
        ("range_max_m", json!(20_000.0), "millimetres"),
        ("range_min_m", json!(60.0), "range_max_m"),
        ("num_ranges_min", json!(91), "num_ranges"),
        ("robot_from_laser", json!({"x": 0.0, "y": 0.0, "theta": 180.0}), "degrees"),
    ] {
        let problem = make(api, "x", &with(geometry(), field, value)).await.problem(422, "invalid-value");
        assert!(problem["field"].as_str().unwrap().starts_with(&format!("geometry.{field}")), "{problem}");
        assert!(problem["detail"].as_str().unwrap().contains(word), "{problem}");
    }
    make(api, "r", &geometry()).await.ok();
    let mut scans = drive(3, 1);
    let in_millimeters = |reading: &Value| reading.as_f64().map(|range_m| (range_m * 1000.0).round());
    let ranges = scans[2]["ranges_m"].as_array().unwrap().iter().map(in_millimeters).collect::<Vec<_>>();
    scans[2]["ranges_m"] = json!(ranges);
    let problem = api.post_batch("a", "r", 0, &scans).await.problem(422, "invalid-scan");
    assert_eq!(problem["field"], "scans[2].ranges_m");
    assert!(problem["detail"].as_str().unwrap().contains("millimetres"), "{problem}");
    // A code for "no return" is no distance.
    scans[2]["ranges_m"] = json!(vec![65_535; 90]);
    api.post_batch("a", "r", 0, &scans).await.ok();
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_number_of_readings_may_vary_as_far_as_it_was_said() {
    let server = TestServer::start().await;
    let api = &server.api;
    make(api, "varies", &with(geometry(), "num_ranges_min", json!(80))).await.ok();
    make(api, "fixed", &geometry()).await.ok();
    let mut scans = drive(200, 6);
    for (idx, scan) in scans.iter_mut().enumerate() {
        scan["ranges_m"].as_array_mut().unwrap().truncate(90 - idx % 11);
    }
    api.post_all("a", "varies", &scans, 100).await;
    // Again, as a robot that missed the answer would.
    assert_eq!(api.post_batch("a", "varies", 100, &scans[100..]).await.ok()["next_sequence"], 200);
    for scan in &mut scans {
        scan["ranges_m"].as_array_mut().unwrap().resize(90, json!(0));
    }
    api.post_all("a", "fixed", &scans, 100).await;
    assert_eq!(words_of(api, "varies").await, words_of(api, "fixed").await);
    make(api, "short", &with(geometry(), "num_ranges_min", json!(80))).await.ok();
    scans[1]["ranges_m"].as_array_mut().unwrap().truncate(79);
    let problem = api.post_batch("a", "short", 0, &scans).await.problem(422, "invalid-scan");
    assert_eq!(problem["field"], "scans[1].ranges_m");
    assert!(problem["detail"].as_str().unwrap().contains("80 to 90"), "{problem}");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_laser_mounted_upside_down_writes_the_same_text() {
    let server = TestServer::start().await;
    let api = &server.api;
    make(api, "upright", &geometry()).await.ok();
    let turned = with(geometry(), "angle_min_rad", json!(PI / 2.0));
    make(api, "turned", &with(turned, "angle_increment_rad", json!(-PI / 89.0))).await.ok();
    let mut scans = drive(250, 2);
    api.post_all("a", "upright", &scans, 125).await;
    for scan in &mut scans {
        scan["ranges_m"].as_array_mut().unwrap().reverse();
    }
    api.post_all("a", "turned", &scans, 125).await;
    // Turns differ by how sums are rounded.
    let classes_and_sizes = |words: String| -> Vec<String> {
        let line = |line: &str| line.rsplit_once(' ').unwrap().0.to_owned();
        words.lines().map(line).collect()
    };
    let upright = classes_and_sizes(words_of(api, "upright").await);
    assert!(upright.len() > 3);
    assert_eq!(upright, classes_and_sizes(words_of(api, "turned").await));
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_without_odometry_is_driven_by_its_laser() {
    let server = TestServer::start().await;
    let api = &server.api;
    make(api, "r", &geometry()).await.ok();
    let with_odometry = drive(150, 3);
    let mut scans = with_odometry.clone();
    for scan in &mut scans {
        scan.as_object_mut().unwrap().remove("odom_from_robot");
    }
    let mixed = [&scans[..2], &with_odometry[2..3]].concat();
    let problem = api.post_batch("a", "r", 0, &mixed).await.problem(422, "invalid-scan");
    assert_eq!(problem["field"], "scans[2].odom_from_robot");
    api.post_all("a", "r", &scans, 75).await;
    let trajectory = api.get("/v1/sites/a/runs/r/trajectory?frame=run").await.ok();
    let last = &trajectory["poses"][149];
    let place = |pose: &Value, field: &str| pose[field].as_f64().unwrap();
    let truth = |field: &str| {
        place(&with_odometry[149]["odom_from_robot"], field)
            - place(&with_odometry[0]["odom_from_robot"], field)
    };
    let error_m = f64::hypot(place(last, "x") - truth("x"), place(last, "y") - truth("y"));
    assert!(truth("x") > 10.0 && error_m < 0.25, "{error_m} m off after {} m", truth("x"));
    // Who had odometry cannot lose it.
    make(api, "s", &geometry()).await.ok();
    api.post_all("a", "s", &with_odometry[..10], 10).await;
    let problem = api.post_batch("a", "s", 10, &scans[10..12]).await.problem(422, "invalid-scan");
    assert_eq!(problem["field"], "scans[0].odom_from_robot");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_rate_of_a_gyroscope_is_kept() {
    let server = TestServer::start().await;
    let api = &server.api;
    make(api, "r", &geometry()).await.ok();
    let mut scans = drive(3, 3);
    scans[1]["angular_velocity_rad_per_s"] = json!(-0.125);
    api.post_batch("a", "r", 0, &scans).await.ok();
    let stored = api.all("/v1/sites/a/runs/r/scans").await;
    assert_eq!(stored[1]["angular_velocity_rad_per_s"], -0.125);
    assert!(stored[0].get("angular_velocity_rad_per_s").is_none());
    scans[1]["angular_velocity_rad_per_s"] = json!(720.0);
    let problem = api.post_batch("a", "r", 3, &scans).await.problem(422, "invalid-scan");
    assert_eq!(problem["field"], "scans[1].angular_velocity_rad_per_s");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_that_is_carried_has_a_run_in_pieces() {
    let server = TestServer::start().await;
    let api = &server.api;
    make(api, "r", &geometry()).await.ok();
    // It stops in the first corridor, is carried with its laser covered, and drives on in the second.
    let driven = drive(560, 4);
    let mut scans = driven[..160].to_vec();
    let stopped = scans[159].clone();
    for _ in 0..10 {
        let mut blind = stopped.clone();
        blind["ranges_m"].as_array_mut().unwrap().fill(Value::Null);
        scans.push(blind);
    }
    scans.extend_from_slice(&driven[230..]);
    for (idx, scan) in scans.iter_mut().enumerate() {
        scan["timestamp_ns"] = json!(idx as i64 * 100_000_000);
    }
    api.post_all("a", "r", &scans, 125).await;
    let pieces = api.get("/v1/sites/a/runs/r/pieces").await.ok();
    let told = |pieces: &Value| -> Vec<(u64, u64, Value)> {
        let piece = |piece: &Value| {
            (
                piece["from_scan"].as_u64().unwrap(),
                piece["to_scan"].as_u64().unwrap(),
                piece["reason"].clone(),
            )
        };
        pieces["items"].as_array().unwrap().iter().map(piece).collect()
    };
    let [(0, end, first), (start, last, reason)] = &told(&pieces)[..] else { panic!("{pieces}") };
    assert_eq!((end + 1, *last, first), (*start, scans.len() as u64 - 1, &Value::Null));
    assert!((170..176).contains(start), "{pieces}");
    assert!(reason == "jump" || reason == "no_returns", "{pieces}");
    assert!(pieces["items"].as_array().unwrap().iter().all(|piece| piece["component"].is_null()));
    api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    api.post("/v1/sites/a/builds?wait=true", &json!({})).await.ok();
    // Both pieces are in the map, and what is served of the map says of each where it lies.
    let pieces = api.get("/v1/sites/a/runs/r/pieces").await.ok();
    let components: Vec<u64> = (pieces["items"].as_array().unwrap().iter())
        .map(|piece| piece["component"].as_u64().unwrap_or_else(|| panic!("{pieces}")))
        .collect();
    let map = api.get("/v1/sites/a/map").await.ok();
    let of_map: Vec<(u64, u64)> = (map["runs"].as_array().unwrap().iter())
        .map(|run| (run["first_scan"].as_u64().unwrap(), run["component"].as_u64().unwrap()))
        .collect();
    assert_eq!(of_map, [(0, components[0]), (*start, components[1])]);
    let poses = |component: u64| async move {
        let path = format!("/v1/sites/a/runs/r/trajectory?frame=map&component={component}");
        api.get(&path).await.ok()["poses"].as_array().unwrap().len() as u64
    };
    let is_one = components[0] == components[1];
    let expected = if is_one { scans.len() as u64 } else { *start };
    assert_eq!(poses(components[0]).await, expected);
    if !is_one {
        assert_eq!(poses(components[1]).await, scans.len() as u64 - start);
    }
    server.stop().await;
}
