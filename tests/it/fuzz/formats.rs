//! Readers of files: whatever they take must be whole, and must come back as it was written.

use locution_engine::formats::{
    CarmenOptions, parse_map_server_yaml, parse_pgm, read_carmen_log, read_g2o, read_toro, write_g2o,
    write_pgm, write_toro,
};

use super::Inputs;

#[test]
fn carmen_logs() {
    for input in Inputs::of("carmen", 4_000) {
        let text = String::from_utf8_lossy(&input);
        for skip_malformed in [false, true] {
            let options = CarmenOptions { skip_malformed, ..CarmenOptions::default() };
            let Ok(log) = read_carmen_log(text.lines(), &options) else { continue };
            assert!(!log.scans.is_empty() && log.geometry.num_ranges > 0);
            assert!(log.geometry.range_max_m > 0.0 && log.geometry.range_max_m.is_finite());
            for scan in &log.scans {
                assert_eq!(scan.ranges_m.len(), log.geometry.num_ranges);
                let pose = scan.odom_from_robot;
                assert!(pose.x.is_finite() && pose.y.is_finite() && pose.theta.is_finite());
            }
        }
    }
}

#[test]
fn g2o_graphs() {
    for input in Inputs::of("g2o", 4_000) {
        let Ok(mut document) = read_g2o(&String::from_utf8_lossy(&input)) else { continue };
        document.passed_over.clear();
        let again = read_g2o(&write_g2o(&document)).expect("what was read can be read again");
        assert!(again == document, "{document:?}\n{again:?}");
    }
}

#[test]
fn toro_graphs() {
    for input in Inputs::of("toro", 4_000) {
        let Ok(mut document) = read_toro(&String::from_utf8_lossy(&input)) else { continue };
        document.passed_over.clear();
        let again = read_toro(&write_toro(&document)).expect("what was read can be read again");
        assert!(again == document, "{document:?}\n{again:?}");
    }
}

#[test]
fn pages_of_map_server() {
    for input in Inputs::of("yaml", 4_000) {
        let Ok(page) = parse_map_server_yaml(&String::from_utf8_lossy(&input)) else { continue };
        assert!(page.resolution_m > 0.0 && page.resolution_m.is_finite());
        let pose = page.map_from_image;
        assert!(pose.x.is_finite() && pose.y.is_finite() && pose.theta.is_finite());
        for gray in [0, 1, 127, 254, 255] {
            assert!(page.occupancy(gray, 255).is_none_or(|occupancy| occupancy <= 100));
        }
    }
}

#[test]
fn pictures_of_map_server() {
    for input in Inputs::of("pgm", 4_000) {
        let Ok(image) = parse_pgm(&input) else { continue };
        assert_eq!(parse_pgm(&write_pgm(&image)).expect("what was read can be read again"), image);
    }
}
