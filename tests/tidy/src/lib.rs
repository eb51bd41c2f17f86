//! The sources of the repository as the rules of `tests/rules.rs` read them. No dependency, so that the rules run at once.

use std::fs;
use std::path::{Path, PathBuf};

/// One source file.
pub struct Source {
    /// Where it lies.
    pub path: PathBuf,
    /// All of it.
    pub text: String,
}

impl Source {
    /// The part before the file's unit tests; nothing of a file that only tests compile.
    pub fn code(&self) -> &str {
        let name = self.path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        if name == "reference" || name == "testing" || name == "tests" || name.ends_with("_tests") {
            return "";
        }
        self.text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default()
    }

    /// Lines of code that are not comments.
    pub fn statements(&self) -> impl Iterator<Item = (usize, &str)> {
        self.code().lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"))
    }

    /// What is wrong with a line, as a compiler would print it.
    pub fn complaint(&self, line_idx: usize, problem: &str) -> String {
        format!("{}:{}: {problem}", self.path.display(), line_idx + 1)
    }
}

/// The repository.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All Rust sources below a folder of the repository, by path.
pub fn sources(folder: &str) -> Vec<Source> {
    let mut found = Vec::new();
    let mut pending = vec![workspace().join(folder)];
    while let Some(folder) = pending.pop() {
        for entry in fs::read_dir(&folder).expect("the folder is part of the repository") {
            let path = entry.expect("a readable folder entry").path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).expect("sources are UTF-8");
                found.push(Source { path, text });
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(!found.is_empty(), "no source found in {folder}");
    found
}

/// Fails with all complaints, if there are any.
pub fn check(complaints: Vec<String>) {
    assert!(complaints.is_empty(), "\n{}\n", complaints.join("\n"));
}
