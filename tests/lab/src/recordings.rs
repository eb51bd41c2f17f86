//! Recordings from files: CARMEN logs and what goes with them, plain or gzipped.

use std::io::{BufRead, Read};
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use locution_engine::formats::{
    CarmenLog, CarmenOptions, CarmenReader, FormatError, Relation, TruthPose, parse_relations, parse_truth,
};

use super::unpacked::{is_damage, open_unpacked};

/// A log and the name its run gets.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The file's name without folder and endings, in the characters that names of runs may have.
    pub name: String,
    /// What the file holds.
    pub log: CarmenLog,
}

/// Reads a CARMEN log. Where the options pass over malformed lines, a packed file that is cut off or damaged is read
/// as far as it goes.
///
/// # Errors
/// A file that cannot be read, or a line that cannot be understood, with its number.
pub fn read_recording(path: &Path, options: CarmenOptions) -> Result<Recording> {
    let mut reader = CarmenReader::new(options);
    let mut input = open_unpacked(path)?;
    let mut line = Vec::new();
    let in_file = || path.display().to_string();
    let (mut num_lines, mut damage) = (0, None);
    while damage.is_none() {
        match input.read_until(b'\n', &mut line) {
            Ok(0) => break,
            Ok(_) => {}
            Err(error) if is_damage(&error) && options.skip_malformed => damage = Some(error),
            Err(error) if is_damage(&error) => {
                let hint = anyhow!("{error}; --skip-malformed takes what comes before");
                return Err(hint).with_context(in_file);
            }
            Err(error) => return Err(error).with_context(in_file),
        }
        num_lines += 1;
        // Old logs have host names and comments in all sorts of encodings; numbers are plain everywhere.
        let text = String::from_utf8_lossy(&line);
        reader.push_line(text.trim_end_matches(['\n', '\r'])).with_context(in_file)?;
        line.clear();
    }
    let mut log = reader.finish().with_context(in_file)?;
    log.skipped.extend(damage.map(|error| FormatError::new(num_lines, error.to_string())));
    Ok(Recording { name: run_name(path), log })
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

/// A whole text file, plain or gzipped. What is not UTF-8, as in the comments of old files, is replaced.
///
/// # Errors
/// A file that cannot be read.
pub fn read_text(path: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    open_unpacked(path)?.read_to_end(&mut bytes).with_context(|| path.display().to_string())?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
}

/// The name that the run of a recording gets: that of the file without its endings, in the characters that names of runs
/// may have.
pub fn run_name(path: &Path) -> String {
    let file_name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = [".gz", ".log", ".clf", ".carmen", ".txt", ".mcap", ".bag"]
        .iter()
        .fold(file_name.as_ref(), |name, ending| name.strip_suffix(ending).unwrap_or(name));
    let allowed = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '-' };
    let name: String = stem.trim_start_matches('.').chars().map(allowed).take(64).collect();
    if name.is_empty() { "run".into() } else { name }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    /// Five scans, packed.
    fn packed_log() -> Vec<u8> {
        packed_log_of(5)
    }

    fn packed_log_of(num_scans: usize) -> Vec<u8> {
        let line = |time: usize| {
            let readings: Vec<String> = (0..181)
                .map(|beam| format!("{:.3}", 1.0 + ((beam * 7919 + time * 104_729) % 9973) as f64 * 1e-3))
                .collect();
            format!("FLASER 181 {} 0 0 0 0 0 0 {time}.0 host {time}.0\n", readings.join(" "))
        };
        let text: String = (0..num_scans).map(line).collect();
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packer.write_all(text.as_bytes()).unwrap();
        packer.finish().unwrap()
    }

    fn read(bytes: &[u8], skip_malformed: bool) -> Result<Recording> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(bytes).unwrap();
        read_recording(file.path(), CarmenOptions { skip_malformed, ..CarmenOptions::default() })
    }

    #[test]
    fn zeros_after_the_end_are_no_error_and_parts_are_read_one_after_the_other() {
        let packed = packed_log();
        let padded = [packed.clone(), vec![0; 700]].concat();
        assert_eq!(read(&padded, false).unwrap().log.scans.len(), 5);
        let parts = [padded, packed.clone(), packed].concat();
        assert_eq!(read(&parts, false).unwrap().log.scans.len(), 15);
    }

    #[test]
    fn a_file_that_is_cut_off_is_read_as_far_as_it_goes_if_that_is_asked_for() {
        let mut packed = packed_log_of(80);
        packed.truncate(packed.len() * 3 / 4);
        let error = format!("{:#}", read(&packed, false).unwrap_err());
        assert!(error.contains("cut off") && error.contains("--skip-malformed"), "{error}");
        let log = read(&packed, true).unwrap().log;
        assert!((40..80).contains(&log.scans.len()), "{}", log.scans.len());
        assert!(log.skipped.last().unwrap().problem.contains("cut off"), "{:?}", log.skipped);
    }

    #[test]
    fn what_follows_the_packed_data_is_told() {
        let followed = [packed_log(), b"a note".to_vec()].concat();
        assert!(format!("{:#}", read(&followed, false).unwrap_err()).contains("other bytes"));
        assert_eq!(read(&followed, true).unwrap().log.scans.len(), 5);
    }

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
