//! Recordings from files: CARMEN logs and what goes with them, plain or gzipped.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use anyhow::{Context, Result};
use flate2::bufread::MultiGzDecoder;
use locution_engine::formats::{
    CarmenLog, CarmenOptions, CarmenReader, Relation, TruthPose, parse_relations, parse_truth,
};

/// A log and the name its run gets.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The file's name without folder and endings, in the characters that names of runs may have.
    pub name: String,
    /// What the file holds.
    pub log: CarmenLog,
}

/// Reads a CARMEN log.
///
/// # Errors
/// A file that cannot be read, or a line that cannot be understood, with its number.
pub fn read_recording(path: &Path, options: CarmenOptions) -> Result<Recording> {
    let mut reader = CarmenReader::new(options);
    let mut input = open(path)?;
    let mut line = Vec::new();
    let in_file = || path.display().to_string();
    while input.read_until(b'\n', &mut line).with_context(in_file)? > 0 {
        // Old logs have host names and comments in all sorts of encodings; numbers are plain everywhere.
        let text = String::from_utf8_lossy(&line);
        reader.push_line(text.trim_end_matches(['\n', '\r'])).with_context(in_file)?;
        line.clear();
    }
    Ok(Recording { name: run_name(path), log: reader.finish().with_context(in_file)? })
}

/// Reads true poses.
///
/// # Errors
/// As [`read_recording`].
pub fn read_truth(path: &Path) -> Result<Vec<TruthPose>> {
    parse_truth(&read_text(path)?).with_context(|| path.display().to_string())
}

/// Reads relations.
///
/// # Errors
/// As [`read_recording`].
pub fn read_relations(path: &Path) -> Result<Vec<Relation>> {
    parse_relations(&read_text(path)?).with_context(|| path.display().to_string())
}

/// A whole text file, plain or gzipped.
///
/// # Errors
/// A file that cannot be read or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    let mut text = String::new();
    open(path)?.read_to_string(&mut text).with_context(|| path.display().to_string())?;
    Ok(text)
}

/// Gzip is recognised by its first two bytes, whatever the file is called.
fn open(path: &Path) -> Result<Box<dyn BufRead>> {
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let mut plain = BufReader::with_capacity(1 << 16, file);
    let is_gzip = plain.fill_buf().with_context(|| path.display().to_string())?.starts_with(&[0x1f, 0x8b]);
    Ok(if is_gzip {
        Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(plain)))
    } else {
        Box::new(plain)
    })
}

fn run_name(path: &Path) -> String {
    let file_name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = [".gz", ".log", ".clf", ".carmen", ".txt"]
        .iter()
        .fold(file_name.as_ref(), |name, ending| name.strip_suffix(ending).unwrap_or(name));
    let allowed = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '-' };
    let name: String = stem.trim_start_matches('.').chars().map(allowed).take(64).collect();
    if name.is_empty() { "run".into() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_named_after_their_files() {
        for (file, name) in [
            ("/data/laser/intel.log.gz", "intel"),
            ("first floor (1).clf", "first-floor--1-"),
            (".log", "run"),
            ("wean1.log", "wean1"),
        ] {
            assert_eq!(run_name(Path::new(file)), name);
        }
    }
}
