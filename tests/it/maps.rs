//! Builds, versions, matches, decisions, forms, labels, localisation.

use locution_tests::{Api, TestServer, drive, geometry};
use serde_json::{Value, json};

/// A server with a built map of one run that goes round the ring more than once.
async fn server_with_map(num_scans: usize) -> TestServer {
    let server = TestServer::start().await;
    post_run(&server.api, "r", num_scans, 1).await;
    build(&server.api).await;
    server
}

async fn post_run(api: &Api, run: &str, num_scans: usize, seed: u64) {
    api.make_run("a", run).await;
    api.post_all("a", run, &drive(num_scans, seed), 200).await;
    api.post(&format!("/v1/sites/a/runs/{run}/finish"), &json!({})).await.ok();
}

async fn build(api: &Api) -> Value {
    let job = api.post("/v1/sites/a/builds?wait=true", &json!({})).await.ok();
    assert_eq!(job["state"], "done", "{job}");
    job
}

#[tokio::test(flavor = "multi_thread")]
async fn before_the_first_build_the_map_says_so() {
    let server = TestServer::start().await;
    server.api.make_run("a", "r").await;
    for path in ["map", "map/grid.png", "matches", "labels", "runs/r/trajectory?frame=map"] {
        server.api.get(&format!("/v1/sites/a/{path}")).await.problem(409, "not-ready");
    }
    // A site without scans has an empty map, not an error.
    let job = build(&server.api).await;
    assert_eq!(server.api.get(&format!("/v1/sites/a/jobs/{}", job["id"].as_str().unwrap())).await.ok(), job);
    assert_eq!(server.api.get("/v1/sites/a/map").await.ok()["version"], 1);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_is_served_in_every_form_under_its_version() {
    let server = server_with_map(900).await;
    let api = &server.api;
    let map = api.get("/v1/sites/a/map").await;
    let body = map.ok();
    assert_eq!((&body["version"], &body["versions"]), (&json!(1), &json!([1])));
    assert_eq!(body["components"], json!([{"component": 0, "runs": ["r"]}]));
    assert!(body["runs"][0]["poses"].as_array().unwrap().len() > 50);
    assert!(!body["regions"].as_array().unwrap().is_empty());
    let tag = map.headers["etag"].to_str().unwrap().to_owned();
    assert!(tag.starts_with("\"1-"), "{tag}");
    let listed = format!("\"0\", W/{tag}");
    let known = [("if-none-match", listed.as_str())];
    let again = api.send(reqwest::Method::GET, "/v1/sites/a/map", &known, vec![]).await.unwrap();
    assert_eq!(again.status, 304);
    let forms: [(&str, &[u8]); 8] = [
        ("map.mcap", b"\x89MCAP0\r\n"),
        ("grid.png", b"\x89PNG"),
        ("grid.pgm", b"P5\n"),
        ("grid.yaml", b"image: grid.pgm\n"),
        ("graph.g2o", b"# A vertex per "),
        ("trajectory.tum", b"1."),
        ("picture.png", b"\x89PNG"),
        ("picture.svg", b"<svg "),
    ];
    for (form, beginning) in forms {
        let answer = api.get(&format!("/v1/sites/a/map/{form}")).await;
        assert_eq!(answer.status, 200, "{form}: {}", answer.text());
        assert!(answer.bytes.starts_with(beginning), "{form}");
        assert_eq!(answer.headers["etag"], tag);
    }
    let grid = api.get("/v1/sites/a/map/grid").await.ok();
    let num_cells = grid["info"]["width"].as_u64().unwrap() * grid["info"]["height"].as_u64().unwrap();
    assert_eq!(grid["data"].as_array().unwrap().len() as u64, num_cells);
    assert_eq!(grid["header"]["frame_id"], "map");
    let corner = &grid["info"]["origin"];
    assert_eq!((&corner["orientation"]["w"], &corner["position"]["z"]), (&json!(1.0), &json!(0.0)));
    let (x, y) = (corner["position"]["x"].as_f64().unwrap(), corner["position"]["y"].as_f64().unwrap());
    let area = format!("{},{},{},{}", x + 1.01, y + 0.51, x + 2.49, y + 0.99);
    let window = api.get(&format!("/v1/sites/a/map/grid?area={area}")).await.ok();
    assert_eq!((&window["info"]["width"], &window["info"]["height"]), (&json!(30), &json!(10)));
    let width = grid["info"]["width"].as_u64().unwrap() as usize;
    assert_eq!(window["data"][0], grid["data"][10 * width + 20]);
    api.get("/v1/sites/a/map/grid.png?area=900,900,901,901").await.problem(422, "invalid-value");
    let named = api.get("/v1/sites/a/map/grid.yaml?component=0").await;
    assert!(named.text().starts_with("image: grid-0.pgm\n"), "{}", named.text());
    let picture = api.get("/v1/sites/a/map/grid.pgm?component=0").await;
    assert_eq!(picture.headers["content-disposition"], "inline; filename=\"grid-0.pgm\"");
    api.get("/v1/sites/a/map/grid?component=7").await.problem(404, "not-found");
    api.get("/v1/sites/a/map?version=2").await.problem(404, "not-found");
    let trajectory = api.get("/v1/sites/a/runs/r/trajectory?frame=map").await.ok();
    assert_eq!(trajectory["component"], 0);
    assert_eq!(trajectory["poses"].as_array().unwrap().len(), 900);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn versions_are_kept_in_bounds_and_survive_a_restart() {
    let server = TestServer::start_with(|config| config.builds.num_versions_kept = 2).await;
    // A run that never sent anything is no obstacle.
    server.api.make_run("a", "silent").await;
    for version in 1..=3 {
        post_run(&server.api, &format!("r{version}"), 150, version).await;
        build(&server.api).await;
        assert_eq!(server.api.get("/v1/sites/a").await.ok()["map_version"], version);
    }
    let server = server.restart().await;
    let api = &server.api;
    assert_eq!(api.get("/v1/sites/a/map").await.ok()["versions"], json!([2, 3]));
    let num_runs = async |version: u64| {
        let map = api.get(&format!("/v1/sites/a/map?version={version}")).await.ok();
        map["runs"].as_array().unwrap().len()
    };
    assert_eq!((num_runs(2).await, num_runs(3).await), (2, 3));
    api.get("/v1/sites/a/map?version=1").await.problem(404, "not-found");
    assert_eq!(api.all("/v1/sites/a/jobs").await.len(), 3);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn finishing_a_run_builds_by_itself() {
    let server = TestServer::start_with(|config| {
        config.builds.is_automatic = true;
        config.builds.settle_s = 0.05;
    })
    .await;
    post_run(&server.api, "r", 200, 1).await;
    for _ in 0..600 {
        if server.api.get("/v1/sites/a").await.ok()["map_version"] == 1 {
            return server.stop().await;
        }
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
    panic!("no map came");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_interrupted_build_is_done_after_the_restart() {
    let server = TestServer::start().await;
    post_run(&server.api, "r", 600, 1).await;
    let job = server.api.post("/v1/sites/a/builds", &json!({})).await;
    assert_eq!(job.status, 202);
    let id = job.ok()["id"].as_str().unwrap().to_owned();
    let server = server.restart().await;
    for _ in 0..600 {
        let answer = server.api.get(&format!("/v1/sites/a/jobs/{id}")).await;
        if answer.status == 503 {
            // Both servers live in this process: the build of the first holds the storage until it notices the stop.
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
            continue;
        }
        let job = answer.ok();
        assert_ne!(job["state"], "failed", "{job}");
        if job["state"] == "done" {
            assert_eq!(server.api.get("/v1/sites/a").await.ok()["map_version"], 1);
            return server.stop().await;
        }
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
    panic!("the job was forgotten");
}

#[tokio::test(flavor = "multi_thread")]
async fn matches_are_objects_and_decisions_stick() {
    let server = server_with_map(1700).await;
    let api = &server.api;
    let by_state = api.all("/v1/sites/a/matches?state=verified").await;
    assert!(by_state.iter().all(|found| found["state"] == "verified"));
    api.get("/v1/sites/a/matches?state=sure").await.problem(422, "invalid-value");
    api.get("/v1/sites/a/matches/99999999").await.problem(404, "not-found");
    api.get("/v1/sites/a/matches?run=nobody").await.problem(404, "not-found");
    let found = by_state.first().expect("the ring is driven round more than once");
    let path = format!("/v1/sites/a/matches/{}", found["id"].as_str().unwrap());
    assert_eq!(api.get(&path).await.ok(), *found);
    let vetoed = api.put(&format!("{path}/decision"), &json!({"decision": "veto"})).await.ok();
    assert_eq!(vetoed["decision"], "veto");
    api.put(&format!("{path}/decision"), &json!({"decision": "perhaps"}))
        .await
        .problem(400, "malformed-body");
    build(api).await;
    let overlaps = |a: &Value, b: &Value| {
        a["run"] == b["run"]
            && a["first"].as_u64() <= b["last"].as_u64()
            && b["first"].as_u64() <= a["last"].as_u64()
    };
    let mut num_same = 0;
    for again in api.all("/v1/sites/a/matches").await {
        let is_same = overlaps(&again["earlier"], &found["earlier"])
            && overlaps(&again["later"], &found["later"])
            && again["direction"] == found["direction"];
        if is_same {
            num_same += 1;
            assert_eq!((&again["decision"], &again["reason"]), (&json!("veto"), &json!("vetoed")), "{again}");
        }
    }
    assert!(num_same > 0, "a vetoed pair stays listed");
    let server = server.restart().await;
    let api = &server.api;
    let decided = api.all("/v1/sites/a/matches").await.into_iter().find(|found| found["decision"] == "veto");
    let decided = decided.expect("a veto outlives a restart");
    let path = format!("/v1/sites/a/matches/{}/decision", decided["id"].as_str().unwrap());
    assert_eq!(api.delete(&path).await.status, 204);
    assert!(api.all("/v1/sites/a/matches").await.iter().all(|found| found["decision"] == Value::Null));
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn labels_are_listed_and_asked_for() {
    let server = server_with_map(900).await;
    let api = &server.api;
    let labels = api.all("/v1/sites/a/labels").await;
    assert!(!labels.is_empty());
    let known = ["bifurcation", "corner", "corridor", "dead-end", "hall"];
    assert!(labels.iter().all(|label| known.contains(&label["label"].as_str().unwrap())));
    let question = json!({"labels": [{"label": labels[0]["label"]}]});
    let answers = api.post("/v1/sites/a/queries/labels", &question).await.ok();
    assert!(!answers.as_array().unwrap().is_empty());
    assert!(!api.all("/v1/sites/a/places").await.is_empty());
    let map = api.get("/v1/sites/a/map").await.ok();
    let poses = map["runs"][0]["poses"].as_array().unwrap();
    let (from, to) = (&poses[0], &poses[poses.len() / 3]);
    let ends = format!("from_x={}&from_y={}&to_x={}&to_y={}", from["x"], from["y"], to["x"], to["y"]);
    let route = api.get(&format!("/v1/sites/a/route?{ends}")).await.ok();
    assert!(route["length_m"].as_f64().unwrap() > 5.0, "{route}");
    assert!(!route["description"].as_str().unwrap().is_empty());
    api.get("/v1/sites/a/route?from_x=999&from_y=0&to_x=0&to_y=0").await.problem(404, "not-found");
    let unknown = json!({"labels": [{"label": "cellar"}]});
    let problem = api.post("/v1/sites/a/queries/labels", &unknown).await.problem(422, "invalid-value");
    assert_eq!(problem["field"], "labels[0].label");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn words_of_a_text_are_found_in_it() {
    let server = server_with_map(900).await;
    let api = &server.api;
    let words = api.all("/v1/sites/a/runs/r/words").await;
    let three: Vec<Value> = words[2..5]
        .iter()
        .map(|word| json!({"class": word["class"], "size": word["size"], "turn_rad": word["turn_rad"]}))
        .collect();
    let answers = api.post("/v1/sites/a/queries/words", &json!({"words": three})).await.ok();
    assert_eq!(answers[0]["words"], json!([2, 4]));
    assert_eq!((&answers[0]["run"], &answers[0]["component"]), (&json!("r"), &json!(0)));
    assert!(answers[0]["map_from_middle"]["x"].is_number());
    let wrong = json!({"words": [{"size_tolerance": 2.0}]});
    let problem = api.post("/v1/sites/a/queries/words", &wrong).await.problem(422, "invalid-value");
    assert_eq!(problem["field"], "words[0].size_tolerance");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_is_looked_for_and_nothing_is_stored() {
    let server = server_with_map(900).await;
    let api = &server.api;
    let before = api.get("/v1/sites/a").await.ok();
    let opened = api.post("/v1/sites/a/localisations", &json!({"robot": "x", "geometry": geometry()})).await;
    assert_eq!(opened.status, 201);
    let path = format!("/v1/sites/a/localisations/{}", opened.ok()["id"].as_str().unwrap());
    let mut far_off = geometry();
    far_off["robot_from_laser"]["x"] = json!(40.0);
    let problem = api.post("/v1/sites/a/localisations", &json!({"robot": "x", "geometry": far_off})).await;
    assert_eq!(problem.problem(422, "invalid-value")["field"], "geometry.robot_from_laser");
    let scans = drive(700, 9);
    let mut latest = Value::Null;
    for first in (300..600).step_by(100) {
        let body = json!({"first_sequence": first - 300, "scans": scans[first..first + 100]});
        latest = api.post(&format!("{path}/batches"), &body).await.ok();
    }
    assert_eq!(latest["next_sequence"], 300);
    assert!(latest["travel_m"].as_f64().unwrap() > 5.0);
    let mut again = api.get(&path).await.ok();
    // The time until it expires runs on.
    again["expires_in_s"] = latest["expires_in_s"].clone();
    assert_eq!(again, latest);
    let gap = json!({"first_sequence": 301, "scans": []});
    assert_eq!(
        api.post(&format!("{path}/batches"), &gap).await.problem(409, "sequence")["expected_sequence"],
        300
    );
    // The run drove the same way, so at its scan 599 it stood where the last scan was taken.
    assert_eq!(latest["state"], "converged", "{latest}");
    let trajectory = api.get("/v1/sites/a/runs/r/trajectory?frame=map").await.ok();
    let poses = trajectory["poses"].as_array().unwrap();
    let there = poses.iter().find(|pose| pose["scan_seq"] == 599).unwrap();
    let found = &latest["hypotheses"][0]["map_from_robot"];
    let apart = |axis: &str| found[axis].as_f64().unwrap() - there[axis].as_f64().unwrap();
    assert!(apart("x").hypot(apart("y")) < 0.5, "{found} is not {there}");
    assert_eq!(api.delete(&path).await.status, 204);
    api.get(&path).await.problem(404, "not-found");
    let example = json!({"geometry": geometry(), "scans": scans[100..300]});
    let answer = api.post("/v1/sites/a/queries/example", &example).await.ok();
    assert_eq!(answer["site"], "a");
    let everywhere = api.post("/v1/queries/example", &example).await.ok();
    assert_eq!(everywhere[0]["places"], answer["places"]);
    let after = api.get("/v1/sites/a").await.ok();
    assert_eq!((&after["num_scans"], &after["num_runs"]), (&before["num_scans"], &before["num_runs"]));
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_grown_site_gets_new_texts_all_at_once() {
    let server = TestServer::start().await;
    let api = &server.api;
    let config = json!({"config": {"translator": {"quantizer": {"mean_shift": {
        "num_initial_classes": 8, "bandwidth": 0.03, "min_share": 0.01, "max_moved_share": 0.1}}}}});
    api.put("/v1/sites/a", &config).await.ok();
    for run in ["first", "second"] {
        let made = json!({"geometry": geometry()});
        api.put(&format!("/v1/sites/a/runs/{run}"), &made).await.ok();
        api.post_all("a", run, &drive(800, 3), 200).await;
    }
    api.post("/v1/sites/a/runs/first/finish", &json!({})).await.ok();
    let words_before = api.get_text("/v1/sites/a/runs/first/words").await;
    build(api).await;
    let site = api.get("/v1/sites/a").await.ok();
    assert_eq!(site["generation"], 1);
    assert_ne!(api.get_text("/v1/sites/a/runs/first/words").await, words_before);
    // The open run goes on in the new text, and both end the same.
    let rest = &drive(1000, 3)[800..];
    assert_eq!(api.post_batch("a", "second", 800, rest).await.ok()["next_sequence"], 1000);
    api.post("/v1/sites/a/runs/second/finish", &json!({})).await.ok();
    let server = server.restart().await;
    let api = &server.api;
    let [first, second] = ["first", "second"].map(|run| format!("/v1/sites/a/runs/{run}/words"));
    let (first, second) = (api.get_text(&first).await, api.get_text(&second).await);
    // The shorter run ends with words that knew less of what came; all before are the same.
    let num_common = first.lines().count().saturating_sub(3);
    assert!(!first.is_empty() && second.lines().count() > num_common);
    assert!(first.lines().take(num_common).eq(second.lines().take(num_common)), "{first}\n{second}");
    server.stop().await;
}
