//! The rules of the code base that no compiler checks: who may import whom, what the engine must not touch, how long a
//! file and a function may grow. ARCHITECTURE.md gives the reasons.

use std::fs;

use locution_tidy::{Source, check, sources, workspace};

/// Longest source file, in lines before its tests.
const MAX_FILE_LINES: usize = 500;
/// Longest function, in lines.
const MAX_FUNCTION_LINES: usize = 80;

/// Rooms that every room of the engine may use.
const GROUND: [&str; 2] = ["geometry", "config_error"];

/// Stems of words that names spell in one way, and the other way.
const SPELLINGS: &[(&str, &str)] = &[
    ("localis", "localiz"),
    ("optimis", "optimiz"),
    ("factoris", "factoriz"),
    ("normalis", "normaliz"),
    ("minimis", "minimiz"),
    ("quantis", "quantiz"),
    ("recognis", "recogniz"),
    ("summaris", "summariz"),
    ("serialis", "serializ"),
    ("initialis", "initializ"),
    ("centre", "center"),
    ("colour", "color"),
    ("grey", "gray"),
    ("neighbour", "neighbor"),
    ("labelled", "labeled"),
    ("metre", "meter"),
];

fn forbid(sources: &[Source], words: &[&str]) -> Vec<String> {
    let mut complaints = Vec::new();
    for source in sources {
        for (line_idx, line) in source.statements() {
            for word in words.iter().filter(|word| line.contains(**word)) {
                complaints.push(source.complaint(line_idx, &format!("`{word}` has no place here")));
            }
        }
    }
    complaints
}

#[test]
fn the_engine_is_pure() {
    let forbidden = [
        "std::fs",
        "std::net",
        "std::time",
        "std::env",
        "println!",
        "eprintln!",
        "tokio",
        "axum",
        "sled::",
        "rand::rng(",
        "thread_rng",
    ];
    check(forbid(&sources("engine/src"), &forbidden));
}

/// The rows of one of ARCHITECTURE's tables: a room and the rooms that it may use.
fn rooms(heading: &str) -> Vec<(String, Vec<String>)> {
    let text =
        fs::read_to_string(workspace().join("ARCHITECTURE.md")).expect("the page is part of the repository");
    let table = text.split(heading).nth(1).expect("the page has the table");
    let table = table.split("\n## ").next().unwrap_or_default();
    let names = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').collect();
        let room = names(cells.get(1)?).first()?.clone();
        Some((room, names(cells.get(3)?)))
    };
    let rooms: Vec<_> = table.lines().filter(|line| line.starts_with("| `")).filter_map(row).collect();
    assert!(rooms.len() > 5, "the table of rooms was not read: {rooms:?}");
    rooms
}

/// Names that follow `prefix` in a line of code.
fn used<'a>(line: &'a str, prefix: &'a str) -> impl Iterator<Item = &'a str> {
    let rests = line.split(prefix).skip(1);
    let names = rests.filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next());
    names.filter(|name| !name.is_empty())
}

#[test]
fn every_room_of_the_engine_has_a_row_and_keeps_to_it() {
    let rooms = rooms("## Rooms of the engine");
    let mut complaints = Vec::new();
    for source in sources("engine/src") {
        let path = source.path.to_string_lossy().replace('\\', "/");
        let inside = path.split("engine/src/").nth(1).unwrap_or_default();
        let room = inside.split('/').next().unwrap_or_default().trim_end_matches(".rs");
        if room == "lib" {
            continue;
        }
        let Some((_, may_use)) = rooms.iter().find(|(name, _)| name == room) else {
            complaints.push(source.complaint(0, &format!("`{room}` has no row in ARCHITECTURE.md")));
            continue;
        };
        for (line_idx, line) in source.statements() {
            for used in used(line, "crate::").filter(|used| *used != room && !GROUND.contains(used)) {
                if !may_use.iter().any(|allowed| allowed == used) {
                    complaints.push(source.complaint(line_idx, &format!("`{room}` may not use `{used}`")));
                }
            }
        }
    }
    check(complaints);
}

#[test]
fn rooms_of_the_server_keep_to_their_rows() {
    let rooms = rooms("## Rooms of the server");
    let mut complaints = Vec::new();
    for (room, may_use) in &rooms {
        let (top, folder) =
            room.split_once('/').map_or((room.as_str(), None), |(top, folder)| (top, Some(folder)));
        for source in sources(&format!("server/src/{room}")) {
            for (line_idx, line) in source.statements() {
                let of_app = used(line, "crate::app::").map(|name| format!("app/{name}"));
                let used: Vec<String> = match folder {
                    None => used(line, "crate::").filter(|name| *name != top).map(str::to_owned).collect(),
                    // Types of the hall that all folders share begin with a capital letter.
                    Some(_) => of_app.filter(|used| rooms.iter().any(|(other, _)| other == used)).collect(),
                };
                for used in used.iter().filter(|used| *used != room && !may_use.contains(used)) {
                    complaints.push(source.complaint(line_idx, &format!("`{room}` may not use `{used}`")));
                }
            }
        }
    }
    check(complaints);
}

#[test]
fn names_are_spelled_in_one_way() {
    let mut complaints = Vec::new();
    for folder in ["engine", "server/src", "clients", "openapi", "tests"] {
        for source in sources(folder) {
            for (line_idx, line) in source.statements() {
                let code = line.split("//").next().unwrap_or_default();
                let outside_strings: String =
                    code.split('"').step_by(2).collect::<Vec<_>>().join(" ").to_lowercase();
                for (stem, right) in SPELLINGS {
                    if outside_strings.contains(stem) {
                        complaints.push(
                            source.complaint(line_idx, &format!("`{stem}…` is spelled `{right}…` in names")),
                        );
                    }
                }
            }
        }
    }
    check(complaints);
}

#[test]
fn sparse_algebra_stays_in_the_pose_graph() {
    let elsewhere: Vec<_> = sources("engine/src")
        .into_iter()
        .filter(|source| !source.path.to_string_lossy().contains("pose_graph"))
        .collect();
    check(forbid(&elsewhere, &["faer::"]));
}

#[test]
fn the_storage_engine_stays_behind_its_trait() {
    let above: Vec<_> = sources("server/src")
        .into_iter()
        .filter(|source| !source.path.to_string_lossy().contains("storage"))
        .collect();
    check(forbid(&above, &["sled::", "slatedb::"]));
}

#[test]
fn use_cases_records_and_storage_know_no_http() {
    let mut inner = sources("server/src/app");
    inner.extend(sources("server/src/records"));
    inner.extend(sources("server/src/storage"));
    check(forbid(&inner, &["axum::", "utoipa::", "crate::http"]));
}

#[test]
fn clients_speak_only_http() {
    check(forbid(&sources("clients/rust"), &["locution_engine", "locution_server"]));
    let manifest =
        fs::read_to_string(workspace().join("clients/rust/Cargo.toml")).expect("the client has a manifest");
    assert!(!manifest.contains("locution-engine") && !manifest.contains("locution-server"));
}

#[test]
fn every_file_says_what_it_is_for_and_stays_short() {
    let mut complaints = Vec::new();
    for folder in ["engine", "server/src", "clients", "openapi", "tests"] {
        for source in sources(folder) {
            if !source.text.starts_with("//!") {
                complaints.push(source.complaint(0, "begins without a module header"));
            }
            let num_lines = source.code().lines().count();
            if num_lines > MAX_FILE_LINES {
                complaints
                    .push(source.complaint(MAX_FILE_LINES, &format!("{num_lines} lines before its tests")));
            }
        }
    }
    check(complaints);
}

#[test]
fn functions_fit_a_screen() {
    let mut complaints = Vec::new();
    for folder in ["engine/src", "server/src", "clients", "openapi/src"] {
        for source in sources(folder) {
            let lines: Vec<&str> = source.code().lines().collect();
            for (start, line) in lines.iter().enumerate() {
                let body = line.trim_start();
                let is_function =
                    ["fn ", "pub fn ", "async fn ", "pub async fn ", "pub(crate) fn ", "pub(super) fn "]
                        .iter()
                        .any(|opening| body.starts_with(opening));
                if !is_function {
                    continue;
                }
                let indent = &line[..line.len() - body.len()];
                let closing = format!("{indent}}}");
                let length = lines[start..].iter().position(|line| *line == closing).unwrap_or(0) + 1;
                if length > MAX_FUNCTION_LINES {
                    complaints.push(source.complaint(start, &format!("a function of {length} lines")));
                }
            }
        }
    }
    check(complaints);
}

#[test]
fn nothing_is_postponed_in_the_code() {
    let mut complaints = Vec::new();
    for folder in ["engine", "server", "clients", "openapi"] {
        complaints.extend(forbid(&sources(folder), &["todo!(", "unimplemented!(", "dbg!("]));
    }
    check(complaints);
}
