//! Bodies and keys that are nearly right: every one is taken or refused with a short problem, and the server goes on.

use std::sync::LazyLock;

use bolero::check;
use locution_fuzz::{Edit, TEST_TIME, edited};
use locution_tests::{Answer, Api, TestServer, drive, geometry};
use reqwest::Method;
use serde_json::{Value, json};
use tokio::runtime::Runtime;

/// A request whose body is changed.
struct Request {
    method: Method,
    path: &'static str,
    seed: &'static str,
}

/// Everything that takes a body of JSON or CBOR.
fn requests() -> [Request; 10] {
    let of = |method, path, seed| Request { method, path, seed };
    [
        of(Method::PUT, "/v1/sites/made", include_str!("../seeds/json/site.json")),
        of(Method::PATCH, "/v1/sites/changed", include_str!("../seeds/json/site_change.json")),
        of(Method::PUT, "/v1/sites/office/runs/made", include_str!("../seeds/json/run.json")),
        of(Method::POST, "/v1/sites/office/runs/open/batches", include_str!("../seeds/json/batch.json")),
        of(Method::POST, "/v1/sites/office/localisations", include_str!("../seeds/json/localization.json")),
        of(Method::POST, "/v1/sites/office/queries/example", include_str!("../seeds/json/example.json")),
        of(Method::POST, "/v1/sites/office/queries/words", include_str!("../seeds/json/words.json")),
        of(Method::POST, "/v1/sites/office/queries/labels", include_str!("../seeds/json/labels.json")),
        of(Method::POST, "/v1/sites/office/annotations", include_str!("../seeds/json/annotation.json")),
        of(Method::POST, "/v1/keys", include_str!("../seeds/json/key.json")),
    ]
}

/// A server with a map, and who may do anything there.
struct Filled {
    runtime: Runtime,
    api: Api,
    _server: TestServer,
}

/// One for all targets of the process.
static FILLED: LazyLock<Filled> = LazyLock::new(Filled::new);

impl Filled {
    fn new() -> Self {
        let runtime = Runtime::new().expect("a runtime starts");
        let (server, api) = runtime.block_on(async {
            let server = TestServer::start().await;
            let key = json!({"name": "fuzz", "scope": "admin", "sites": ["*"]});
            let key = server.api.post("/v1/keys", &key).await.ok();
            let api = server.api.with_key(key["secret"].as_str().expect("a new key has a secret"));
            api.put("/v1/sites/changed", &json!({})).await.ok();
            api.put("/v1/sites/office", &json!({})).await.ok();
            let run = json!({"geometry": geometry(), "area": "floor-2"});
            api.put("/v1/sites/office/runs/drive", &run).await.ok();
            api.post_all("office", "drive", &drive(400, 3), 100).await;
            api.post("/v1/sites/office/runs/drive/finish", &json!({})).await.ok();
            api.post("/v1/sites/office/builds?wait=true", &json!({})).await.ok();
            let geometry = json!({"num_ranges": 3, "angle_min_rad": -0.5, "angle_increment_rad": 0.5, "range_max_m": 20});
            api.put("/v1/sites/office/runs/open", &json!({"geometry": geometry})).await.ok();
            (server, api)
        });
        Self { runtime, api, _server: server }
    }
}

/// What holds for every answer.
fn is_an_answer(answer: &Answer) {
    let status = answer.status.as_u16();
    assert!(status < 500 || status == 503, "{status}: {}", answer.text());
    if status >= 400 {
        let content_type = answer.headers.get("content-type").map(|value| value.as_bytes());
        assert_eq!(content_type, Some(&b"application/problem+json"[..]), "{status}: {}", answer.text());
        assert!(answer.bytes.len() < 4_096, "an echo of {} bytes", answer.bytes.len());
    }
}

fn send(request: &Request, content_type: &str, body: Vec<u8>) {
    let headers = [("content-type", content_type)];
    let sent = FILLED.api.send(request.method.clone(), request.path, &headers, body);
    is_an_answer(&FILLED.runtime.block_on(sent).expect("an answer"));
    let health = FILLED.runtime.block_on(FILLED.api.get("/healthz"));
    assert_eq!(health.status, 200);
}

#[test]
fn json() {
    let requests = requests();
    check!().with_type::<(u8, Vec<Edit>)>().with_test_time(TEST_TIME).for_each(|(which, edits)| {
        let request = &requests[usize::from(*which) % requests.len()];
        send(request, "application/json", edited(request.seed.as_bytes(), edits));
    });
}

#[test]
fn cbor() {
    let requests = requests().map(|request| {
        let value: Value = serde_json::from_str(request.seed).expect("seeds are JSON");
        let mut bytes = Vec::new();
        ciborium::into_writer(&value, &mut bytes).expect("what is JSON can be CBOR");
        (request, bytes)
    });
    check!().with_type::<(u8, Vec<Edit>)>().with_test_time(TEST_TIME).for_each(|(which, edits)| {
        let (request, seed) = &requests[usize::from(*which) % requests.len()];
        send(request, "application/cbor", edited(seed, edits));
    });
}

/// The seeds themselves are taken, so that what is changed is nearly right.
#[test]
fn seeds_are_taken() {
    let filled = Filled::new();
    for request in requests() {
        let headers = [("content-type", "application/json")];
        let sent = filled.api.send(request.method.clone(), request.path, &headers, request.seed.into());
        let answer = filled.runtime.block_on(sent).expect("an answer");
        assert!(answer.status.is_success(), "{}: {}", request.path, answer.text());
    }
}

#[test]
fn keys_and_queries() {
    check!().with_type::<(Vec<Edit>, Vec<Edit>)>().with_test_time(TEST_TIME).for_each(|(key, query)| {
        // Heads that are too long are refused by the listener itself.
        let short = |mut text: Vec<u8>| {
            text.truncate(1_000);
            text
        };
        let key = short(edited(b"Bearer loc_0123456789abcdef", key));
        let query = short(edited(b"limit=20&cursor=3&from_ns=5&area=0,0,12.5,8&version=1", query));
        let Ok(key) = std::str::from_utf8(&key) else { return };
        let Ok(query) = std::str::from_utf8(&query) else { return };
        for (headers, path) in [
            (vec![("authorization", key)], "/v1/sites".to_owned()),
            (vec![], format!("/v1/sites/office/labels?{query}")),
        ] {
            let sender =
                if headers.is_empty() { FILLED.api.clone() } else { Api::new(FILLED.api.base.clone()) };
            // What no header or address can hold is refused before it is sent.
            if let Ok(answer) = FILLED.runtime.block_on(sender.send(Method::GET, &path, &headers, vec![])) {
                is_an_answer(&answer);
            }
        }
    });
}
