//! Chapter 3: global localisation by densities against sampled beams (**bb**) and the cosine of scans (**fcs**).
//!
//! The thesis gives the lengths of the loops of its scenarios and their extent, not the drawings; these are of their
//! kind. The filters take a step every 0.1 m. Times are wall times of one step on one thread, the robot's own local
//! map and densities included.

use std::path::Path;
use std::time::Instant;

use crate::simulation::{SimulationConfig, Task, World, simulate_run};
use anyhow::{Context, Result};
use locution_engine::density::KernelProfile;
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::locate::LikelihoodFieldConfig;
use locution_engine::occupancy::{CellState, GridMap};
use locution_engine::scan::{Scan, ScanGeometry};
use serde::Serialize;

use super::floor_plan::FloorPlan;
use super::write_picture;
use crate::density_field::DensityFieldConfig;
use crate::particle_filter::{BeamComparison, FieldMap, FilterSenses, FilterSensor, FilterTrial, Sensed};
use crate::plot::{Line, Plot};
use crate::report::table;

/// Distance between two steps of a filter.
const STEP_M: f64 = 0.1;
/// Cells of the maps (thesis 3.3.2).
const CELL_M: f64 = 0.1;
/// Particles are together when their mean distance from the truth is below this.
const FOUND_M: f64 = 1.0;
const PROFILES: [(KernelProfile, &str, [u8; 3]); 3] = [
    (KernelProfile::Uniform, "UK", [31, 119, 180]),
    (KernelProfile::Gaussian, "GK", [44, 160, 44]),
    (KernelProfile::Inverted, "IK", [214, 39, 40]),
];

/// A building with one drive through it.
struct Scenario {
    name: &'static str,
    what: &'static str,
    map: GridMap,
    geometry: ScanGeometry,
    /// Scans a step apart, with the true pose.
    steps: Vec<(Scan, Pose2)>,
    /// Particles of the densities, and of the rivals.
    num_particles: (usize, usize),
}

/// A sensor with its look in pictures.
struct Contender {
    label: String,
    color: [u8; 3],
    sensor: FilterSensor,
    num_particles: usize,
}

/// Errors and times of a contender, means over all seeds.
#[derive(Clone, Debug, Serialize)]
pub(super) struct FilterResult {
    figure: &'static str,
    scenario: &'static str,
    sensor: String,
    particles: usize,
    seeds: u64,
    /// Mean error after each step, metres.
    error_m: Vec<f64>,
    /// Mean error over the last tenth of the drive, metres.
    final_error_m: f64,
    /// First step after which the mean error stays below a metre.
    steps_to_find: Option<usize>,
    /// Share of the robot's own readings that are hard densities.
    hard_share: Option<f64>,
    /// Local map and densities of the robot included.
    ms_per_step: f64,
    /// The filter alone.
    ms_per_update: f64,
}

/// Figures 3.5 and 3.6.
pub(super) fn chapter_3(out: &Path, num_seeds: u64) -> Result<Vec<FilterResult>> {
    println!("Chapter 3: global localisation with particles, {num_seeds} seeds");
    let mut results = figure_3_5(out, &two_galleries()?, num_seeds)?;
    for scenario in [unequal_loops()?, equal_loops()?, two_galleries()?] {
        let contenders = contenders_of_figure_3_6(&scenario);
        results.extend(race("3.6", out, &scenario, &contenders, num_seeds)?);
    }
    Ok(results)
}

/// Single kernels of every profile, and all bandwidths at once.
fn figure_3_5(out: &Path, scenario: &Scenario, num_seeds: u64) -> Result<Vec<FilterResult>> {
    let bandwidths: [(&str, Vec<f64>); 5] = [
        ("1.5 m", vec![1.5]),
        ("3 m", vec![3.0]),
        ("4 m", vec![4.0]),
        ("5 m", vec![5.0]),
        ("1.5, 3 and 5 m", vec![1.5, 3.0, 5.0]),
    ];
    let mut contenders = Vec::new();
    for (profile, letters, color) in PROFILES {
        for (label, bandwidths_m) in &bandwidths {
            let fields =
                DensityFieldConfig { profile, bandwidths_m: bandwidths_m.clone(), ..Default::default() };
            let sensor = FilterSensor::Densities(fields);
            let num_particles = scenario.num_particles.0;
            contenders.push(Contender { label: format!("{letters} {label}"), color, sensor, num_particles });
        }
    }
    race("3.5", out, scenario, &contenders, num_seeds)
}

fn contenders_of_figure_3_6(scenario: &Scenario) -> Vec<Contender> {
    let (num_ours, num_theirs) = scenario.num_particles;
    let densities = PROFILES.map(|(profile, letters, color)| Contender {
        label: letters.into(),
        color,
        sensor: FilterSensor::Densities(DensityFieldConfig { profile, ..Default::default() }),
        num_particles: num_ours,
    });
    let rival = |label: &str, color, comparison| Contender {
        label: label.into(),
        color,
        sensor: FilterSensor::Beams(comparison),
        num_particles: num_theirs,
    };
    let bb = rival("bb", [148, 103, 189], BeamComparison::Beams);
    let fcs = rival("fcs", [23, 190, 207], BeamComparison::Cosine);
    densities.into_iter().chain([bb, fcs]).collect()
}

fn race(
    figure: &'static str,
    out: &Path,
    scenario: &Scenario,
    contenders: &[Contender],
    num_seeds: u64,
) -> Result<Vec<FilterResult>> {
    println!(
        "  Figure {figure}, scenario {}: {}, {} steps",
        scenario.name,
        scenario.what,
        scenario.steps.len()
    );
    let results: Vec<FilterResult> =
        contenders.iter().map(|contender| run(figure, scenario, contender, num_seeds)).collect();
    let row = |result: &FilterResult| {
        vec![
            result.sensor.clone(),
            result.particles.to_string(),
            result.steps_to_find.map_or("-".into(), |step| step.to_string()),
            format!("{:.2}", result.final_error_m),
            result.hard_share.map_or("-".into(), |share| format!("{:.0} %", 100.0 * share)),
            format!("{:.2}", result.ms_per_step),
            format!("{:.2}", result.ms_per_update),
        ]
    };
    let header =
        ["sensor", "particles", "found at step", "final error m", "hard", "ms per step", "filter alone"];
    println!("{}", table(&header, &results.iter().map(row).collect::<Vec<_>>()));
    let line = |(result, contender): (&FilterResult, &Contender)| Line {
        name: contender.label.clone(),
        color: contender.color,
        points: result.error_m.iter().enumerate().map(|(step, error)| (step as f64, *error)).collect(),
        has_markers: false,
    };
    let worst_m = results.iter().flat_map(|result| &result.error_m).copied().fold(1.0, f64::max);
    let plot = Plot {
        title: format!("scenario {}", scenario.name),
        x_label: "step".into(),
        y_label: "mean error (m)".into(),
        x_range: (0.0, scenario.steps.len() as f64),
        y_range: (0.0, worst_m),
        lines: results.iter().zip(contenders).map(line).collect(),
    };
    let file = format!("figure_{}_{}", figure.replace('.', "_"), scenario.name.to_lowercase());
    write_picture(out, &file, &plot)?;
    Ok(results)
}

/// Runs a contender through a scenario with every seed.
fn run(figure: &'static str, scenario: &Scenario, contender: &Contender, num_seeds: u64) -> FilterResult {
    let unused = DensityFieldConfig { bandwidths_m: vec![1.5], ..Default::default() };
    let fields = match &contender.sensor {
        FilterSensor::Densities(fields) => fields,
        FilterSensor::Beams(_) => &unused,
    };
    let map = FieldMap::build(scenario.map.clone(), fields, &LikelihoodFieldConfig::default());
    let num_steps = scenario.steps.len();
    let mut error_m = vec![0.0; num_steps];
    // What the robot itself sees is the same for every seed.
    let mut senses = FilterSenses::new(&contender.sensor, &scenario.geometry);
    let began = Instant::now();
    let sensed: Vec<Sensed> = scenario.steps.iter().map(|(scan, _)| senses.sense(scan)).collect();
    let sensing_s = began.elapsed().as_secs_f64();
    let mut filtering_s = 0.0;
    for seed in 0..num_seeds {
        let sensor = contender.sensor.clone();
        let mut trial = FilterTrial::new(&map, &scenario.geometry, sensor, contender.num_particles, seed);
        for (((scan, truth), sensed), sum) in scenario.steps.iter().zip(&sensed).zip(&mut error_m) {
            let began = Instant::now();
            trial.step(scan, sensed);
            filtering_s += began.elapsed().as_secs_f64();
            *sum += trial.mean_error_m(truth) / num_seeds as f64;
        }
    }
    let readings: Vec<bool> =
        sensed.iter().flat_map(|step| &step.readings).map(|reading| reading.density.is_some()).collect();
    let num_hard = readings.iter().filter(|is_hard| **is_hard).count();
    let last = &error_m[num_steps - num_steps.div_ceil(10)..];
    let steps_to_find = match error_m.iter().rposition(|error| *error >= FOUND_M) {
        Some(step) if step + 1 < num_steps => Some(step + 1),
        Some(_) => None,
        None => Some(0),
    };
    FilterResult {
        figure,
        scenario: scenario.name,
        sensor: contender.label.clone(),
        particles: contender.num_particles,
        seeds: num_seeds,
        final_error_m: last.iter().sum::<f64>() / last.len() as f64,
        steps_to_find,
        hard_share: (!readings.is_empty()).then(|| num_hard as f64 / readings.len() as f64),
        ms_per_step: 1e3 * (sensing_s + filtering_s / num_seeds as f64) / num_steps as f64,
        ms_per_update: 1e3 * filtering_s / (num_seeds as f64 * num_steps as f64),
        error_m,
    }
}

/// Scenario A: two loops of 46 m beside two of 58 and 78 m.
fn unequal_loops() -> Result<Scenario> {
    let mut plan = FloorPlan::new((38.0, 23.0), 3.0);
    for list in [
        vec![(0.0, 0.0), (38.0, 0.0), (38.0, 23.0), (0.0, 23.0), (0.0, 0.0)],
        vec![(0.0, 11.5), (38.0, 11.5)],
        vec![(11.5, 0.0), (11.5, 23.0)],
    ] {
        plan.corridor(&points(&list), 2.2);
    }
    // A short cut makes the upper loops unequal.
    plan.corridor(&points(&[(21.0, 11.5), (21.0, 23.0)]), 2.2);
    let route = [
        (2.0, 0.0),
        (11.5, 0.0),
        (11.5, 11.5),
        (0.0, 11.5),
        (0.0, 23.0),
        (11.5, 23.0),
        (11.5, 11.5),
        (21.0, 11.5),
        (21.0, 23.0),
        (38.0, 23.0),
        (38.0, 0.0),
        (11.5, 0.0),
        (11.5, 11.5),
        (21.0, 11.5),
    ];
    scenario("A", "adjacent loops, two of them alike", plan, &route, (20_000, 500))
}

/// Scenario B: three loops of 72 m in a row.
fn equal_loops() -> Result<Scenario> {
    let mut plan = FloorPlan::new((66.0, 14.0), 3.0);
    plan.corridor(&points(&[(0.0, 0.0), (66.0, 0.0), (66.0, 14.0), (0.0, 14.0), (0.0, 0.0)]), 2.2);
    plan.corridor(&points(&[(22.0, 0.0), (22.0, 14.0)]), 2.2);
    plan.corridor(&points(&[(44.0, 0.0), (44.0, 14.0)]), 2.2);
    let route = [
        (4.0, 0.0),
        (22.0, 0.0),
        (22.0, 14.0),
        (0.0, 14.0),
        (0.0, 0.0),
        (22.0, 0.0),
        (44.0, 0.0),
        (44.0, 14.0),
        (66.0, 14.0),
        (66.0, 0.0),
        (44.0, 0.0),
        (22.0, 0.0),
    ];
    scenario("B", "three equal loops of 72 m", plan, &route, (30_000, 1_000))
}

/// Scenario C: two like galleries of rooms within 25 × 25 m, joined by a corridor.
fn two_galleries() -> Result<Scenario> {
    let mut plan = FloorPlan::new((25.0, 25.0), 3.0);
    for left in [0.0, 14.6] {
        plan.corridor(&points(&[(left + 5.2, 1.0), (left + 5.2, 24.0)]), 2.0);
        for (row, height) in [(0.0, 5.6), (6.0, 4.6), (11.0, 6.6), (18.0, 6.6)] {
            plan.cut(Point2::new(left, row), Point2::new(left + 3.9, row + height));
            plan.cut(Point2::new(left + 6.5, row), Point2::new(left + 10.4, row + height));
            let door = row + height / 2.0;
            plan.cut(Point2::new(left + 3.8, door - 0.5), Point2::new(left + 6.6, door + 0.5));
        }
    }
    plan.cut(Point2::new(4.2, 24.7), Point2::new(20.8, 26.4));
    plan.cut(Point2::new(4.6, 23.0), Point2::new(5.8, 25.0));
    plan.cut(Point2::new(19.2, 23.0), Point2::new(20.4, 25.0));
    let route = [
        (2.0, 2.8),
        (5.2, 2.8),
        (5.2, 8.3),
        (8.4, 8.3),
        (5.2, 8.3),
        (5.2, 14.3),
        (2.0, 14.3),
        (5.2, 14.3),
        (5.2, 21.3),
        (8.4, 21.3),
        (5.2, 21.3),
        (5.2, 25.5),
        (19.8, 25.5),
        (19.8, 21.3),
        (16.6, 21.3),
        (19.8, 21.3),
        (19.8, 14.3),
        (23.0, 14.3),
        (19.8, 14.3),
        (19.8, 2.8),
        (16.6, 2.8),
    ];
    scenario("C", "two like galleries of rooms", plan, &route, (40_000, 2_000))
}

fn points(list: &[(f64, f64)]) -> Vec<Point2> {
    list.iter().map(|&(x, y)| Point2::new(x, y)).collect()
}

/// Drives a route through a plan and keeps a scan for every step.
fn scenario(
    name: &'static str,
    what: &'static str,
    plan: FloorPlan,
    route: &[(f64, f64)],
    num_particles: (usize, usize),
) -> Result<Scenario> {
    let world = plan.world()?;
    let run = simulate_run(&world, &Task::Route(points(route)), &SimulationConfig::default(), 300)
        .with_context(|| format!("scenario {name}"))?;
    let mut steps: Vec<(Scan, Pose2)> = Vec::new();
    for (scan, truth) in run.scans.into_iter().zip(&run.truth) {
        let truth = truth.truth_from_robot;
        if steps.last().is_none_or(|(_, last)| last.distance(&truth) >= STEP_M) {
            steps.push((scan, truth));
        }
    }
    Ok(Scenario { name, what, map: map_of(&world)?, geometry: run.geometry, steps, num_particles })
}

/// The world as a map in which everything is known.
fn map_of(world: &World) -> Result<GridMap> {
    let (columns, rows) = world.size();
    let cells = |count: usize| (count as f64 * world.resolution_m() / CELL_M).round() as usize;
    let (width, height) = (cells(columns), cells(rows));
    let origin = world.origin();
    let state = |cell: usize| {
        let (column, row) = ((cell % width) as f64 + 0.5, (cell / width) as f64 + 0.5);
        let center = Point2::new(origin.x + column * CELL_M, origin.y + row * CELL_M);
        if world.is_free(&center) { CellState::Free } else { CellState::Occupied }
    };
    GridMap::new(width, CELL_M, origin, (0..width * height).map(state).collect()).context("the plan is empty")
}
