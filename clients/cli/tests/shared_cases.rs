//! Files as robots, exporters and libraries really write them, through the command line.
//!
//! Skipped where the cases are absent; `LOCUTION_CASES` says where they are.
#![allow(clippy::unwrap_used)]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

fn case(name: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases");
    let folder = std::env::var_os("LOCUTION_CASES").map_or_else(beside, PathBuf::from).join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: the case {name} is absent");
    None
}

fn locution(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_locution"));
    command.args(arguments).output().unwrap()
}

fn text_of(file: &Path) -> &str {
    file.to_str().unwrap()
}

/// The report of `optimize --json`.
fn optimized(file: &Path, more: &[&str]) -> Value {
    let output = locution(&[&["optimize", text_of(file), "--json"], more].concat());
    assert!(output.status.success(), "{file:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn errors(output: &Output) -> String {
    assert!(!output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn lines_of_data_in_a_graph_are_passed_over_and_counted() {
    let Some(case) = case("graph-with-lines-of-data") else { return };
    let plain = optimized(&case.join("plain.g2o"), &[]);
    for (file, tag, count) in [
        ("params.g2o", "PARAMS_SE2OFFSET", 1),
        ("tags.g2o", "VERTEX_TAG", 32),
        ("laser.g2o", "ROBOTLASER1", 32),
    ] {
        let report = optimized(&case.join(file), &[]);
        for key in ["poses", "edges", "chi2", "components"] {
            assert_eq!(report[key], plain[key], "{file} {key}");
        }
        assert_eq!(report["lines_passed_over"][tag], count, "{file}");
    }
    let landmarks = locution(&["optimize", text_of(&case.join("landmarks.g2o"))]);
    assert!(errors(&landmarks).contains("landmarks are not supported"));
}

#[test]
fn a_graph_packed_in_two_parts_is_read_whole() {
    let Some(case) = case("graph-packed-in-two-parts") else { return };
    let report = optimized(&case.join("graph.g2o.gz"), &[]);
    assert_eq!((report["poses"].as_u64(), report["edges"].as_u64()), (Some(32), Some(32)));
    assert_eq!(report["components"], 1);
}

#[test]
fn a_graph_without_closures_converges() {
    let Some(case) = case("graph-without-closures") else { return };
    for robust in ["none", "gnc", "dcs"] {
        let report = optimized(&case.join("chain.g2o"), &["--robust", robust]);
        assert_eq!(report["stop_reason"], "Converged");
        assert!(report["iterations"].as_u64().unwrap() < 10, "{robust}: {report}");
    }
}

/// Poses of a g2o file in its order.
fn poses_of(file: &Path) -> Vec<[f64; 2]> {
    let text = std::fs::read_to_string(file).unwrap();
    let vertices = text.lines().filter_map(|line| line.strip_prefix("VERTEX_SE2 "));
    vertices
        .map(|line| {
            let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
            [numbers[1], numbers[2]]
        })
        .collect()
}

#[test]
fn the_numbers_of_the_vertices_do_not_matter() {
    let Some(case) = case("graph-numbered-by-tens") else { return };
    let folder = tempfile::tempdir().unwrap();
    let truth: Vec<[f64; 2]> = std::fs::read_to_string(case.join("truth.txt"))
        .unwrap()
        .lines()
        .map(|line| {
            let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
            [numbers[0], numbers[1]]
        })
        .collect();
    for robust in ["gnc", "dcs"] {
        let solve = |name: &str| {
            let output = folder.path().join(name);
            let more = ["--robust", robust, "--output", text_of(&output)];
            let report = optimized(&case.join(name), &more);
            (report["rejected_edges"].clone(), poses_of(&output))
        };
        let (by_ones, by_tens) = (solve("by-ones.g2o"), solve("by-tens.g2o"));
        assert_eq!(by_ones, by_tens, "{robust}");
        let squares =
            by_tens.1.iter().zip(&truth).map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2));
        let rms_m = (squares.sum::<f64>() / truth.len() as f64).sqrt();
        println!("{robust}: {rms_m:.3} m");
        assert!(robust == "dcs" || rms_m < 0.15, "{rms_m}");
    }
}

/// The log that a simulation writes.
fn simulated(world: &Path, more: &[&str]) -> Result<Vec<u8>, String> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let output = locution(&[&["simulate", "--world", text_of(world), "--out", text_of(&out)], more].concat());
    if output.status.success() {
        Ok(std::fs::read(folder.path().join("run.log")).unwrap())
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

#[test]
fn worlds_are_read_from_any_yaml() {
    let Some(case) = case("map-yaml-as-libraries-write-it") else { return };
    let plain = simulated(&case.join("plain.yaml"), &["--wander", "5"]).unwrap();
    for file in ["block.yaml", "document.yaml", "quoted.yaml"] {
        assert!(simulated(&case.join(file), &["--wander", "5"]).unwrap() == plain, "{file}");
    }
}

#[test]
fn worlds_of_every_mode_are_what_they_mean() {
    let Some(case) = case("map-yaml-modes") else { return };
    assert!(simulated(&case.join("raw.yaml"), &["--wander", "5", "--start", "1,4"]).is_ok());
    let in_unknown = simulated(&case.join("scale.yaml"), &["--wander", "5", "--start", "2,0"]);
    assert!(in_unknown.unwrap_err().contains("not on free floor"));
    assert!(simulated(&case.join("scale.yaml"), &["--wander", "5", "--start", "1,4"]).is_ok());
}

#[test]
fn small_worlds_are_driven_in_and_coordinates_may_be_negative() {
    let Some(case) = case("small-arena") else { return };
    let arena = case.join("arena.yaml");
    assert!(simulated(&arena, &["--wander", "5"]).is_ok());
    assert!(simulated(&arena, &["--wander", "5", "--start", "-1.5,0"]).is_ok());
    assert!(simulated(&arena, &["--route", "-1.5,0 1.5,0"]).is_ok());
    assert!(simulated(&arena, &["--route=-1.5,0 1.5,0"]).is_ok());
}

/// A server in a process of its own.
struct Server {
    process: Child,
    url: String,
    _directory: tempfile::TempDir,
}

impl Server {
    fn start() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut process = Command::new(env!("CARGO_BIN_EXE_locution"))
            .args(["serve", "--address", "127.0.0.1:0", "--data-directory", text_of(directory.path())])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim().trim_start_matches("listening on ").to_owned();
        Self { process, url, _directory: directory }
    }

    fn replay(&self, site: &str, file: &Path, more: &[&str]) -> Output {
        locution(&[&["replay", "--url", &self.url, "--site", site, text_of(file)], more].concat())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn said(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn logs_of_robots_are_replayed() {
    let names = [
        "log-whose-gzip-is-cut-off",
        "log-that-begins-with-a-mark",
        "log-of-a-wide-laser",
        "clock-set-while-recording",
    ];
    let cases: Vec<PathBuf> = names.iter().filter_map(|name| case(name)).collect();
    let [cut_off, mark, wide, clock] = cases.as_slice() else { return };
    let server = Server::start();

    let cut = cut_off.join("cut.log.gz");
    assert!(errors(&server.replay("cut", &cut, &[])).contains("--skip-malformed"));
    let output = server.replay("cut", &cut, &["--skip-malformed"]);
    assert!(said(&output).contains("cut: 45 scans posted"), "{}", said(&output));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cut off"));
    let padded = server.replay("padded", &cut_off.join("padded.log.gz"), &[]);
    assert!(said(&padded).contains("padded: 60 scans posted"));

    let marked = said(&server.replay("mark", &mark.join("run.log.gz"), &[]));
    assert!(marked.contains("run: 60 scans posted"), "{marked}");
    assert!(marked.contains("/v1/sites/mark/map"), "it ends with where to look: {marked}");

    said(&server.replay("wide", &wide.join("run.log.gz"), &[]));
    let began = std::time::Instant::now();
    let paced = server.replay("clock", &clock.join("run.log.gz"), &["--rate", "100"]);
    assert!(said(&paced).contains("run: 60 scans posted"));
    assert!(began.elapsed().as_secs() < 60);
}

#[test]
fn a_server_that_does_not_answer_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.log");
    std::fs::write(&log, "FLASER 3 1 2 3 0 0 0 0 0 0 1.0 host 1.0\n").unwrap();
    let arguments = ["replay", "--url", "http://127.0.0.1:9", "--site", "x", text_of(&log)];
    let told = errors(&locution(&arguments));
    assert!(told.contains("waiting for the server") && told.contains("no server is ready"), "{told}");
}

#[test]
fn keys_completions_and_manual_pages_are_made() {
    let key = locution(&["key", "new", "--name", "fleet", "--scope", "read"]);
    assert!(said(&key).starts_with("locution_") && said(&key).trim().len() == 73);
    assert!(String::from_utf8_lossy(&key.stderr).contains("[[keys]]"));
    for shell in ["bash", "zsh", "fish"] {
        assert!(said(&locution(&["completions", shell])).contains("replay"), "{shell}");
    }
    let folder = tempfile::tempdir().unwrap();
    said(&locution(&["man", "--directory", text_of(folder.path())]));
    let page = std::fs::read_to_string(folder.path().join("locution-replay.1")).unwrap();
    assert!(page.contains("CARMEN"));
    let misspelled = Command::new(env!("CARGO_BIN_EXE_locution"))
        .args(["completions", "bash"])
        .env("LOCUTION_ADRESS", "127.0.0.1:1")
        .output()
        .unwrap();
    assert!(String::from_utf8_lossy(&misspelled.stderr).contains("LOCUTION_ADDRESS"));
}
