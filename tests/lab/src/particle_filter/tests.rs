//! The parts of the filter together, against plain references.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::density_field::{DensityFieldConfig, KernelReading, observe};
use crate::small_building::{building, drive};
use locution_engine::geometry::{Point2, Pose2, angle_between};
use locution_engine::locate::{Hypothesis, LikelihoodFieldConfig};
use locution_engine::occupancy::{CellState, GridMap};

fn served() -> FieldMap {
    FieldMap::build(building(), &DensityFieldConfig::default(), &LikelihoodFieldConfig::default())
}

/// Eqs 3.3–3.6 as they are printed.
fn weight_as_printed(
    map: &FieldMap,
    pose: &Pose2,
    seen: &[KernelReading],
    config: &DensityModelConfig,
) -> f64 {
    let (column, row) = map.grid.cell_at(&pose.position());
    if map.grid.state(column, row) != CellState::Free {
        return 0.0;
    }
    let mut weight = 1.0;
    for (kernel, robot) in seen.iter().enumerate() {
        let cell = map.density.reading(column, row, kernel).expect("the cell is free");
        if let (Some(robot), Some(cell)) = (robot.density, cell.density) {
            weight *= if f64::from((robot - cell).abs()) <= config.density_tolerance {
                1.0
            } else {
                config.penalty
            };
        }
        if let (Some(robot), Some(cell)) = (robot.descent_rad, cell.descent_rad) {
            let difference = angle_between(-f64::from(robot), pose.theta - f64::from(cell));
            weight *= if difference <= config.direction_tolerance_rad { 1.0 } else { config.penalty };
        }
    }
    weight
}

#[test]
fn byte_tests_weigh_as_the_equations_are_printed() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for bandwidths_m in [vec![1.5, 3.0, 5.0], vec![3.0], vec![1.0, 2.0]] {
        let fields = DensityFieldConfig { bandwidths_m, ..Default::default() };
        let map = FieldMap::build(building(), &fields, &LikelihoodFieldConfig::default());
        let config = DensityModelConfig::default();
        let robot = Pose2::new(-1.0, 8.3, 0.4);
        let seen = observe(&map.grid, &robot, &fields);
        let mut particles = Particles::default();
        for _ in 0..2005 {
            let pose = Pose2::new(
                rng.random_range(-4.5..8.5),
                rng.random_range(6.5..16.5),
                rng.random_range(-3.1..3.1),
            );
            particles.push(&pose, &map.grid.origin());
        }
        DensityModel::new(&map.density, &seen, &config).weigh(&mut particles);
        let agreeing = (0..particles.len()).filter(|&index| {
            let pose = particles.pose(index, &map.grid.origin());
            let printed = weight_as_printed(&map, &pose, &seen, &config);
            (f64::from(particles.weight(index)) - printed).abs() < 1e-6
        });
        // Directions are kept in steps of 2.8°, so particles on the brink of the tolerance may fall to either side.
        let share = agreeing.count() as f64 / particles.len() as f64;
        assert!(share > 0.97, "{share} of the weights agree");
    }
}

#[test]
fn the_robot_sees_what_the_map_holds() {
    let map = served();
    let config = DensityFieldConfig::default();
    let pose = Pose2::new(-2.0, 8.9, 2.0);
    let (column, row) = map.grid.cell_at(&pose.position());
    for (kernel, seen) in observe(&map.grid, &pose, &config).iter().enumerate() {
        let held = map.density.reading(column, row, kernel).expect("the cell is free");
        let (seen_density, held_density) =
            (seen.density.expect("all is known"), held.density.expect("all is known"));
        assert!((seen_density - held_density).abs() < 0.003, "kernel {kernel}");
        match (seen.descent_rad, held.descent_rad) {
            (Some(seen), Some(held)) => {
                assert!(
                    angle_between(f64::from(seen) + pose.theta, f64::from(held)) < 0.03,
                    "kernel {kernel}"
                );
            }
            (seen, held) => assert_eq!(seen, held, "kernel {kernel}"),
        }
    }
}

#[test]
fn fields_take_few_bytes_per_free_cell() {
    let map = served();
    let bytes_per_free_cell = map.density.num_bytes() as f64 / map.grid.num_free() as f64;
    assert!(bytes_per_free_cell <= 24.0, "{bytes_per_free_cell}");
}

fn localize(seed: u64, map: &FieldMap) -> Vec<Hypothesis> {
    let config = ParticleFilterConfig { num_particles: 8000, ..Default::default() };
    let fields = DensityFieldConfig::default();
    let mut filter = ParticleFilter::global(map, config, seed);
    for pair in drive().windows(2) {
        let seen = observe(&map.grid, &pair[1], &fields);
        let sensor = DensityModel::new(&map.density, &seen, &DensityModelConfig::default());
        filter.update(map, &pair[0].between(&pair[1]), &sensor);
    }
    filter.hypotheses(map)
}

#[test]
fn densities_alone_find_the_robot_and_the_seed_repeats_it() {
    let map = served();
    let found = localize(4, &map);
    let truth = drive()[drive().len() - 1];
    assert!(found[0].map_from_robot.distance(&truth) < 0.5, "{:?} is not {truth:?}", found[0]);
    assert!(
        angle_between(found[0].map_from_robot.theta, truth.theta) < 0.3,
        "{:?} is not {truth:?}",
        found[0]
    );
    assert_eq!(localize(4, &map), found);
}

#[test]
fn a_map_without_free_space_is_survived() {
    let grid = GridMap::unknown(20, 20, 0.1, Point2::default());
    let map = FieldMap::build(grid, &DensityFieldConfig::default(), &LikelihoodFieldConfig::default());
    let mut filter = ParticleFilter::global(&map, ParticleFilterConfig::default(), 1);
    filter.update(
        &map,
        &Pose2::new(0.1, 0.0, 0.0),
        &LikelihoodFieldModel::new(&map.likelihood, &[Point2::default()]),
    );
    assert!(filter.hypotheses(&map).is_empty());
}
