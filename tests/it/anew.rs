//! A site that is deleted and made again under its name is another site.

use locution_tests::{Answer, TestServer, drive, geometry};
use reqwest::Method;
use serde_json::{Value, json};

/// The same drive through the building as a mirror shows it.
fn mirrored(scans: Vec<Value>) -> Vec<Value> {
    let mirror = |mut scan: Value| {
        for name in ["y", "theta"] {
            let value = scan["odom_from_robot"][name].as_f64().unwrap();
            scan["odom_from_robot"][name] = json!(-value);
        }
        scan["ranges_m"].as_array_mut().unwrap().reverse();
        scan
    };
    scans.into_iter().map(mirror).collect()
}

async fn map_site(server: &TestServer, site: &str, scans: &[Value]) {
    server.api.make_run(site, "r").await;
    server.api.post_all(site, "r", scans, 300).await;
    server.api.post(&format!("/v1/sites/{site}/runs/r/finish"), &json!({})).await.ok();
    server.api.post(&format!("/v1/sites/{site}/builds?wait=true"), &json!({})).await.ok();
}

async fn form(server: &TestServer, site: &str, form: &str) -> Answer {
    let answer = server.api.get(&format!("/v1/sites/{site}/map{form}")).await;
    assert_eq!(answer.status, 200, "{form}: {}", answer.text());
    answer
}

const FORMS: [&str; 7] =
    ["/grid", "/grid.pgm", "/grid.png", "/grid.yaml", "/graph.g2o", "/picture.png", "/picture.svg"];

#[tokio::test(flavor = "multi_thread")]
async fn nothing_of_a_deleted_site_is_served_again() {
    let server = TestServer::start().await;
    let (first, second) = (drive(900, 1), mirrored(drive(900, 2)));
    map_site(&server, "again", &first).await;
    let mut before = Vec::new();
    for path in FORMS {
        before.push(form(&server, "again", path).await);
    }
    let opened =
        server.api.post("/v1/sites/again/localisations", &json!({"geometry": geometry()})).await.ok();
    let example = json!({"geometry": geometry(), "scans": first[200..400]});
    server.api.post("/v1/sites/again/queries/example", &example).await.ok();

    server.api.delete("/v1/sites/again").await;
    map_site(&server, "again", &second).await;
    map_site(&server, "other", &second).await;
    for (path, old) in FORMS.iter().zip(&before) {
        let (again, other) = (form(&server, "again", path).await, form(&server, "other", path).await);
        assert!(again.bytes == other.bytes, "{path} is not that of the new site");
        assert!(again.bytes != old.bytes, "{path} is that of the deleted site");
        assert_ne!(again.headers["etag"], old.headers["etag"], "{path}");
        let known = [("if-none-match", old.headers["etag"].to_str().unwrap())];
        let path = format!("/v1/sites/again/map{path}");
        assert_eq!(server.api.send(Method::GET, &path, &known, Vec::new()).await.unwrap().status, 200);
    }
    let session = format!("/v1/sites/again/localisations/{}", opened["id"]);
    server.api.get(&session).await.problem(404, "not-found");
    let mut places = Vec::new();
    for site in ["again", "other"] {
        let mut answer = server.api.post(&format!("/v1/sites/{site}/queries/example"), &example).await.ok();
        answer["site"].take();
        places.push(answer);
    }
    assert_eq!(places[0], places[1]);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_form_of_the_map_says_not_modified_to_whoever_has_it() {
    let server = TestServer::start().await;
    map_site(&server, "s", &drive(500, 1)).await;
    for path in FORMS.iter().chain(&["", "/trajectory.tum"]) {
        let tag = form(&server, "s", path).await.headers["etag"].to_str().unwrap().to_owned();
        let path = format!("/v1/sites/s/map{path}");
        for known in [tag.clone(), format!("W/{tag}"), format!("\"0\", {tag}"), "*".to_owned()] {
            let headers = [("if-none-match", known.as_str())];
            let answer = server.api.send(Method::GET, &path, &headers, Vec::new()).await.unwrap();
            assert_eq!(answer.status, 304, "{path} for {known}");
            assert!(answer.bytes.is_empty() && answer.headers["etag"] == tag.as_str());
        }
        let headers = [("if-none-match", "\"0\"")];
        assert_eq!(server.api.send(Method::GET, &path, &headers, Vec::new()).await.unwrap().status, 200);
    }
    server.stop().await;
}
