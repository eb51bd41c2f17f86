//! A damaged site is told, listed and deletable, and harms no other; a second server is refused.

use std::path::Path;

use locution_server::config::ServerConfig;
use locution_server::start_server;
use locution_tests::{TestServer, drive};
use serde_json::json;

/// Overwrites bytes of a file in the middle.
fn overwrite(path: &Path, at: u64, bytes: &[u8]) {
    use std::io::{Seek, SeekFrom, Write};
    let mut file = std::fs::File::options().write(true).open(path).unwrap();
    file.seek(SeekFrom::Start(at)).unwrap();
    file.write_all(bytes).unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_site_is_told_and_harms_no_other() {
    let server = TestServer::start().await;
    for site in ["bad", "good"] {
        server.api.make_run(site, "r").await;
        server.api.post_all(site, "r", &drive(400, 3), 50).await;
        server.api.post(&format!("/v1/sites/{site}/runs/r/finish"), &json!({})).await.ok();
    }
    let site = server.directory().join("sites/bad");
    let server = server
        .restart_after(|| {
            let db = site.join("db");
            let third = std::fs::metadata(&db).unwrap().len() / 3;
            overwrite(&db, third, &[0xff]);
        })
        .await;
    let before = std::fs::read(site.join("db")).unwrap();
    for path in ["/v1/sites/bad", "/v1/sites/bad/runs/r"] {
        let problem = server.api.get(path).await.problem(500, "corrupt");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("site `bad`") && detail.contains("locution repair"), "{detail}");
    }
    server.api.put("/v1/sites/bad", &json!({})).await.problem(500, "corrupt");
    assert_eq!(std::fs::read(site.join("db")).unwrap(), before, "written over");
    let listed = server.api.all("/v1/sites").await;
    let states: Vec<_> = listed.iter().map(|site| (site["site"].as_str(), site["state"].as_str())).collect();
    assert_eq!(states, [(Some("bad"), Some("unreadable")), (Some("good"), Some("serving"))]);
    assert!(listed[0]["reason"].as_str().unwrap().contains("site `bad`"), "{}", listed[0]);
    assert_eq!(server.api.get("/v1/sites/good/runs/r").await.ok()["num_scans"], 400);
    assert_eq!(server.api.delete("/v1/sites/bad").await.status, 204);
    server.api.make_run("bad", "r").await;
    assert_eq!(server.api.get("/v1/sites/bad/runs/r").await.ok()["num_scans"], 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_server_on_the_directory_is_told_who_holds_it() {
    let server = TestServer::start().await;
    std::fs::write(server.directory().join("sites/notes.txt"), "a stray").unwrap();
    let config = ServerConfig {
        address: "127.0.0.1:0".parse().unwrap(),
        data_directory: server.directory().to_owned(),
        ..Default::default()
    };
    let Err(error) = start_server(config).await else { panic!("two servers on one directory") };
    let told = format!("{}", std::error::Error::source(&error).unwrap());
    assert!(told.contains(&format!("process {}", std::process::id())), "{told}");
    server.api.make_run("a", "r").await;
    assert_eq!(server.api.all("/v1/sites").await.len(), 1);
    let server = server.restart().await;
    assert_eq!(server.api.all("/v1/sites").await.len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_site_is_backed_up_while_it_serves_and_restored_under_another_name() {
    let server = TestServer::start().await;
    let scans = drive(900, 4);
    server.api.make_run("a", "r").await;
    server.api.post_all("a", "r", &scans[..600], 50).await;
    server.api.post("/v1/sites/a/builds?wait=true", &json!({})).await.ok();
    let words = server.api.get_text("/v1/sites/a/runs/r/words").await;
    let backup = server.api.get("/v1/sites/a/backup").await;
    assert_eq!(backup.status, 200);
    server.api.post_batch("a", "r", 600, &scans[600..650]).await.ok();
    let put = reqwest::Method::PUT;
    let cut = backup.bytes[..backup.bytes.len() - 30].to_vec();
    let refused = server.api.send(put.clone(), "/v1/sites/b/backup", &[], cut).await.unwrap();
    refused.problem(422, "invalid-value");
    server.api.get("/v1/sites/b").await.problem(404, "not-found");
    let made = server.api.send(put.clone(), "/v1/sites/b/backup", &[], backup.bytes.clone()).await.unwrap();
    assert_eq!(made.ok()["num_scans"], 600);
    assert_eq!(server.api.get_text("/v1/sites/b/runs/r/words").await, words);
    server.api.get("/v1/sites/b/map").await.ok();
    let again = server.api.send(put, "/v1/sites/b/backup", &[], backup.bytes).await.unwrap();
    again.problem(409, "exists");
    // The restored run goes on where the backup was made.
    server.api.post_batch("b", "r", 600, &scans[600..650]).await.ok();
    let both = ["a", "b"].map(|site| format!("/v1/sites/{site}/runs/r/words"));
    assert_eq!(server.api.get_text(&both[0]).await, server.api.get_text(&both[1]).await);
}
