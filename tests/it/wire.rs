//! What holds for answers of every kind: where to look next, who answered, how numbers and errors are written.

use locution_tests::{TestServer, drive, geometry};
use reqwest::Method;
use serde_json::json;

#[tokio::test(flavor = "multi_thread")]
async fn what_is_made_or_begun_says_where_it_is() {
    let server = TestServer::start().await;
    let api = &server.api;
    let site = api.put("/v1/sites/a", &json!({})).await;
    assert_eq!(site.headers["location"], "/v1/sites/a");
    assert_eq!(site.ok()["config"], json!(null), "the answer is brief");
    let run = api.put("/v1/sites/a/runs/r", &json!({"geometry": geometry()})).await;
    assert_eq!(
        (run.status.as_u16(), &run.headers["location"]),
        (201, &"/v1/sites/a/runs/r".parse().unwrap())
    );
    let job = api.post("/v1/sites/a/builds", &json!({})).await;
    assert_eq!(job.status, 202);
    let location = job.headers["location"].to_str().unwrap();
    assert_eq!(api.get(location).await.ok()["id"], job.json()["id"]);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_answer_names_the_version_of_the_server_and_so_does_the_document() {
    let server = TestServer::start().await;
    let document = server.api.get("/openapi.json").await;
    let version = document.ok()["info"]["version"].clone();
    for path in ["/openapi.json", "/healthz", "/v1/sites", "/v1/sites/nowhere", "/no/such/path"] {
        let answer = server.api.get(path).await;
        assert_eq!(answer.headers["locution-version"].to_str().unwrap(), version, "{path}");
    }
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nanoseconds_may_travel_as_strings_both_ways() {
    let server = TestServer::start().await;
    let api = &server.api;
    api.make_run("a", "r").await;
    let mut scans = drive(3, 1);
    let exact_ns = 1_763_800_000_000_000_001i64;
    scans[1]["timestamp_ns"] = json!(exact_ns.to_string());
    scans[2]["timestamp_ns"] = json!(exact_ns);
    api.post_batch("a", "r", 0, &scans).await.ok();
    let path = "/v1/sites/a/runs/r/scans";
    assert_eq!(api.get(path).await.ok()["items"][1]["timestamp_ns"], exact_ns);
    let accept = [("accept", "application/json; nanoseconds=string")];
    let strings = api.send(Method::GET, path, &accept, Vec::new()).await.unwrap().ok();
    for scan in &strings["items"].as_array().unwrap()[1..] {
        assert_eq!(scan["timestamp_ns"], exact_ns.to_string());
    }
    assert!(strings["items"][0]["scan_seq"].is_u64());
    scans[0]["timestamp_ns"] = json!("noon");
    let problem = api.post_batch("a", "r", 3, &scans).await.problem(400, "malformed-body");
    assert_eq!(problem["field"], "scans[0].timestamp_ns");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn errors_speak_of_the_request_and_not_of_the_program() {
    let server = TestServer::start().await;
    let api = &server.api;
    api.make_run("a", "r").await;
    let run = "/v1/sites/a/runs/r";
    let wrong_bodies: [(&str, &[u8]); 5] = [
        ("application/json", br#"{"first_sequence": -1, "scans": []}"#),
        ("application/json", br#"{"first_sequence": 0, "scans": {}}"#),
        ("application/json", br#"[1]"#),
        ("application/cbor", b"\xa1\x6efirst_sequence\xf9"),
        ("application/cbor", b"\x01"),
    ];
    let mut problems = Vec::new();
    for (content_type, body) in wrong_bodies {
        let headers = [("content-type", content_type)];
        let answer =
            api.send(Method::POST, &format!("{run}/batches"), &headers, body.to_vec()).await.unwrap();
        problems.push(answer.problem(400, "malformed-body"));
    }
    for query in ["limit=x", "limit=-1", "level=900", "level=a", "never=1"] {
        problems.push(api.get(&format!("{run}/words?{query}")).await.problem(400, "malformed-query"));
    }
    for problem in &problems {
        let detail = problem["detail"].as_str().unwrap();
        for word in
            ["u8", "u64", "usize", "struct", "Dto", "Semantic", "None", "Failed to", "variant", "Error"]
        {
            assert!(!detail.contains(word), "{detail}");
        }
    }
    assert_eq!(problems[5]["field"], "limit");
    assert_eq!(
        (&problems[0]["title"], &problems[5]["title"]),
        (&json!("Malformed body"), &json!("Malformed query"))
    );
    assert_eq!(api.get("/v1/sites/b").await.problem(404, "not-found")["title"], "Not found");
    server.stop().await;
}
