//! The readers on the real recordings, where they are at hand.

#![allow(clippy::unwrap_used)]

use std::collections::HashSet;
use std::io::Read;
use std::path::PathBuf;

use locution_engine::formats::{CarmenOptions, parse_relations, parse_truth, read_carmen_log};

fn datasets() -> Option<PathBuf> {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/datasets");
    let folder = std::env::var_os("LOCUTION_DATASETS").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no datasets at {}", folder.display());
    None
}

fn gunzipped(path: PathBuf) -> String {
    let mut text = String::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_string(&mut text).unwrap();
    text
}

#[test]
fn every_recording_reads_with_its_documented_shape() {
    let Some(folder) = datasets() else { return };
    for (name, num_scans, num_ranges, range_max_m, laser_ahead_m) in [
        ("laser/aces", 7374, 180, 50.0, 0.0),
        ("laser/intel", 13631, 180, 81.83, 0.0),
        ("laser/mit-killian", 17480, 180, 51.06, 0.0),
        ("laser/wean1", 713, 180, 81.83, 0.25),
        ("laser/wean3", 1241, 180, 81.87, 0.25),
        ("laser/wean4", 600, 180, 81.87, 0.25),
        ("laser/mines-exp1", 756, 682, 4.0, 0.145),
        ("laser/mines-exp2", 641, 682, 4.0, 0.145),
        ("laser/duke-loop5", 551, 181, 8.183, 0.0),
        ("laser_corrected/acapulco", 861, 181, 50.0, 0.0),
        ("laser_corrected/edmonton", 340, 180, 51.1, 0.0),
        ("laser_corrected/fhw", 488, 180, 51.05, 0.0),
        ("laser_corrected/fr-campus", 2008, 360, 81.83, 0.0),
    ] {
        let text = gunzipped(folder.join(format!("{name}.log.gz")));
        let log = read_carmen_log(text.lines(), &CarmenOptions::default()).unwrap();
        assert_eq!((log.scans.len(), log.geometry.num_ranges), (num_scans, num_ranges), "{name}");
        assert!((log.geometry.range_max_m - range_max_m).abs() < 0.02, "{name}: {:?}", log.geometry);
        let mounting = log.geometry.robot_from_laser;
        assert!(
            (mounting.x - laser_ahead_m).abs() < 0.005 && mounting.y.abs() < 0.005,
            "{name}: {mounting:?}"
        );
    }
}

#[test]
fn truth_and_relations_name_scans_of_their_log() {
    let Some(folder) = datasets() else { return };
    for (name, num_truth, num_relations) in [
        ("aces", 440, Some(1279)),
        ("intel", 910, Some(2984)),
        ("mit-killian", 1941, Some(4677)),
        ("wean1", 216, None),
        ("wean3", 271, None),
        ("wean4", 122, None),
    ] {
        let text = gunzipped(folder.join(format!("laser/{name}.log.gz")));
        let log = read_carmen_log(text.lines(), &CarmenOptions::default()).unwrap();
        let times: HashSet<i64> = log.scans.iter().map(|scan| scan.timestamp_ns).collect();
        let truth = parse_truth(&gunzipped(folder.join(format!("laser/{name}.truth.gz")))).unwrap();
        assert_eq!(truth.len(), num_truth, "{name}");
        assert!(truth.iter().all(|pose| times.contains(&pose.timestamp_ns)), "{name}");
        let Some(num_relations) = num_relations else { continue };
        let relations =
            parse_relations(&gunzipped(folder.join(format!("relations/{name}.relations.gz")))).unwrap();
        assert_eq!(relations.len(), num_relations, "{name}");
        let known =
            relations.iter().filter(|it| times.contains(&it.first_ns) && times.contains(&it.second_ns));
        println!("{name}: {} of {num_relations} relations join two scans", known.count());
    }
}
