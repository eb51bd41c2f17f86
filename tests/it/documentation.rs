//! The commands of the documentation, run as they stand there.

use std::path::Path;
use std::process::Command;

use locution_tests::{TestServer, drive, geometry};
use serde_json::{Value, json};

/// A fenced command with the answer that follows it, if one does.
struct Shown {
    command: String,
    answer: Option<Value>,
}

/// The commands of a page that call the server, in their order.
fn shown_commands(page: &str) -> Vec<Shown> {
    let mut shown: Vec<Shown> = Vec::new();
    let mut blocks = page.split("\n```");
    blocks.next();
    for block in blocks {
        if let Some(command) = block.strip_prefix("sh\n").filter(|text| text.starts_with("curl")) {
            shown.push(Shown { command: command.to_owned(), answer: None });
        } else if let Some(answer) = block.strip_prefix("json\n") {
            shown.last_mut().unwrap().answer = Some(serde_json::from_str(answer).unwrap());
        }
    }
    shown
}

/// Whether an answer has every member of the shown one, with values of the same kinds. Of a list the first items are
/// compared; what is null in either is of any kind.
fn is_like(shown: &Value, answer: &Value) -> bool {
    match (shown, answer) {
        (Value::Object(shown), Value::Object(answer)) => {
            shown.iter().all(|(name, value)| answer.get(name).is_some_and(|answer| is_like(value, answer)))
        }
        (Value::Array(shown), Value::Array(answer)) => match (shown.first(), answer.first()) {
            (Some(shown), Some(answer)) => is_like(shown, answer),
            (Some(_), None) => false,
            (None, _) => true,
        },
        (Value::Null, _) | (_, Value::Null) => true,
        _ => std::mem::discriminant(shown) == std::mem::discriminant(answer),
    }
}

#[test]
fn likeness_is_of_members_and_kinds() {
    let shown = json!({"a": [{"x": 1.5, "y": null}], "b": []});
    assert!(is_like(&shown, &json!({"a": [{"x": 2, "y": "z"}, 7], "b": [1], "c": 3})));
    for other in [
        json!({"a": [], "b": []}),
        json!({"a": [{"x": "1", "y": 1}], "b": []}),
        json!({"a": [{"x": 1, "y": 1}]}),
    ] {
        assert!(!is_like(&shown, &other), "{other}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_documented_commands_answer_as_shown() {
    if Command::new("curl").arg("--version").output().is_err() {
        println!("skipped: curl is not installed");
        return;
    }
    let server = TestServer::start().await;
    for (run, seed) in [("r1", 1), ("r2", 2)] {
        server.api.make_run("office", run).await;
        server.api.post_all("office", run, &drive(900, seed), 200).await;
        server.api.post(&format!("/v1/sites/office/runs/{run}/finish"), &json!({})).await.ok();
    }
    server.api.post("/v1/sites/office/builds?wait=true", &json!({})).await.ok();
    let directory = tempfile::tempdir().unwrap();
    let example = json!({"geometry": geometry(), "scans": drive(900, 3)[500..700]});
    std::fs::write(directory.path().join("example.json"), example.to_string()).unwrap();

    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/api-design.md");
    let shown = shown_commands(&std::fs::read_to_string(page).unwrap());
    assert!(shown.len() >= 10, "{} commands", shown.len());
    for Shown { command, answer } in shown {
        let address = server.api.base.trim_start_matches("http://");
        let script = command.replace("localhost:7070", address).replacen(
            "curl",
            "curl --silent --show-error --fail-with-body",
            1,
        );
        let mut shell = Command::new("sh");
        shell.args(["-c", &script]).current_dir(directory.path());
        let ran = tokio::task::spawn_blocking(move || shell.output()).await.unwrap().unwrap();
        let body = String::from_utf8_lossy(&ran.stdout).into_owned();
        assert!(ran.status.success(), "{command}\n{body}\n{}", String::from_utf8_lossy(&ran.stderr));
        if let Some(shown) = answer {
            let answered: Value = serde_json::from_str(&body).unwrap();
            assert!(is_like(&shown, &answered), "{command}\nshown    {shown}\nanswered {answered}");
        }
    }
    server.stop().await;
}
