//! Directories that earlier versions wrote are served as they were.
//!
//! `tests/stored` holds, for each stored format, the files of a small site and what the version that wrote them answered:
//! a finished run, one that still grows, and a map. Whoever changes a stored layout adds a folder and keeps the others.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use locution_tests::TestServer;
use serde_json::{Value, json};

fn unpacked(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_end(&mut bytes).unwrap();
    bytes
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// Whether an answer has everything of the old one; a later version may say more.
fn holds(answer: &Value, old: &Value) -> bool {
    match (answer, old) {
        (Value::Object(answer), Value::Object(old)) => {
            old.iter().all(|(name, old)| answer.get(name).is_some_and(|answer| holds(answer, old)))
        }
        (Value::Array(answer), Value::Array(old)) => {
            answer.len() == old.len() && answer.iter().zip(old).all(|(answer, old)| holds(answer, old))
        }
        _ => answer == old,
    }
}

#[test]
fn an_answer_holds_an_old_one_when_nothing_is_missing_or_other() {
    let old = json!({"a": [1, {"b": 2}]});
    assert!(holds(&json!({"a": [1, {"b": 2, "c": 3}], "d": 4}), &old));
    assert!(!holds(&json!({"a": [1]}), &old) && !holds(&json!({"a": [1, {"b": 3}]}), &old));
}

/// Starts a server over the stored site and compares; then goes on with the growing run.
async fn serve_stored(format: &Path) {
    let server = TestServer::start().await;
    let site = server.directory().join("sites/old");
    let server = server
        .restart_after(|| {
            std::fs::create_dir_all(site.join("blobs")).unwrap();
            for path in files(&format.join("site")) {
                std::fs::write(site.join(path.file_stem().unwrap()), unpacked(&path)).unwrap();
            }
        })
        .await;
    let answers: Value = serde_json::from_slice(&unpacked(&format.join("answers.json.gz"))).unwrap();
    let answers = answers.as_object().unwrap();
    let last = answers["/v1/sites/old/runs/there/scans?limit=1000"]["items"]
        .as_array()
        .unwrap()
        .last()
        .unwrap()
        .clone();
    let server = compare(server, answers).await;
    let grown = server.api.get("/v1/sites/old/runs/growing").await.ok();
    let next = grown["num_scans"].as_u64().unwrap() as usize;
    let previous = server.api.all("/v1/sites/old/runs/growing/scans").await.pop().unwrap();
    let scan = json!({"timestamp_ns": last["timestamp_ns"], "odom_from_robot": previous["odom_from_robot"], "ranges_m": last["ranges_m"]});
    assert_eq!(server.api.post_batch("old", "growing", next, &[scan]).await.ok()["next_sequence"], next + 1);
    let job = server.api.post("/v1/sites/old/builds?wait=true", &json!({})).await.ok();
    assert_eq!(job["state"], "done", "{job}");
    server.stop().await;
}

/// Compares now and after another start.
async fn compare(mut server: TestServer, answers: &serde_json::Map<String, Value>) -> TestServer {
    for _ in 0..2 {
        for (path, old) in answers {
            let answer = server.api.get(path).await.ok();
            assert!(holds(&answer, old), "{path}\nwas {old}\nis  {answer}");
        }
        server = server.restart().await;
    }
    server
}

#[tokio::test(flavor = "multi_thread")]
async fn sites_of_every_earlier_format_are_served_as_they_were() {
    let formats = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("stored"));
    assert!(!formats.is_empty());
    for format in formats {
        serve_stored(&format).await;
    }
}
