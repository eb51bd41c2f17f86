//! Labels recordings and judges the labels: the thesis' decision tree, and the labels of places of the map, at the
//! poses of the truth and at those of the run alone.
//!
//! `cargo run --release -p locution-engine --example label_recordings -- DATASETS NAME...`

use std::io::Read;
use std::path::Path;

use locution_engine::config::TranslatorConfig;
use locution_engine::evaluation::{LabelledObservation, OdometryPose, join_truth, judge_labels};
use locution_engine::formats::{CarmenOptions, LabelledPlaces, parse_truth, read_carmen_log};
use locution_engine::geometry::Pose2;
use locution_engine::mapping::{Keyframe, RunRecord};
use locution_engine::semantics::{
    DecisionTreeConfig, DrivenRun, PlaceLabel, SemanticsConfig, label_by_tree, label_runs,
};
use locution_engine::text::Observation;
use locution_engine::translator::Translator;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let datasets = arguments.next().expect("the folder of the datasets");
    for name in arguments {
        judge(Path::new(&datasets), &name);
    }
}

fn unzipped(path: &Path) -> String {
    let file = std::fs::File::open(path).expect("a recording");
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("gzip of text");
    text
}

fn judge(datasets: &Path, name: &str) {
    let log = unzipped(&datasets.join(format!("laser/{name}.log.gz")));
    let log = read_carmen_log(log.lines(), CarmenOptions::default()).expect("a CARMEN log");
    let truth = parse_truth(&unzipped(&datasets.join(format!("laser/{name}.truth.gz")))).expect("a truth");
    let places = std::fs::read_to_string(datasets.join(format!("labels/{name}.json"))).expect("labels");
    let places: LabelledPlaces = serde_json::from_str(&places).expect("labelled regions");

    let mut translator =
        Translator::new(&TranslatorConfig::default(), log.geometry.clone()).expect("the default config");
    let (mut observations, mut keyframes): (Vec<Observation>, Vec<Keyframe>) = Default::default();
    for scan in &log.scans {
        let translation = translator.push(scan);
        observations.extend(translation.observations);
        keyframes.extend(translation.keyframe.map(|pose| Keyframe {
            scan_seq: pose.scan_seq,
            timestamp_ns: pose.timestamp_ns,
            odom_from_robot: pose.odom_from_robot,
            run_from_robot: pose.run_from_robot,
            motion_covariance: pose.motion_covariance,
            ranges_m: scan.ranges_m.clone(),
        }));
    }
    observations.extend(translator.finish().observations);

    let scans: Vec<OdometryPose> = log
        .scans
        .iter()
        .map(|scan| OdometryPose { timestamp_ns: scan.timestamp_ns, odom_from_robot: scan.odom_from_robot })
        .collect();
    let truth = join_truth(&scans, &truth);
    let true_pose = |scan_seq: u64| truth[scan_seq as usize].unwrap_or_default();
    let actual: Vec<Option<&str>> = observations
        .iter()
        .map(|observation| {
            let here = true_pose(observation.scan_seq).position();
            truth[observation.scan_seq as usize].and_then(|_| places.label_at(&here))
        })
        .collect();
    let report = |title: &str, labels: &[PlaceLabel]| {
        let judged: Vec<LabelledObservation<'_>> = observations
            .iter()
            .zip(&actual)
            .zip(labels)
            .map(|((observation, actual), label)| LabelledObservation {
                travel_m: observation.travel_m,
                actual: *actual,
                predicted: Some(label.name()),
            })
            .collect();
        let report = judge_labels(&[judged]);
        println!("{name}, {title}");
        for (label, score) in &report.labels {
            let (precision, recall) = (100.0 * score.precision, 100.0 * score.recall);
            println!(
                "  {label:12} {precision:5.1} {recall:5.1}  ({})  {:?}",
                score.support,
                report.confusion.get(label)
            );
        }
    };
    report("tree", &label_by_tree(&DecisionTreeConfig::default(), &observations));
    let record =
        RunRecord { geometry: &log.geometry, observations: &observations, words: &[], keyframes: &keyframes };
    let at_truth: Vec<Pose2> = keyframes.iter().map(|keyframe| true_pose(keyframe.scan_seq)).collect();
    let alone: Vec<Pose2> = keyframes.iter().map(|keyframe| keyframe.run_from_robot).collect();
    for (title, poses) in [("places at true poses", at_truth), ("places of the run alone", alone)] {
        let labelled = label_runs(&SemanticsConfig::default(), &[DrivenRun::in_map(&record, &poses)]);
        report(title, &labelled[0].labels);
    }
}
