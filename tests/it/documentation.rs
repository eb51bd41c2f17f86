//! The commands of the documentation, run as they stand there.

use std::path::Path;
use std::process::Command;

use locution_server::config::{ApiKeyConfig, ServerConfig, TlsConfig};
use locution_tests::{TestServer, drive, geometry, locution_binary};
use serde_json::{Value, json};

/// A command of a fenced block with the answer that follows it, if one does.
struct Shown {
    command: String,
    answer: Option<Value>,
}

/// The commands of a page's `sh` blocks that call the server or the binary, in their order.
fn shown_commands(page: &str) -> Vec<Shown> {
    let mut shown: Vec<Shown> = Vec::new();
    let mut blocks = page.split("\n```");
    blocks.next();
    for block in blocks {
        if let Some(commands) = block.strip_prefix("sh\n") {
            let mut commands = commands_of(commands);
            commands.retain(|command| command.starts_with("curl") || command.starts_with("cargo run"));
            shown.extend(commands.into_iter().map(|command| Shown { command, answer: None }));
        } else if let (Some(answer), Some(last)) = (block.strip_prefix("json\n"), shown.last_mut()) {
            last.answer = Some(serde_json::from_str(answer).unwrap());
        }
    }
    shown
}

/// The commands of a block: each begins at the start of a line and goes on in indented ones.
fn commands_of(block: &str) -> Vec<String> {
    let mut commands: Vec<String> = Vec::new();
    for line in block.lines().filter(|line| !line.trim().is_empty()) {
        match commands.last_mut() {
            Some(last) if line.starts_with(' ') => *last = format!("{last}\n{line}"),
            _ => commands.push(line.to_owned()),
        }
    }
    commands
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

/// Runs the commands of a page against a server and compares the answers with the ones shown; how many there were.
async fn run_page(page: &str, server: &TestServer, directory: &Path) -> usize {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(page);
    let shown = shown_commands(&std::fs::read_to_string(page).unwrap());
    let address = server.api.base.trim_start_matches("http://");
    let binary = locution_binary();
    let mut num_run = 0;
    for Shown { command, answer } in shown {
        // The server runs already, and the demo is a test of its own.
        if command.contains("-- serve") || command.contains("-- demo") {
            continue;
        }
        num_run += 1;
        let script = command
            .replace("localhost:7070", address)
            .replacen("curl", "curl --silent --show-error --fail-with-body", 1)
            .replacen("cargo run --release --", &binary.to_string_lossy(), 1);
        let mut shell = Command::new("sh");
        shell.args(["-c", &script]).current_dir(directory);
        let ran = tokio::task::spawn_blocking(move || shell.output()).await.unwrap().unwrap();
        let body = String::from_utf8_lossy(&ran.stdout).into_owned();
        assert!(ran.status.success(), "{command}\n{body}\n{}", String::from_utf8_lossy(&ran.stderr));
        if let Some(shown) = answer {
            let answered: Value = serde_json::from_str(&body).unwrap();
            assert!(is_like(&shown, &answered), "{command}\nshown    {shown}\nanswered {answered}");
        }
    }
    num_run
}

fn has_curl() -> bool {
    let is_there = Command::new("curl").arg("--version").output().is_ok();
    if !is_there {
        println!("skipped: curl is not installed");
    }
    is_there
}

#[tokio::test(flavor = "multi_thread")]
async fn the_commands_of_api_page_and_tour_answer_as_shown() {
    if !has_curl() {
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

    assert!(run_page("docs/api-design.md", &server, directory.path()).await >= 10);
    assert!(run_page("docs/tour/5-a-question-by-words.md", &server, directory.path()).await == 1);
    assert!(run_page("docs/tour/6-where-am-i.md", &server, directory.path()).await == 1);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_commands_of_the_readme_make_a_map() {
    if !has_curl() {
        return;
    }
    let server = TestServer::start().await;
    let directory = tempfile::tempdir().unwrap();
    let world = Path::new(env!("CARGO_MANIFEST_DIR")).join("../clients/cli/worlds/office.yaml");
    let drive = Command::new(locution_binary())
        .args(["simulate", "--wander", "20", "--gzip", "--out", "my-robot", "--world"])
        .arg(world)
        .current_dir(directory.path())
        .output()
        .unwrap();
    assert!(drive.status.success(), "{}", String::from_utf8_lossy(&drive.stderr));
    assert_eq!(run_page("README.md", &server, directory.path()).await, 6);
    server.stop().await;
}

fn page(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(name)).unwrap()
}

/// Paths of all values of a configuration, with dots.
fn paths_of(value: &Value, prefix: &str, paths: &mut Vec<String>) {
    let Value::Object(members) = value else {
        return paths.push(prefix.to_owned());
    };
    for (name, member) in members {
        let path = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        paths_of(member, &path, paths);
    }
}

#[test]
fn the_page_on_configuration_names_every_key() {
    let key = ApiKeyConfig {
        expires_at_s: Some(1),
        requests_per_s_max: Some(1.0),
        num_localizations_max: Some(1),
        ..ApiKeyConfig::default()
    };
    let tls = TlsConfig { certificate: "chain.pem".into(), key: "key.pem".into() };
    let mut config = ServerConfig { tls: Some(tls), ..ServerConfig::default() };
    config.storage.address = Some("s3://maps/fleet".into());
    config.cluster.url = Some("http://10.0.0.7:7070".into());
    let mut paths = Vec::new();
    paths_of(&serde_json::to_value(&config).unwrap(), "", &mut paths);
    paths.retain(|path| path != "keys");
    paths_of(&serde_json::to_value(&key).unwrap(), "keys[]", &mut paths);
    assert!(paths.len() > 30, "{paths:?}");
    let page = page("configuration.md");
    let missing: Vec<_> = paths.iter().filter(|path| !page.contains(&format!("| `{path}` |"))).collect();
    assert!(missing.is_empty(), "not in docs/configuration.md: {missing:?}");
    let shown = page.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next());
    let unknown: Vec<_> = shown.filter(|path| !paths.iter().any(|known| known == path)).collect();
    assert!(unknown.is_empty(), "no such key: {unknown:?}");
}

#[test]
fn the_board_and_the_alerts_ask_only_for_metrics_that_exist() {
    let names = locution_server::metric_names();
    for file in ["operations/grafana.json", "operations/alerts.yaml"] {
        let text = page(file);
        let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let asked = words.filter(|word| word.starts_with("locution_") || word.starts_with("process_"));
        let mut num_asked = 0;
        for word in asked {
            num_asked += 1;
            let name = word.trim_end_matches("_bucket");
            assert!(names.contains(&name), "{file} asks for {word}");
        }
        assert!(num_asked > 5, "{file}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_metric_says_what_it_is() {
    let server = TestServer::start().await;
    server.api.make_run("a", "r").await;
    server.api.post_batch("a", "r", 0, &drive(5, 1)).await.ok();
    server.api.get("/v1/sites/none").await;
    let text = String::from_utf8(server.api.get("/metrics").await.bytes).unwrap();
    let types: Vec<&str> =
        text.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split(' ').next()).collect();
    for name in &types {
        assert!(text.contains(&format!("# HELP {name} ")), "{name} has no HELP");
    }
    for wanted in
        ["locution_scans_total", "locution_refusals_total", "locution_build_info", "locution_storage_bytes"]
    {
        assert!(types.contains(&wanted), "{wanted} is missing in {types:?}");
    }
    server.stop().await;
}
