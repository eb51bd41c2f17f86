//! Localisation on a map of 2000 × 2000 cells of 0.1 m: building its fields, and one update of 40,000 particles.
//!
//! The map is an office of rooms on corridors with two thirds of its cells free. `spread` particles stand all over it,
//! as after power-on; `gathered` ones within a metre, as when tracking; each update starts from the same ones. One core:
//! run with `RAYON_NUM_THREADS=1`.

use std::f64::consts::PI;

use criterion::{Criterion, criterion_group, criterion_main};
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::locate::LikelihoodFieldConfig;
use locution_engine::occupancy::{CellState, GridMap};
use locution_lab::density_field::{DensityField, DensityFieldConfig, observe};
use locution_lab::particle_filter::{
    DensityModel, DensityModelConfig, FieldMap, LikelihoodFieldModel, ParticleFilter, ParticleFilterConfig,
    SensorModel,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIDE: i64 = 2000;

/// Corridors of 2.4 m every 14.4 m, rooms of 4 to 7 m between them, with doors of 1 m and some furniture.
fn office() -> GridMap {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut map = GridMap::unknown(SIDE as usize, SIDE as usize, 0.1, Point2::default());
    let fill = |map: &mut GridMap, columns: std::ops::Range<i64>, rows: std::ops::Range<i64>, state| {
        for row in rows {
            columns.clone().for_each(|column| map.set(column, row, state));
        }
    };
    fill(&mut map, 0..SIDE, 0..SIDE, CellState::Occupied);
    for bottom in (2..SIDE - 150).step_by(144) {
        fill(&mut map, 2..SIDE - 2, bottom..bottom + 24, CellState::Free);
        let mut left = 2;
        while left + 72 < SIDE - 2 {
            let right = left + rng.random_range(40..70);
            for (low, high, door) in
                [(bottom + 26, bottom + 83, bottom + 24), (bottom + 85, bottom + 142, bottom + 142)]
            {
                fill(&mut map, left..right, low..high, CellState::Free);
                let at = rng.random_range(left..right - 10);
                fill(&mut map, at..at + 10, door..door + 2, CellState::Free);
                for _ in 0..3 {
                    let (x, y) = (rng.random_range(left..right - 8), rng.random_range(low..high - 12));
                    fill(&mut map, x..x + 8, y..y + 8, CellState::Occupied);
                }
            }
            left = right + 2;
        }
    }
    map
}

fn build_fields(criterion: &mut Criterion) {
    let map = office();
    let mut group = criterion.benchmark_group("density_fields");
    group.sample_size(10);
    group.bench_function(format!("2000x2000 cells, {} free, 3 kernels", map.num_free()), |bencher| {
        bencher.iter(|| DensityField::build(&map, &DensityFieldConfig::default()));
    });
    group.finish();
}

/// A filter after a first update, back where it was: its memory is its own, as in a session that goes on.
fn warmed(
    mut filter: ParticleFilter,
    map: &FieldMap,
    step: &Pose2,
    sensor: &impl SensorModel,
) -> ParticleFilter {
    filter.update(map, step, sensor);
    filter.predict(&step.inverse());
    filter
}

fn update_particles(criterion: &mut Criterion) {
    let map = office();
    let robot = Pose2::new(31.0, 2.0 + 14.4 + 0.2, 0.3);
    let step = Pose2::new(0.1, 0.0, 0.02);
    let mut group = criterion.benchmark_group("update_40000_particles");
    for bandwidths_m in [vec![3.0], vec![1.5, 3.0, 5.0]] {
        let num_kernels = bandwidths_m.len();
        let config = DensityFieldConfig { bandwidths_m, ..Default::default() };
        let served = FieldMap::build(map.clone(), &config, &LikelihoodFieldConfig::default());
        let seen = observe(&map, &robot.compose(&step), &config);
        let sensor = DensityModel::new(&served.density, &seen, &DensityModelConfig::default());
        let spread = ParticleFilter::global(&served, ParticleFilterConfig::default(), 7);
        let gathered =
            ParticleFilter::around(&served, &[robot], (0.5, 0.2), ParticleFilterConfig::default(), 7);
        for (name, start) in [("spread", spread), ("gathered", gathered)] {
            let start = warmed(start, &served, &step, &sensor);
            group.bench_function(format!("densities, {num_kernels} kernels, {name}"), |bencher| {
                bencher.iter_batched_ref(
                    || start.clone(),
                    |filter| filter.update(&served, &step, &sensor),
                    criterion::BatchSize::LargeInput,
                );
            });
        }
    }
    group.finish();
}

fn track(criterion: &mut Criterion) {
    let map = office();
    let config = DensityFieldConfig { bandwidths_m: vec![1.5], ..Default::default() };
    let served = FieldMap::build(map, &config, &LikelihoodFieldConfig::default());
    let robot = Pose2::new(31.0, 2.0 + 14.4 + 0.2, 0.3);
    let step = Pose2::new(0.1, 0.0, 0.02);
    let mut group = criterion.benchmark_group("track_40000_particles");
    for num_beams in [30, 60] {
        let points: Vec<Point2> = (0..num_beams)
            .map(|beam| {
                let (angle, range) =
                    (PI * (f64::from(beam) / f64::from(num_beams) - 0.5), 1.0 + f64::from(beam % 7));
                Point2::new(range * angle.cos(), range * angle.sin())
            })
            .collect();
        let sensor = LikelihoodFieldModel::new(&served.likelihood, &points);
        let spread = ParticleFilter::global(&served, ParticleFilterConfig::default(), 7);
        let gathered =
            ParticleFilter::around(&served, &[robot], (0.5, 0.2), ParticleFilterConfig::default(), 7);
        for (name, start) in [("spread", spread), ("gathered", gathered)] {
            let start = warmed(start, &served, &step, &sensor);
            group.bench_function(format!("likelihood field, {num_beams} beams, {name}"), |bencher| {
                bencher.iter_batched_ref(
                    || start.clone(),
                    |filter| filter.update(&served, &step, &sensor),
                    criterion::BatchSize::LargeInput,
                );
            });
        }
    }
    group.finish();
}

criterion_group!(benches, build_fields, update_particles, track);
criterion_main!(benches);
