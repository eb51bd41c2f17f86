//! Lists by time and place, in orders; and what happens in a site as it happens.

use std::time::Duration;

use locution_tests::{Api, TestServer, drive, geometry};
use serde_json::{Value, json};

async fn post_run(api: &Api, run: &str, num_scans: usize, seed: u64) {
    api.make_run("a", run).await;
    api.post_all("a", run, &drive(num_scans, seed), 250).await;
    api.post(&format!("/v1/sites/a/runs/{run}/finish"), &json!({})).await.ok();
}

async fn build(api: &Api) {
    let job = api.post("/v1/sites/a/builds?wait=true", &json!({})).await.ok();
    assert_eq!(job["state"], "done", "{job}");
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_driven_is_listed_by_time_and_place() {
    let server = TestServer::start().await;
    let api = &server.api;
    post_run(api, "r", 600, 1).await;
    build(api).await;
    let run = "/v1/sites/a/runs/r";
    let scans = api.all(&format!("{run}/scans")).await;
    let time = |idx: usize| scans[idx]["timestamp_ns"].as_i64().unwrap();

    let (from, to) = (time(100), time(140));
    let in_time = |scan: &&Value| (from..to).contains(&scan["timestamp_ns"].as_i64().unwrap());
    let expected: Vec<Value> = scans.iter().filter(in_time).cloned().collect();
    assert!(expected.len() > 20);
    assert_eq!(api.all(&format!("{run}/scans?from_ns={from}&to_ns={to}")).await, expected);
    // Pages go on where the page before ended, whatever lies between.
    let page = api.get(&format!("{run}/scans?from_ns={from}&to_ns={to}&limit=10")).await.ok();
    let cursor = page["next_cursor"].as_str().unwrap();
    let rest = api.get(&format!("{run}/scans?from_ns={from}&to_ns={to}&cursor={cursor}")).await.ok();
    assert_eq!(
        [page["items"].as_array().unwrap().as_slice(), rest["items"].as_array().unwrap()].concat(),
        expected
    );

    let area = "area=5,0,9,2";
    let is_there =
        |pose: &Value| (5.0..=9.0).contains(&number(&pose["x"])) && (0.0..=2.0).contains(&number(&pose["y"]));
    let expected = scans.iter().filter(|scan| is_there(&scan["odom_from_robot"])).count();
    let found = api.all(&format!("{run}/scans?{area}")).await;
    assert!(expected > 20 && found.len() == expected);
    for frame in ["odom", "run", "map"] {
        let trajectory = api.get(&format!("{run}/trajectory?frame={frame}")).await.ok();
        let expected: Vec<Value> =
            trajectory["poses"].as_array().unwrap().iter().filter(|pose| is_there(pose)).cloned().collect();
        let found = api.get(&format!("{run}/trajectory?frame={frame}&{area}")).await.ok();
        assert_eq!(found["poses"].as_array().unwrap(), &expected, "{frame}");
        let page = api.get(&format!("{run}/trajectory?frame={frame}&{area}&limit=3")).await.ok();
        assert_eq!(
            (page["poses"].as_array().unwrap().len(), &page["next_cursor"]),
            (3, &json!(expected[3]["scan_seq"].to_string()))
        );
        assert_eq!(
            api.all(&format!("{run}/scans?frame={frame}&{area}")).await.len(),
            expected.len(),
            "{frame}"
        );
    }
    let observations = api.all(&format!("{run}/observations")).await;
    let expected: Vec<Value> =
        observations.iter().filter(|sample| is_there(&sample["run_from_robot"])).cloned().collect();
    assert_eq!(api.all(&format!("{run}/observations?{area}")).await, expected);
    assert!(!api.all(&format!("{run}/observations?{area}&frame=map")).await.is_empty());

    let labels = api.all("/v1/sites/a/labels").await;
    let one = &labels[labels.len() / 2];
    let (x, y) = (number(&one["map_from_middle"]["x"]), number(&one["map_from_middle"]["y"]));
    let near = format!("area={},{},{},{}", x - 0.1, y - 0.1, x + 0.1, y + 0.1);
    let label = one["label"].as_str().unwrap();
    let found = api.all(&format!("/v1/sites/a/labels?{near}&label={label}&run=r")).await;
    assert!(found.contains(one) && found.len() < labels.len());
    for (query, field) in [("area=1,2,3", "area"), ("from_ns=5&to_ns=5", "to_ns")] {
        let problem = api.get(&format!("{run}/scans?{query}")).await.problem(422, "invalid-value");
        assert_eq!(problem["field"], field);
    }
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn matches_say_when_and_where_and_are_listed_by_it() {
    let server = TestServer::start().await;
    let api = &server.api;
    post_run(api, "r", 1_700, 1).await;
    build(api).await;
    let all = api.all("/v1/sites/a/matches").await;
    let run = api.get("/v1/sites/a/runs/r/trajectory?frame=map").await.ok();
    let observations = api.all("/v1/sites/a/runs/r/observations").await;
    let poses = run["poses"].as_array().unwrap();
    for found in &all {
        for side in ["earlier", "later"] {
            let side = &found[side];
            let first = &observations[side["first"].as_u64().unwrap() as usize];
            assert_eq!(side["first_timestamp_ns"], first["timestamp_ns"]);
            let middle = (side["first"].as_u64().unwrap() + side["last"].as_u64().unwrap()) / 2;
            let seq = observations[middle as usize]["scan_seq"].as_u64().unwrap() as usize;
            let (there, pose) = (&side["map_from_middle"], &poses[seq]);
            let apart =
                (number(&there["x"]) - number(&pose["x"])).hypot(number(&there["y"]) - number(&pose["y"]));
            assert!(apart < 0.2, "{side} {pose}");
        }
    }
    let by_probability = api.all("/v1/sites/a/matches?sort=probability").await;
    let probabilities: Vec<f64> = by_probability.iter().map(|found| number(&found["probability"])).collect();
    assert!(probabilities.is_sorted_by(|a, b| a >= b) && by_probability.len() == all.len());
    let by_time = api.all("/v1/sites/a/matches?sort=time").await;
    assert!(
        by_time.iter().map(|found| found["later"]["first_timestamp_ns"].as_i64()).is_sorted_by(|a, b| a >= b)
    );
    let page = api.get("/v1/sites/a/matches?sort=probability&limit=3").await.ok();
    assert_eq!(page["items"].as_array().unwrap().as_slice(), &by_probability[..3]);
    let next = page["next_cursor"].as_str().unwrap();
    let page = api.get(&format!("/v1/sites/a/matches?sort=probability&limit=3&cursor={next}")).await.ok();
    assert_eq!(page["items"].as_array().unwrap().as_slice(), &by_probability[3..6]);

    let sure = api.all("/v1/sites/a/matches?probability_min=0.9").await;
    assert_eq!(sure.len(), probabilities.iter().filter(|probability| **probability >= 0.9).count());
    let of_time = all[0]["earlier"]["first_timestamp_ns"].as_i64().unwrap();
    let at_once = api.all(&format!("/v1/sites/a/matches?from_ns={of_time}&to_ns={}", of_time + 1)).await;
    assert!(at_once.contains(&all[0]) && at_once.len() < all.len());
    assert!(api.all("/v1/sites/a/matches?area=100,100,101,101").await.is_empty());
    assert_eq!(api.all("/v1/sites/a/matches?component=0").await.len(), all.len());

    api.put("/v1/sites/a/matches/0/decision", &json!({"decision": "veto"})).await.ok();
    let vetoed = api.all("/v1/sites/a/matches?decision=veto").await;
    assert!(!vetoed.is_empty() && vetoed.iter().all(|found| found["decision"] == "veto"));
    let without = api.all("/v1/sites/a/matches?decision=none").await;
    assert_eq!(vetoed.len() + without.len(), all.len());
    for query in ["decision=maybe", "sort=size"] {
        api.get(&format!("/v1/sites/a/matches?{query}")).await.problem(422, "invalid-value");
    }
    server.stop().await;
}

/// Reads whole events of a stream until one of a kind has come: pairs of id and data.
async fn until(mut response: reqwest::Response, last: &str) -> Vec<(String, Value)> {
    let (mut text, mut events) = (String::new(), Vec::new());
    while let Ok(Some(bytes)) = response.chunk().await {
        text.push_str(std::str::from_utf8(&bytes).unwrap());
        while let Some((event, rest)) = text.split_once("\n\n") {
            let field = |name: &str| {
                event.lines().find_map(|line| line.strip_prefix(name)).map(|value| value.trim().to_owned())
            };
            if let (Some(id), Some(data), Some(kind)) = (field("id:"), field("data:"), field("event:")) {
                let data: Value = serde_json::from_str(&data).unwrap();
                assert_eq!(data["event"], kind);
                events.push((id, data));
            }
            text = rest.to_owned();
        }
        if events.iter().any(|(_, data)| data["event"] == last) {
            return events;
        }
    }
    events
}

async fn watch(api: &Api, last_id: Option<&str>) -> reqwest::Response {
    let mut request = reqwest::Client::new().get(format!("{}/v1/sites/a/events", api.base));
    if let Some(id) = last_id {
        request = request.header("last-event-id", id);
    }
    let response = request.send().await.unwrap();
    assert_eq!(response.headers()["content-type"], "text/event-stream");
    response
}

#[tokio::test(flavor = "multi_thread")]
async fn what_happens_is_told_as_it_happens_and_again_to_whoever_comes_back() {
    let server = TestServer::start_with(|config| config.limits.num_event_streams_max = 2).await;
    let api = &server.api;
    api.put("/v1/sites/a", &json!({})).await.ok();
    let (first, second) = (watch(api, None).await, watch(api, None).await);
    api.get("/v1/sites/a/events").await.problem(429, "busy");
    post_run(api, "r", 200, 1).await;
    build(api).await;
    let events = until(first, "matches").await;
    drop(second);
    let kinds: Vec<&str> = events.iter().map(|(_, data)| data["event"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["run", "words", "run", "job", "job", "version", "matches"]);
    assert_eq!(events[0].1, json!({"event": "run", "run": "r", "change": "made"}));
    assert_eq!(events[1].1["next_sequence"], 200);
    assert_eq!(events[5].1, json!({"event": "version", "version": 1, "num_components": 1}));
    // Places are free again once the server notices that nobody reads.
    let again = loop {
        let request = reqwest::Client::new().get(format!("{}/v1/sites/a/events", api.base));
        let response = request.header("last-event-id", &events[2].0).send().await.unwrap();
        if response.status() == 200 {
            break until(response, "matches").await;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    assert_eq!(again, events[3..]);
    let server = server.restart().await;
    let missed = tokio::spawn({
        let (api, id) = (server.api.clone(), events[6].0.clone());
        async move { until(watch(&api, Some(&id)).await, "missed").await }
    });
    assert_eq!(missed.await.unwrap()[0].1, json!({"event": "missed"}));
    // An open stream holds up no end.
    let open = watch(&server.api, None).await;
    server.stop().await;
    assert!(until(open, "never").await.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn localizations_are_listed_with_their_expiry() {
    let server = TestServer::start().await;
    let api = &server.api;
    post_run(api, "r", 400, 1).await;
    build(api).await;
    assert!(api.all("/v1/sites/a/localisations").await.is_empty());
    let body = json!({"robot": "r1", "geometry": geometry()});
    let opened = api.post("/v1/sites/a/localisations", &body).await.ok();
    assert!(number(&opened["expires_in_s"]) > 890.0);
    let listed = api.all("/v1/sites/a/localisations").await;
    assert_eq!((listed.len(), &listed[0]["id"]), (1, &opened["id"]));
    // Over all sites: the same labels as in the one.
    let query = json!({"labels": [{"label": "corridor"}], "limit": 3});
    let here = api.post("/v1/sites/a/queries/labels", &query).await.ok();
    assert_eq!(api.post("/v1/queries/labels", &query).await.ok(), here);
    assert_eq!(here[0]["site"], "a");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_says_where_it_belongs_and_a_session_looks_only_there() {
    let server = TestServer::start().await;
    let api = &server.api;
    post_run(api, "somewhere", 400, 1).await;
    build(api).await;
    let upstairs = json!({"robot": "r1", "geometry": geometry(), "area": "upstairs"});
    let made = api.put("/v1/sites/a/runs/above", &upstairs).await.ok();
    assert_eq!(made["area"], "upstairs");
    assert_eq!(api.put("/v1/sites/a/runs/above", &upstairs).await.ok()["area"], "upstairs");
    let elsewhere = json!({"robot": "r1", "geometry": geometry(), "area": "downstairs"});
    api.put("/v1/sites/a/runs/above", &elsewhere).await.problem(409, "exists");
    let nowhere = json!({"robot": "r1", "geometry": geometry(), "area": ""});
    assert_eq!(api.put("/v1/sites/a/runs/x", &nowhere).await.problem(422, "invalid-value")["field"], "area");
    let problem = api.post("/v1/sites/a/localisations", &upstairs).await;
    assert_eq!(problem.problem(422, "invalid-value")["field"], "area");
    let anywhere = json!({"robot": "r1", "geometry": geometry()});
    assert_eq!(api.post("/v1/sites/a/localisations", &anywhere).await.ok()["state"], "lost");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_site_can_be_changed_and_a_run_forgotten() {
    let server = TestServer::start().await;
    let api = &server.api;
    for run in ["old", "new"] {
        post_run(api, run, 300, 1).await;
    }
    build(api).await;
    let patch = async |body: Value| {
        let body = serde_json::to_vec(&body).unwrap();
        let headers = [("content-type", "application/json")];
        api.send(reqwest::Method::PATCH, "/v1/sites/a", &headers, body).await.unwrap()
    };
    let problem = patch(json!({"config": {"translator": {"odometry": "raw"}}})).await;
    assert_eq!(problem.problem(422, "invalid-value")["field"], "config.translator");
    patch(json!({"retention": {"num_runs": 0}})).await.problem(422, "invalid-value");
    patch(json!({"config": {"mapping": {"nothing": 1}}})).await.problem(400, "malformed-body");
    assert_eq!(patch(json!({})).await.ok()["job"], Value::Null);
    let changed = patch(json!({"config": {"mapping": {"beside_m": 1.5}}})).await.ok();
    assert_eq!(changed["site"]["config"]["mapping"]["beside_m"], 1.5);
    assert_eq!(changed["job"]["kind"], "build");
    build(api).await;

    // The list of runs, questions, forms of the map: nothing names it any more once the job is done.
    let forgotten = api.delete("/v1/sites/a/runs/old").await;
    assert_eq!(forgotten.status, 202);
    api.get("/v1/sites/a/runs/old").await.problem(404, "not-found");
    assert_eq!(api.all("/v1/sites/a/runs").await.len(), 1);
    build(api).await;
    let map = api.get("/v1/sites/a/map").await.ok();
    assert_eq!(map["versions"].as_array().unwrap().len(), 1, "versions that hold it are gone");
    assert_eq!(map["components"][0]["runs"], json!(["new"]));
    assert_eq!(api.get("/v1/sites/a").await.ok()["num_runs"], 1);
    for path in ["map", "matches", "labels", "places", "map/graph.g2o", "map/trajectory.tum"] {
        let answer = api.get(&format!("/v1/sites/a/{path}")).await;
        assert!(answer.status == 200 && !answer.text().contains("\"old\""), "{path}: {}", answer.text());
    }
    assert_eq!(
        api.get("/v1/sites/a/map/grid").await.status,
        200,
        "the first component is that of a run that is there"
    );
    let query = json!({"words": [{}], "limit": 100});
    let places = api.post("/v1/sites/a/queries/words", &query).await.ok();
    assert!(
        places.as_array().unwrap().iter().all(|place| place["run"] == "new") && places[0]["run"] == "new"
    );

    patch(json!({"retention": {"num_runs": 1, "num_versions": 2}})).await.ok();
    post_run(api, "newest", 300, 2).await;
    build(api).await;
    let runs = api.all("/v1/sites/a/runs").await;
    assert_eq!((runs.len(), &runs[0]["run"]), (1, &json!("newest")));
    let server = server.restart().await;
    let site = server.api.get("/v1/sites/a").await.ok();
    assert_eq!(site["retention"], json!({"num_versions": 2, "num_runs": 1, "num_scans": null}));
    server.stop().await;
}
