//! The fast local map agrees with Algorithm 2.2 as printed, on random drives past random readings.

use std::f64::consts::PI;

use crate::literal::local_map::LiteralMap;
use locution_engine::geometry::Pose2;
use locution_engine::grid::{LocalMap, LocalMapConfig};
use locution_engine::scan::ScanGeometry;
use proptest::prelude::*;

fn geometries() -> impl Strategy<Value = ScanGeometry> {
    let beams = [
        (180, -90.0, 1.0),
        (181, -90.0, 1.0),
        (360, -90.0, 0.5),
        (360, -180.0, 1.0),
        (361, -180.0, 1.0),
        (682, -119.9, 0.3516),
        (1440, 0.0, 0.25),
        (37, 90.0, -5.0),
    ];
    (prop::sample::select(beams.to_vec()), -0.3..0.3f64, -0.3..0.3f64, -PI..PI, 1.5..6.0f64).prop_map(
        |((num_ranges, first_deg, increment_deg), x, y, theta, range_max_m)| ScanGeometry {
            num_ranges,
            angle_min_rad: f64::to_radians(first_deg),
            angle_increment_rad: f64::to_radians(increment_deg),
            range_max_m,
            robot_from_laser: Pose2::new(x, y, theta),
        },
    )
}

/// Readings that vary slowly, with faults and missing returns between them.
fn ranges(num_ranges: usize) -> impl Strategy<Value = Vec<f32>> {
    let reading = prop_oneof![
        12 => (0.0..1.0f32).prop_map(|noise| 0.2 + 3.8 * noise),
        1 => Just(f32::NAN),
        1 => Just(f32::INFINITY),
        1 => Just(0.0f32),
    ];
    prop::collection::vec(reading, 12).prop_map(move |coarse| {
        (0..num_ranges)
            .map(|beam| coarse[beam * 12 / num_ranges] * (1.0 + 0.01 * (beam % 7) as f32))
            .collect()
    })
}

fn drives() -> impl Strategy<Value = (ScanGeometry, Vec<(Vec<f32>, Pose2)>)> {
    geometries().prop_flat_map(|geometry| {
        let step = (ranges(geometry.num_ranges), -0.7..0.7f64, -0.7..0.7f64, -0.5..0.5f64);
        let steps = prop::collection::vec(step, 1..8).prop_map(|steps| {
            let mut pose = Pose2::new(-3.03, 17.77, 0.3);
            let drive = |(ranges, x, y, theta)| {
                pose = pose.compose(&Pose2::new(x, y, theta));
                (ranges, pose)
            };
            steps.into_iter().map(drive).collect()
        });
        (Just(geometry), steps)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn the_fast_map_agrees_with_the_printed_algorithm((geometry, drive) in drives()) {
        let config = LocalMapConfig { radius_m: 2.5, ..LocalMapConfig::default() };
        let mut fast = LocalMap::new(&config, &geometry);
        let mut literal = LiteralMap::new(&config, &geometry);
        for (ranges, pose) in &drive {
            fast.integrate_scan(ranges, pose);
            literal.integrate_scan(ranges, pose);
            let robot = fast.robot_cell().unwrap();
            for dy in -40..=40 {
                for dx in -40..=40 {
                    let cell = robot.offset(dx, dy);
                    if !literal.ties.contains(&cell) {
                        prop_assert_eq!(fast.occupancy(cell), literal.occupancy(cell), "at {:?} of {:?}", cell, robot);
                    }
                }
            }
        }
        let total = 81.0 * 81.0;
        prop_assert!(literal.ties.len() as f64 / total < 0.1, "too many ties to prove anything");
        let stored = serde_json::to_string(&fast).unwrap();
        let loaded: LocalMap = serde_json::from_str(&stored).unwrap();
        prop_assert_eq!(serde_json::to_string(&loaded).unwrap(), stored);
    }
}
