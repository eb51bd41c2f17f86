//! Files of others: whatever stands in them, they are read or refused, and what was read can be written and read again.

use bolero::check;
use locution_engine::formats::{
    CarmenOptions, GraphDocument, GraphTextError, parse_map_server_yaml, parse_pgm, parse_relations,
    parse_truth, read_carmen_log, read_g2o, read_toro, truth_text, write_g2o, write_pgm, write_toro,
};
use locution_engine::geometry::Pose2;
use locution_engine::pose_graph::{PoseGraphConfig, optimize};
use locution_fuzz::{Edit, TEST_TIME, edited};

fn text(seed: &[u8], edits: &[Edit]) -> String {
    String::from_utf8_lossy(&edited(seed, edits)).into_owned()
}

#[test]
fn carmen() {
    let seeds: [&[u8]; 2] =
        [include_bytes!("../seeds/carmen/flaser.log"), include_bytes!("../seeds/carmen/robotlaser.log")];
    check!().with_type::<(bool, bool, Vec<Edit>)>().with_test_time(TEST_TIME).for_each(
        |(is_newer, skip_malformed, edits)| {
            let text = text(seeds[usize::from(*is_newer)], edits);
            let options = CarmenOptions { skip_malformed: *skip_malformed, ..Default::default() };
            let Ok(log) = read_carmen_log(text.lines(), &options) else { return };
            assert!(!log.scans.is_empty(), "a log without a scan");
            for scan in &log.scans {
                let at = scan.odom_from_robot;
                assert!(at.x.is_finite() && at.y.is_finite() && at.theta.is_finite(), "{at:?}");
                assert!(scan.ranges_m.len() <= log.geometry.num_ranges);
            }
        },
    );
}

/// What was read says the same after it was written and read again.
fn comes_back(
    text: &str,
    read: impl Fn(&str) -> Result<GraphDocument, GraphTextError>,
    write: impl Fn(&GraphDocument) -> String,
) {
    let Ok(document) = read(text) else { return };
    let written = write(&document);
    match read(&written) {
        Ok(again) => {
            assert_eq!(again.ids, document.ids);
            assert_eq!(again.graph.constraints().len(), document.graph.constraints().len());
            assert_eq!(write(&again), written);
            let mut graph = again.graph;
            if optimize(&mut graph, &PoseGraphConfig::default()).is_ok() {
                let is_finite =
                    |pose: &Pose2| [pose.x, pose.y, pose.theta].iter().all(|number| number.is_finite());
                assert!(graph.poses().iter().all(is_finite), "optimized to nothing\n{written}");
            }
        }
        Err(error) => panic!("what was written is refused: {error}\n{written}"),
    }
}

#[test]
fn g2o() {
    let seed = include_bytes!("../seeds/g2o/square.g2o");
    check!().with_type::<Vec<Edit>>().with_test_time(TEST_TIME).for_each(|edits| {
        comes_back(&text(seed, edits), read_g2o, write_g2o);
    });
}

#[test]
fn toro() {
    let seed = include_bytes!("../seeds/toro/square.graph");
    check!().with_type::<Vec<Edit>>().with_test_time(TEST_TIME).for_each(|edits| {
        comes_back(&text(seed, edits), read_toro, write_toro);
    });
}

#[test]
fn map_server_yaml() {
    let seed = include_bytes!("../seeds/yaml/map.yaml");
    check!().with_type::<Vec<Edit>>().with_test_time(TEST_TIME).for_each(|edits| {
        let Ok(page) = parse_map_server_yaml(&text(seed, edits)) else { return };
        assert!(page.resolution_m.is_finite() && page.resolution_m > 0.0, "{page:?}");
    });
}

#[test]
fn pgm() {
    let seeds: [&[u8]; 2] =
        [include_bytes!("../seeds/pgm/text.pgm"), include_bytes!("../seeds/pgm/bytes.pgm")];
    check!().with_type::<(bool, Vec<Edit>)>().with_test_time(TEST_TIME).for_each(|(is_binary, edits)| {
        let Ok(image) = parse_pgm(&edited(seeds[usize::from(*is_binary)], edits)) else { return };
        assert_eq!(parse_pgm(&write_pgm(&image)).as_ref(), Ok(&image));
    });
}

#[test]
fn truth_and_relations() {
    let seed = include_bytes!("../seeds/carmen/truth.txt");
    check!().with_type::<Vec<Edit>>().with_test_time(TEST_TIME).for_each(|edits| {
        let text = text(seed, edits);
        let _ = parse_relations(&text);
        if let Ok(poses) = parse_truth(&text) {
            let written = truth_text(&poses);
            let again = parse_truth(&written).map(|poses| truth_text(&poses));
            assert_eq!(again.as_deref(), Ok(written.as_str()));
        }
    });
}
