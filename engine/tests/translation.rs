//! The translator as a whole: interruptions, delay, odd input, and what an open run weighs.

#![allow(clippy::unwrap_used)]

use std::io::Read;
use std::path::PathBuf;

use locution_engine::formats::{CarmenOptions, read_carmen_log};
use locution_engine::geometry::Pose2;
use locution_engine::sampling::SamplingConfig;
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, TextBuilder, Word};
use locution_engine::translator::TranslatorConfig;
use locution_engine::translator::{Translation, Translator};
use proptest::prelude::*;

/// Largest stored form of an open run, bytes.
const MAX_STORED_BYTES: usize = 128 << 10;

fn geometry() -> ScanGeometry {
    ScanGeometry {
        num_ranges: 180,
        angle_min_rad: f64::to_radians(-90.0),
        angle_increment_rad: f64::to_radians(1.0),
        range_max_m: 8.0,
        robot_from_laser: Pose2::new(0.1, 0.0, 0.0),
    }
}

/// A drive on a winding line between two walls that come and go.
fn wavy_drive(num_scans: usize, seed: f64) -> Vec<Scan> {
    let scan = |index: usize| {
        let at = index as f64 * 0.07;
        let heading = (at * 0.3 + seed).sin();
        let pose = Pose2::new(at * 0.8, (at * 0.2).cos() + seed, heading);
        let range = |beam: usize| {
            let side = f64::to_radians(beam as f64 - 90.0) + heading;
            let width = 1.2 + 0.9 * ((at * 0.5).sin() > 0.3 * seed) as u8 as f64;
            (width / side.sin().abs().max(0.05)).min(9.0) as f32
        };
        Scan {
            timestamp_ns: index as i64 * 100,
            odom_from_robot: pose,
            ranges_m: (0..180).map(range).collect(),
        }
    };
    (0..num_scans).map(scan).collect()
}

fn translate(mut translator: Translator, scans: &[Scan]) -> Vec<Translation> {
    let mut translations: Vec<Translation> = scans.iter().map(|scan| translator.push(scan)).collect();
    translations.push(translator.finish());
    translations
}

fn observations(translations: &[Translation]) -> Vec<Observation> {
    translations.iter().flat_map(|translation| translation.observations.clone()).collect()
}

fn words(translations: &[Translation]) -> Vec<Word> {
    translations.iter().flat_map(|translation| translation.words.clone()).collect()
}

fn stored_and_loaded(translator: &Translator) -> Translator {
    let bytes = postcard::to_allocvec(translator).unwrap();
    assert!(bytes.len() <= MAX_STORED_BYTES, "an open run takes {} bytes", bytes.len());
    postcard::from_bytes(&bytes).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn an_interrupted_run_goes_on_as_if_it_had_not_been(seed in -1.0..1.0f64, cuts in prop::collection::vec(0..300usize, 1..4)) {
        let scans = wavy_drive(300, seed);
        let start = Translator::new(&TranslatorConfig::default(), geometry()).unwrap();
        let whole = translate(start.clone(), &scans);
        let mut translator = start;
        let mut pieces = Vec::new();
        for (index, scan) in scans.iter().enumerate() {
            if cuts.contains(&index) {
                translator = stored_and_loaded(&translator);
            }
            pieces.push(translator.push(scan));
        }
        pieces.push(stored_and_loaded(&translator).finish());
        prop_assert_eq!(postcard::to_allocvec(&observations(&pieces)).unwrap(), postcard::to_allocvec(&observations(&whole)).unwrap());
        prop_assert_eq!(postcard::to_allocvec(&words(&pieces)).unwrap(), postcard::to_allocvec(&words(&whole)).unwrap());
        prop_assert_eq!(pieces, whole);
    }
}

#[test]
fn the_text_can_be_written_again_from_its_observations() {
    let config = TranslatorConfig::default();
    let whole = translate(Translator::new(&config, geometry()).unwrap(), &wavy_drive(800, 0.2));
    let mut builder = TextBuilder::new(config.quantizer.initial(), &config.text);
    let mut again: Vec<Word> =
        observations(&whole).iter().flat_map(|observation| builder.push(observation)).collect();
    again.extend(builder.finish());
    assert!(again.len() > 10, "only {} words", again.len());
    assert_eq!(again, words(&whole));
}

#[test]
fn observations_are_evenly_spaced_and_complete_with_and_without_delay() {
    let scans = wavy_drive(300, 0.0);
    for delay_m in [0.0, 3.0] {
        let sampling = SamplingConfig { delay_m, ..SamplingConfig::default() };
        let config = TranslatorConfig { sampling, ..TranslatorConfig::default() };
        let observations = observations(&translate(Translator::new(&config, geometry()).unwrap(), &scans));
        for (index, observation) in observations.iter().enumerate() {
            assert!((observation.travel_m - index as f64 * 0.1).abs() < 1e-9);
            assert_eq!(observation.densities.len(), config.density.kernels.len());
            assert!(observation.densities.iter().all(|density| (0.0..=1.0).contains(density)));
        }
        let driven: f64 =
            scans.windows(2).map(|pair| pair[0].odom_from_robot.distance(&pair[1].odom_from_robot)).sum();
        assert!((observations.len() as f64 * 0.1 - driven).abs() < 0.2);
    }
}

#[test]
fn keyframes_are_a_fifth_of_a_meter_apart() {
    let translations =
        translate(Translator::new(&TranslatorConfig::default(), geometry()).unwrap(), &wavy_drive(300, 0.0));
    let keyframes: Vec<_> =
        translations.iter().filter_map(|translation| translation.keyframe.clone()).collect();
    assert_eq!(keyframes[0].scan_seq, 0);
    assert!(
        keyframes.windows(2).all(|pair| pair[0].odom_from_robot.distance(&pair[1].odom_from_robot) < 0.31)
    );
    assert!(keyframes.len() > 60);
}

#[test]
fn no_input_makes_it_panic() {
    let mut translator = Translator::new(&TranslatorConfig::default(), geometry()).unwrap();
    let far = f64::MAX / 4.0;
    for pose in
        [(f64::NAN, 0.0, 0.0), (0.0, 0.0, f64::NAN), (far, -far, 1e300), (1.0, 1.0, 0.0), (-1e12, 3.0, 9.0)]
    {
        for ranges_m in [vec![], vec![f32::NAN; 180], vec![-1.0; 1000], vec![f32::MAX; 180], vec![1e-30; 180]]
        {
            let odom_from_robot = Pose2 { x: pose.0, y: pose.1, theta: pose.2 };
            translator.push(&Scan { timestamp_ns: i64::MIN, odom_from_robot, ranges_m });
        }
    }
    translator.finish();
}

#[test]
fn impossible_lasers_and_configs_are_refused_by_name() {
    let refused = |config: &TranslatorConfig, geometry: ScanGeometry| {
        Translator::new(config, geometry).map(|_| ()).unwrap_err().field
    };
    let defaults = TranslatorConfig::default();
    assert_eq!(refused(&defaults, ScanGeometry { num_ranges: 0, ..geometry() }), "geometry.num_ranges");
    assert_eq!(
        refused(&defaults, ScanGeometry { angle_increment_rad: 0.0, ..geometry() }),
        "geometry.angle_increment_rad"
    );
    assert_eq!(
        refused(&defaults, ScanGeometry { range_max_m: f64::NAN, ..geometry() }),
        "geometry.range_max_m"
    );
    let mut late = defaults;
    late.sampling.delay_m = 6.0;
    assert_eq!(refused(&late, geometry()), "translator.sampling.delay_m");
}

#[test]
fn a_real_run_survives_interruption_every_hundred_scans() {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/datasets");
    let folder = std::env::var_os("LOCUTION_DATASETS").map_or(beside, PathBuf::from);
    let Ok(file) = std::fs::File::open(folder.join("laser/aces.log.gz")) else {
        println!("skipped: no datasets at {}", folder.display());
        return;
    };
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).unwrap();
    let log = read_carmen_log(text.lines(), &CarmenOptions::default()).unwrap();
    let start = Translator::new(&TranslatorConfig::default(), log.geometry).unwrap();
    let whole = translate(start.clone(), &log.scans);
    let mut translator = start;
    let mut pieces = Vec::new();
    for (index, scan) in log.scans.iter().enumerate() {
        if index % 100 == 99 {
            translator = stored_and_loaded(&translator);
        }
        pieces.push(translator.push(scan));
    }
    pieces.push(translator.finish());
    assert!(pieces == whole, "the interrupted run differs");
}
