//! From scans to observations and words, per core, beside the algorithms as the thesis prints them.
//!
//! `cargo bench -p locution-engine --bench translation`. The synthetic scans come from a corridor with doors; with the
//! datasets at hand (`LOCUTION_DATASETS`, else `../../shared/datasets`) the recording `intel` is translated as well.

#![allow(missing_docs)]
#![allow(clippy::unwrap_used)]

#[path = "../tests/as_printed/literal/mod.rs"]
mod literal;

use std::hint::black_box;
use std::io::Read;
use std::path::PathBuf;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use literal::density::{Content, literal_flood, literal_groups};
use literal::local_map::LiteralMap;
use locution_engine::density::{DensityConfig, DensityEstimator, KernelConfig};
use locution_engine::formats::{CarmenOptions, read_carmen_log};
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::grid::{LocalMap, LocalMapConfig};
use locution_engine::sampling::SamplingConfig;
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::translator::Translator;
use locution_engine::translator::{OdometrySource, TranslatorConfig};

fn geometry() -> ScanGeometry {
    ScanGeometry {
        num_ranges: 180,
        angle_min_rad: f64::to_radians(-90.0),
        angle_increment_rad: f64::to_radians(1.0),
        range_max_m: 50.0,
        robot_from_laser: Pose2::identity(),
    }
}

/// Walls of a corridor 2.4 m wide and 60 m long, with a door of 0.9 m to a room of 4 m every 5 m on both sides.
fn walls() -> Vec<(Point2, Point2)> {
    let mut walls = Vec::new();
    let mut wall =
        |ax: f64, ay: f64, bx: f64, by: f64| walls.push((Point2::new(ax, ay), Point2::new(bx, by)));
    wall(-1.0, -1.2, -1.0, 1.2);
    wall(61.0, -1.2, 61.0, 1.2);
    for room in 0..12 {
        let x = f64::from(room) * 5.0;
        for side in [-1.0, 1.0] {
            wall(x - 1.0, side * 1.2, x + 2.0, side * 1.2);
            wall(x + 2.9, side * 1.2, x + 4.0, side * 1.2);
            wall(x, side * 1.2, x, side * 5.2);
            wall(x, side * 5.2, x + 4.8, side * 5.2);
            wall(x + 4.8, side * 1.2, x + 4.8, side * 5.2);
        }
    }
    walls
}

fn range_m(from: &Pose2, direction_rad: f64, walls: &[(Point2, Point2)]) -> f32 {
    let (sin, cos) = (from.theta + direction_rad).sin_cos();
    let mut nearest = 50.0;
    for (a, b) in walls {
        let (ex, ey) = (b.x - a.x, b.y - a.y);
        let (wx, wy) = (a.x - from.x, a.y - from.y);
        let across = cos * ey - sin * ex;
        let (along_ray, along_wall) = ((wx * ey - wy * ex) / across, (wx * sin - wy * cos) / across);
        if along_ray > 0.0 && (0.0..=1.0).contains(&along_wall) && along_ray < nearest {
            nearest = along_ray;
        }
    }
    nearest as f32
}

/// A thousand scans along the corridor, 6 cm apart, swaying a little.
fn corridor_scans() -> Vec<Scan> {
    let (walls, geometry) = (walls(), geometry());
    let scan = |index: i64| {
        let at = index as f64 * 0.06;
        let pose = Pose2::new(at, 0.3 * (at * 0.7).sin(), 0.2 * (at * 0.7).cos());
        let ranges_m = (0..180).map(|beam| range_m(&pose, geometry.beam_angle_rad(beam), &walls)).collect();
        Scan { timestamp_ns: index, odom_from_robot: pose, ranges_m }
    };
    (0..1000).map(scan).collect()
}

fn intel() -> Option<(ScanGeometry, Vec<Scan>)> {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/datasets");
    let folder = std::env::var_os("LOCUTION_DATASETS").map_or(beside, PathBuf::from);
    let file = std::fs::File::open(folder.join("laser/intel.log.gz")).ok()?;
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).unwrap();
    let log = read_carmen_log(text.lines(), &CarmenOptions::default()).unwrap();
    Some((log.geometry, log.scans))
}

/// The setting of the project's speed target: odometry as sent, one kernel of 4 m, observed at once.
fn one_kernel() -> TranslatorConfig {
    TranslatorConfig {
        odometry: OdometrySource::Raw,
        density: DensityConfig { kernels: vec![KernelConfig::uniform(4.0)], ..DensityConfig::default() },
        sampling: SamplingConfig { delay_m: 0.0, ..SamplingConfig::default() },
        ..TranslatorConfig::default()
    }
}

fn translate(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("scan_to_words");
    let mut add = |name: &str, config: &TranslatorConfig, geometry: &ScanGeometry, scans: &[Scan]| {
        let start = Translator::new(config, geometry.clone()).unwrap();
        group.throughput(Throughput::Elements(scans.len() as u64));
        group.bench_function(name, |bencher| {
            bencher.iter_batched(
                || start.clone(),
                |mut translator| {
                    for scan in scans {
                        black_box(translator.push(scan));
                    }
                    translator
                },
                BatchSize::LargeInput,
            );
        });
    };
    let scans = corridor_scans();
    add("corridor/raw odometry, one 4 m kernel", &one_kernel(), &geometry(), &scans);
    add("corridor/defaults", &TranslatorConfig::default(), &geometry(), &scans);
    match intel() {
        Some((geometry, scans)) => {
            add("intel/raw odometry, one 4 m kernel", &one_kernel(), &geometry, &scans[2000..4000]);
            add("intel/defaults", &TranslatorConfig::default(), &geometry, &scans[2000..4000]);
        }
        None => println!("skipped: the recording intel is not there"),
    }
    group.finish();
}

fn local_map(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("local_map");
    let (scans, config) = (corridor_scans(), LocalMapConfig::default());
    group.throughput(Throughput::Elements(100));
    group.bench_function("fast, 100 scans", |bencher| {
        let mut map = LocalMap::new(&config, &geometry());
        bencher.iter(|| {
            for scan in &scans[400..500] {
                map.integrate_scan(&scan.ranges_m, &scan.odom_from_robot);
            }
        });
    });
    group.throughput(Throughput::Elements(1));
    group.sample_size(10);
    group.bench_function("as printed, 1 scan", |bencher| {
        let mut map = LiteralMap::new(&config, &geometry());
        bencher.iter(|| map.integrate_scan(&scans[400].ranges_m, &scans[400].odom_from_robot));
    });
    group.finish();
}

fn density(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("density");
    let config = LocalMapConfig::default();
    let mut map = LocalMap::new(&config, &geometry());
    for scan in &corridor_scans()[300..500] {
        map.integrate_scan(&scan.ranges_m, &scan.odom_from_robot);
    }
    let center = map.robot_cell().unwrap();
    for (name, kernels) in [
        ("one 4 m kernel", vec![KernelConfig::uniform(4.0)]),
        ("default kernels", DensityConfig::default().kernels),
    ] {
        let kernel_config = DensityConfig { kernels, ..DensityConfig::default() };
        let estimator = DensityEstimator::new(&kernel_config, config.resolution_m);
        group.bench_function(format!("fast, {name}"), |bencher| {
            bencher.iter(|| estimator.estimate(black_box(&map), center));
        });
    }
    let content = |cell| match (map.is_free(cell), map.is_occupied(cell)) {
        (true, _) => Content::Free,
        (_, true) => Content::Occupied,
        _ => Content::Unknown,
    };
    group.bench_function("as printed, one 4 m kernel", |bencher| {
        bencher.iter(|| {
            let (soft, unknown, border) = literal_flood(content, center, &KernelConfig::uniform(4.0), 0.1);
            (soft, literal_groups(unknown, 12.6), literal_groups(border, 12.6))
        });
    });
    group.finish();
}

criterion_group!(benches, translate, local_map, density);
criterion_main!(benches);
