//! Keys, scopes, sites and overload.

use locution_server::config::{ApiKeyConfig, Scope, ServerConfig};
use locution_server::start_server;
use locution_tests::{TestServer, drive, geometry};
use reqwest::Method;
use serde_json::json;

/// SHA-256 of `reader`, `writer` and `admin`.
const HASHES: [(&str, Scope, &str, &str); 3] = [
    ("reader", Scope::Read, "*", "3d0941964aa3ebdcb00ccef58b1bb399f9f898465e9886d5aec7f31090a0fb30"),
    ("writer", Scope::Write, "a", "b93006774cbdd4b299389a03ac3d88c3a76b460d538795bc12718011a909fba5"),
    ("admin", Scope::Admin, "*", "8c6976e5b5410415bde908bd4dee15dfb167a9c873fc4bb8a81f6f2ab448a918"),
];

fn keys() -> Vec<ApiKeyConfig> {
    let key = |(name, scope, site, sha256): &(&str, Scope, &str, &str)| ApiKeyConfig {
        name: (*name).into(),
        sha256: (*sha256).into(),
        scope: *scope,
        sites: vec![(*site).into()],
        ..ApiKeyConfig::default()
    };
    HASHES.iter().map(key).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_open_what_they_should_and_nothing_else() {
    let server = TestServer::start_with(|config| config.keys = keys()).await;
    let nobody = server.api.clone();
    let [reader, writer, admin] = ["reader", "writer", "admin"].map(|key| server.api.with_key(key));
    nobody.get("/v1/sites").await.problem(401, "unauthorized");
    nobody.get("/metrics").await.problem(401, "unauthorized");
    nobody.with_key("guess").get("/v1/sites").await.problem(401, "unauthorized");
    assert_eq!(nobody.get("/healthz").await.status, 200);
    writer.put("/v1/sites/a", &json!({})).await.problem(403, "forbidden");
    admin.put("/v1/sites/a", &json!({})).await.ok();
    admin.put("/v1/sites/b", &json!({})).await.ok();
    writer.put("/v1/sites/a/runs/r", &json!({"geometry": geometry()})).await.ok();
    writer.post_batch("a", "r", 0, &drive(3, 1)).await.ok();
    writer.put("/v1/sites/b/runs/r", &json!({"geometry": geometry()})).await.problem(403, "forbidden");
    writer.get("/v1/sites/b").await.problem(403, "forbidden");
    reader.post_batch("a", "r", 3, &drive(3, 1)).await.problem(403, "forbidden");
    reader.get("/v1/sites/a/runs/r").await.ok();
    reader.delete("/v1/sites/a").await.problem(403, "forbidden");
    assert_eq!(reader.all("/v1/sites").await.len(), 2);
    assert_eq!(writer.all("/v1/sites").await.len(), 1);
    server.stop().await;
}

/// What the API must ask for, route by route; `None` is for everybody. Written here once more by hand, so that a new
/// route is thought about.
const ROUTES: &[(&str, &str, Option<Scope>)] = &[
    ("GET", "/healthz", None),
    ("GET", "/readyz", None),
    ("GET", "/metrics", Some(Scope::Read)),
    ("GET", "/ui", None),
    ("GET", "/v1/keys", Some(Scope::Admin)),
    ("POST", "/v1/keys", Some(Scope::Admin)),
    ("POST", "/v1/keys/{key}/rotate", Some(Scope::Admin)),
    ("DELETE", "/v1/keys/{key}", Some(Scope::Admin)),
    ("GET", "/v1/sites", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}", Some(Scope::Read)),
    // Before there is a site: a stream of events has no end.
    ("GET", "/v1/sites/{site}/events", Some(Scope::Read)),
    ("PATCH", "/v1/sites/{site}", Some(Scope::Admin)),
    ("PUT", "/v1/sites/{site}", Some(Scope::Admin)),
    ("DELETE", "/v1/sites/{site}", Some(Scope::Admin)),
    ("GET", "/v1/sites/{site}/backup", Some(Scope::Admin)),
    ("PUT", "/v1/sites/{site}/backup", Some(Scope::Admin)),
    ("GET", "/v1/sites/{site}/runs", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/runs/{run}", Some(Scope::Read)),
    ("PUT", "/v1/sites/{site}/runs/{run}", Some(Scope::Write)),
    ("DELETE", "/v1/sites/{site}/runs/{run}", Some(Scope::Write)),
    ("POST", "/v1/sites/{site}/runs/{run}/finish", Some(Scope::Write)),
    ("POST", "/v1/sites/{site}/runs/{run}/batches", Some(Scope::Write)),
    ("GET", "/v1/sites/{site}/runs/{run}/pieces", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/runs/{run}/scans", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/runs/{run}/observations", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/runs/{run}/words", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/runs/{run}/trajectory", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/runs/{run}/trajectory.tum", Some(Scope::Read)),
    ("POST", "/v1/sites/{site}/builds", Some(Scope::Write)),
    ("GET", "/v1/sites/{site}/jobs", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/jobs/{id}", Some(Scope::Read)),
    ("DELETE", "/v1/sites/{site}/jobs/{id}", Some(Scope::Write)),
    ("GET", "/v1/sites/{site}/matches", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/matches/{id}", Some(Scope::Read)),
    ("PUT", "/v1/sites/{site}/matches/{id}/decision", Some(Scope::Write)),
    ("DELETE", "/v1/sites/{site}/matches/{id}/decision", Some(Scope::Write)),
    ("GET", "/v1/sites/{site}/map", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/grid", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/grid.pgm", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/grid.png", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/grid.yaml", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/graph.g2o", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/trajectory.tum", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/picture.png", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/picture.svg", Some(Scope::Read)),
    ("POST", "/v1/sites/{site}/localisations", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/localisations", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/localisations/{id}", Some(Scope::Read)),
    ("DELETE", "/v1/sites/{site}/localisations/{id}", Some(Scope::Read)),
    ("POST", "/v1/sites/{site}/localisations/{id}/batches", Some(Scope::Read)),
    ("POST", "/v1/sites/{site}/queries/example", Some(Scope::Read)),
    ("POST", "/v1/sites/{site}/queries/words", Some(Scope::Read)),
    ("POST", "/v1/queries/words", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/labels", Some(Scope::Read)),
    ("POST", "/v1/sites/{site}/queries/labels", Some(Scope::Read)),
    ("POST", "/v1/queries/labels", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/places", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/route", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/rooms", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/map/rooms.geojson", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/annotations", Some(Scope::Read)),
    ("POST", "/v1/sites/{site}/annotations", Some(Scope::Write)),
    ("GET", "/v1/sites/{site}/annotations/{id}", Some(Scope::Read)),
    ("PUT", "/v1/sites/{site}/annotations/{id}", Some(Scope::Write)),
    ("DELETE", "/v1/sites/{site}/annotations/{id}", Some(Scope::Write)),
    ("GET", "/v1/sites/{site}/channels", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/channels/{channel}", Some(Scope::Read)),
    ("PUT", "/v1/sites/{site}/channels/{channel}", Some(Scope::Admin)),
    ("DELETE", "/v1/sites/{site}/channels/{channel}", Some(Scope::Admin)),
    ("POST", "/v1/sites/{site}/channels/{channel}/rollback", Some(Scope::Admin)),
    ("GET", "/v1/sites/{site}/channels/{channel}/robots", Some(Scope::Read)),
    ("PUT", "/v1/sites/{site}/channels/{channel}/robots/{robot}", Some(Scope::Write)),
    ("GET", "/v1/sites/{site}/map/map.mcap", Some(Scope::Read)),
    ("GET", "/v1/sites/{site}/changes", Some(Scope::Read)),
    ("POST", "/v1/queries/example", Some(Scope::Read)),
];

#[tokio::test(flavor = "multi_thread")]
async fn every_route_asks_every_key_for_what_it_needs() {
    let document = serde_json::from_str::<serde_json::Value>(locution_server::document_json()).unwrap();
    let mut undecided = Vec::new();
    for (path, operations) in document["paths"].as_object().unwrap() {
        for method in operations.as_object().unwrap().keys().map(|method| method.to_uppercase()) {
            if !ROUTES.iter().any(|row| row.0 == method && row.1 == path) {
                undecided.push(format!("{method} {path}"));
            }
        }
    }
    assert!(undecided.is_empty(), "routes without a row: {undecided:#?}");
    let server = TestServer::start_with(|config| config.keys = keys()).await;
    // Names that are words of other routes must not matter.
    for (site, run) in [("a", "r"), ("queries", "localisations"), ("localisations", "queries")] {
        for (method, route, needed) in ROUTES {
            let path = route
                .replace("{site}", site)
                .replace("{run}", run)
                .replace("{id}", "1")
                .replace("{key}", "k")
                .replace("{channel}", "c")
                .replace("{robot}", "r7");
            let shown = &document["paths"][route][method.to_lowercase()]["security"];
            let shown_scope = shown.as_array().unwrap().iter().find_map(|row| row["key"][0].as_str());
            assert_eq!(shown_scope, needed.map(Scope::as_str), "{method} {path}");
            for (name, scope, sites, _) in HASHES {
                let is_covered = sites == "*" || !path.starts_with("/v1/sites/") || site == sites;
                let is_allowed = needed.is_none_or(|needed| scope >= needed && is_covered);
                check(&server, method, &path, Some(name), if is_allowed { None } else { Some(403) }).await;
            }
            let refused = needed.map(|_| 401);
            check(&server, method, &path, None, refused).await;
            check(&server, method, &path, Some("unknown"), refused).await;
        }
    }
    server.stop().await;
}

async fn check(server: &TestServer, method: &str, path: &str, key: Option<&str>, refused: Option<u16>) {
    let api = key.map_or(server.api.clone(), |key| server.api.with_key(key));
    let headers = [("content-type", "application/json")];
    let method = Method::from_bytes(method.as_bytes()).unwrap();
    let answer = api.send(method.clone(), path, &headers, b"{}".to_vec()).await.unwrap();
    let status = answer.status.as_u16();
    match refused {
        Some(refused) => {
            assert_eq!(status, refused, "{method} {path} with {key:?}");
            assert_eq!(answer.headers.contains_key("www-authenticate"), refused == 401);
        }
        None => assert!(![401, 403].contains(&status), "{method} {path} with {key:?}: {status}"),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_word_bearer_may_be_spelled_in_any_case() {
    let server = TestServer::start_with(|config| config.keys = keys()).await;
    for (authorization, status) in [("bearer reader", 200), ("BEARER reader", 200), ("Basic reader", 401)] {
        let headers = [("authorization", authorization)];
        let answer = server.api.send(Method::GET, "/v1/sites", &headers, Vec::new()).await.unwrap();
        assert_eq!(answer.status, status);
    }
    let refused = server.api.get("/v1/sites").await;
    assert_eq!(refused.headers["www-authenticate"], "Bearer");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_from_elsewhere_cannot_use_a_server_without_keys() {
    let server =
        TestServer::start_with(|config| config.web.origins = vec!["https://fleet.example".into()]).await;
    let api = &server.api;
    api.put("/v1/sites/a", &json!({})).await.ok();
    for header in [("origin", "https://evil.example"), ("origin", "null"), ("host", "evil.example:7070")] {
        for (method, path) in [
            (Method::POST, "/v1/sites/a/builds"),
            (Method::DELETE, "/v1/sites/a"),
            (Method::GET, "/v1/sites"),
        ] {
            api.send(method, path, &[header], Vec::new()).await.unwrap().problem(403, "foreign-origin");
        }
    }
    let allowed = [("origin", "https://fleet.example")];
    let answer = api.send(Method::GET, "/v1/sites", &allowed, Vec::new()).await.unwrap();
    assert_eq!(answer.ok()["items"].as_array().map(Vec::len), Some(1));
    assert_eq!(answer.headers["access-control-allow-origin"], "https://fleet.example");
    let asked = [allowed[0], ("access-control-request-method", "PUT")];
    let preflight = api.send(Method::OPTIONS, "/v1/sites/b", &asked, Vec::new()).await.unwrap();
    assert_eq!(preflight.headers["access-control-allow-origin"], "https://fleet.example");
    let own = [("origin", api.base.as_str())];
    api.send(Method::GET, "/v1/sites", &own, Vec::new()).await.unwrap().ok();
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn other_machines_are_refused_without_a_key() {
    let directory = tempfile::tempdir().unwrap();
    let config = ServerConfig {
        address: "0.0.0.0:0".parse().unwrap(),
        data_directory: directory.path().to_owned(),
        ..Default::default()
    };
    let Err(error) = start_server(config).await else { panic!("the server started") };
    assert!(error.to_string().contains("keys"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn overload_is_refused_politely_and_passes() {
    let server = TestServer::start_with(|config| {
        config.limits.num_batches_max = 2;
        config.limits.num_batches_per_run_max = 1;
    })
    .await;
    // Bodies that fit the buffers of a connection: a refusal may come before a longer one is sent.
    let scans = drive(40, 1);
    server.api.make_run("a", "r").await;
    let mut tasks = Vec::new();
    for _ in 0..24 {
        let (api, scans) = (server.api.clone(), scans.clone());
        tasks.push(tokio::spawn(async move { api.post_batch("a", "r", 0, &scans).await }));
    }
    let mut num_refused = 0;
    for task in tasks {
        let answer = task.await.unwrap();
        if answer.status == 429 {
            answer.problem(429, "busy");
            assert!(answer.headers["retry-after"].to_str().unwrap().parse::<u64>().unwrap() >= 1);
            num_refused += 1;
        } else {
            answer.ok();
        }
    }
    assert!(num_refused > 0);
    assert_eq!(server.api.post_batch("a", "r", 0, &scans).await.ok()["next_sequence"], 40);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_are_made_shown_once_rotated_and_revoked_while_serving() {
    let server = TestServer::start().await;
    let api = &server.api;
    let refused = api.post("/v1/keys", &json!({"name": "robot", "scope": "write", "sites": ["a"]})).await;
    assert_eq!(refused.problem(422, "invalid-value")["field"], "scope");
    let boss = json!({"name": "boss", "scope": "admin", "sites": ["*"]});
    let secret = |answer: &serde_json::Value| answer["secret"].as_str().unwrap().to_owned();
    let boss = api.with_key(&secret(&api.post("/v1/keys", &boss).await.ok()));
    api.get("/v1/sites").await.problem(401, "unauthorized");
    boss.put("/v1/sites/a", &json!({})).await.ok();
    boss.put("/v1/sites/b", &json!({})).await.ok();
    let robot = json!({"name": "robot", "scope": "write", "sites": ["a"], "expires_in_s": 3600});
    let first = secret(&boss.post("/v1/keys", &robot).await.ok());
    boss.post("/v1/keys", &robot).await.problem(409, "exists");
    let robot = api.with_key(&first);
    robot.get("/v1/sites/a").await.ok();
    robot.get("/v1/sites/b").await.problem(403, "forbidden");
    robot.get("/v1/keys").await.problem(403, "forbidden");
    let listed = boss.get("/v1/keys").await;
    assert_eq!(listed.ok()["items"].as_array().map(Vec::len), Some(2));
    assert!(!listed.text().contains(&first) && !listed.text().contains("sha256"));
    let second = secret(&boss.post("/v1/keys/robot/rotate?grace_s=600", &json!({})).await.ok());
    robot.get("/v1/sites/a").await.ok();
    api.with_key(&second).get("/v1/sites/a").await.ok();
    boss.post("/v1/keys/robot/rotate", &json!({})).await.ok();
    robot.get("/v1/sites/a").await.problem(401, "unauthorized");

    let server = server.restart().await;
    let boss = server.api.with_key(boss.key.as_deref().unwrap());
    assert_eq!(boss.delete("/v1/keys/robot").await.status, 204);
    boss.delete("/v1/keys/robot").await.problem(404, "not-found");
    boss.delete("/v1/keys/boss").await.problem(409, "exists");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_is_held_to_its_rate() {
    let server = TestServer::start_with(|config| {
        config.keys = keys();
        config.keys[0].requests_per_s_max = Some(1.0);
    })
    .await;
    let reader = server.api.with_key("reader");
    let mut num_refused = 0;
    for _ in 0..5 {
        let answer = reader.get("/v1/sites").await;
        if answer.status == 429 {
            answer.problem(429, "too-often");
            assert!(answer.headers.contains_key("retry-after"));
            num_refused += 1;
        }
    }
    assert!(num_refused > 0);
    assert_eq!(server.api.with_key("admin").get("/v1/sites").await.status, 200);
    server.stop().await;
}
