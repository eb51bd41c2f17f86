//! Simulated fleets in the worlds of the data sets: are their maps one, how far off are they, and what changed?
//!
//! `cargo run --release --example map_worlds -- fleet ipa-lab-a 4` lets four robots wander from unknown starts through
//! one world. `… changes ipa-lab-a` lets one robot wander through the world and another through its twin with
//! furniture, and judges the list of changes by the difference of the two pictures; a third word may be settings of the
//! comparison as JSON. `LOCUTION_DATASETS` says where the worlds are.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Instant;

use locution_engine::config::EngineConfig;
use locution_engine::geometry::{Point2, Pose2, wrap_angle};
use locution_engine::mapping::{
    Change, ChangesConfig, Keyframe, PlacedRun, RegistrationMemo, RunRecord, SiteMap, find_changes, map_site,
    place_observations,
};
use locution_engine::text::{Observation, Word};
use locution_engine::translator::{Translation, Translator};
use locution_lab::simulation::{SimulatedRun, SimulationConfig, Task, World, simulate_run};

type Failure = Box<dyn std::error::Error>;

/// Metres that each robot drives.
const LENGTH_M: f64 = 150.0;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["fleet", world, num_robots] => fleet(world, num_robots.parse()?),
        ["changes", world] => changes(world, &[ChangesConfig::default()]),
        ["changes", world, settings @ ..] => {
            let parsed: Result<Vec<ChangesConfig>, _> =
                settings.iter().map(|json| serde_json::from_str(json)).collect();
            changes(world, &parsed?)
        }
        _ => Err("say `fleet WORLD ROBOTS` or `changes WORLD [SETTINGS]`".into()),
    }
}

fn fleet(name: &str, num_robots: u64) -> Result<(), Failure> {
    let world = read_world(name)?;
    let runs = (0..num_robots)
        .map(|seed| Driven::new(&world, LENGTH_M, 100 + seed))
        .collect::<Result<Vec<_>, _>>()?;
    let map = mapped(&runs)?;
    report(name, &runs, &map);
    Ok(())
}

fn changes(name: &str, settings: &[ChangesConfig]) -> Result<(), Failure> {
    let worlds = [read_world(name)?, read_world(&format!("{name}-furniture"))?];
    // Long drives, so that most of what changed is seen.
    let runs = [Driven::new(&worlds[0], 2.0 * LENGTH_M, 7)?, Driven::new(&worlds[1], 2.0 * LENGTH_M, 8)?];
    let map = mapped(&runs)?;
    report(name, &runs, &map);
    if map.num_components != 1 {
        return Ok(());
    }
    let densities: Vec<Vec<(Point2, f32)>> = runs
        .iter()
        .zip(&map.runs)
        .map(|(run, mapped)| {
            let poses = place_observations(&run.record(), mapped);
            poses
                .iter()
                .zip(&run.observations)
                .map(|(pose, observation)| (pose.position(), observation.densities[0]))
                .collect()
        })
        .collect();
    let placed = |index: usize| PlacedRun {
        geometry: &runs[index].simulated.geometry,
        keyframes: &runs[index].keyframes,
        map_from_keyframes: &map.runs[index].map_from_keyframes,
        densities: &densities[index],
    };
    for config in settings {
        let found = find_changes(&[placed(0)], &[placed(1)], config)?;
        judge_changes(&worlds, &runs, &world_from_map(&runs[0], &map, 0), &found);
    }
    Ok(())
}

/// A robot's drive with its truth, translated.
struct Driven {
    simulated: SimulatedRun,
    observations: Vec<Observation>,
    words: Vec<Word>,
    keyframes: Vec<Keyframe>,
}

impl Driven {
    fn new(world: &World, length_m: f64, seed: u64) -> Result<Self, Failure> {
        let simulated =
            simulate_run(world, &Task::Wander { length_m, start: None }, &SimulationConfig::default(), seed)?;
        let config = EngineConfig::default().translator;
        let mut translator = Translator::new(&config, simulated.geometry.clone())?;
        let mut run = Self { simulated, observations: Vec::new(), words: Vec::new(), keyframes: Vec::new() };
        for index in 0..run.simulated.scans.len() {
            let translation = translator.push(&run.simulated.scans[index]);
            run.take(translation);
        }
        run.take(translator.finish());
        Ok(run)
    }

    fn take(&mut self, translation: Translation) {
        self.observations.extend(translation.observations);
        self.words.extend(translation.words);
        if let Some(pose) = translation.keyframe {
            self.keyframes.push(Keyframe {
                scan_seq: pose.scan_seq,
                timestamp_ns: pose.timestamp_ns,
                odom_from_robot: pose.odom_from_robot,
                run_from_robot: pose.run_from_robot,
                motion_covariance: pose.motion_covariance,
                ranges_m: self.simulated.scans[pose.scan_seq as usize].ranges_m.clone(),
            });
        }
    }

    fn record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: &self.simulated.geometry,
            observations: &self.observations,
            words: &self.words,
            keyframes: &self.keyframes,
            area: None,
        }
    }

    fn truth(&self, keyframe: usize) -> Pose2 {
        self.simulated.truth[self.keyframes[keyframe].scan_seq as usize].truth_from_robot
    }
}

/// A world of the data sets.
fn read_world(name: &str) -> Result<World, Failure> {
    let folder = std::env::var_os("LOCUTION_DATASETS")
        .map_or_else(
            || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/datasets"),
            PathBuf::from,
        )
        .join("worlds");
    Ok(locution_lab::worlds::read_world(&folder.join(format!("{name}.yaml")))?)
}

fn mapped(runs: &[Driven]) -> Result<SiteMap, Failure> {
    let records: Vec<RunRecord<'_>> = runs.iter().map(Driven::record).collect();
    let began = Instant::now();
    let map = map_site(&EngineConfig::default().mapping, &records, &[], &mut RegistrationMemo::default())?;
    println!("mapped in {:.1} s", began.elapsed().as_secs_f64());
    Ok(map)
}

/// The rigid motion that lays the component of a run best over the truth, by that run's keyframes alone.
fn world_from_map(run: &Driven, map: &SiteMap, run_idx: usize) -> Pose2 {
    let poses = &map.runs[run_idx].map_from_keyframes;
    let num = poses.len() as f64;
    let mean = |of: &dyn Fn(usize) -> Pose2| {
        (0..poses.len()).fold((0.0, 0.0), |sum, k| (sum.0 + of(k).x / num, sum.1 + of(k).y / num))
    };
    let (from, to) = (mean(&|k| poses[k]), mean(&|k| run.truth(k)));
    let (mut sin, mut cos) = (0.0, 0.0);
    for (k, pose) in poses.iter().enumerate() {
        let (p, q) = ((pose.x - from.0, pose.y - from.1), (run.truth(k).x - to.0, run.truth(k).y - to.1));
        sin += p.0 * q.1 - p.1 * q.0;
        cos += p.0 * q.0 + p.1 * q.1;
    }
    let turn = Pose2::new(0.0, 0.0, f64::atan2(sin, cos));
    let turned = turn.transform_point(&Point2::new(from.0, from.1));
    Pose2::new(to.0 - turned.x, to.1 - turned.y, turn.theta)
}

/// Components, and how far every run is from its truth when its component is laid over the truth by the first of it.
fn report(name: &str, runs: &[Driven], map: &SiteMap) {
    let components: Vec<u32> = map.runs.iter().map(|run| run.component).collect();
    println!("{name}: {} runs in {} components {components:?}", runs.len(), map.num_components);
    let (mut errors_m, mut errors_deg) = (Vec::new(), Vec::new());
    for component in 0..map.num_components {
        let Some(first) = components.iter().position(|&other| other == component) else { continue };
        let world_from_map = world_from_map(&runs[first], map, first);
        for (run, mapped) in runs.iter().zip(&map.runs).filter(|(_, mapped)| mapped.component == component) {
            for (keyframe, pose) in mapped.map_from_keyframes.iter().enumerate() {
                let (placed, truth) = (world_from_map.compose(pose), run.truth(keyframe));
                errors_m.push(placed.distance(&truth));
                errors_deg.push(wrap_angle(placed.theta - truth.theta).abs().to_degrees());
            }
        }
    }
    errors_m.sort_by(f64::total_cmp);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let at = |share: f64| errors_m.get((errors_m.len() as f64 * share) as usize).copied().unwrap_or_default();
    println!(
        "map error mean {:.3} m, median {:.3}, 95 % {:.3}; {:.2}°",
        mean(&errors_m),
        at(0.5),
        at(0.95),
        mean(&errors_deg)
    );
}

/// Cells of one tenth of a metre.
type Cell = (i64, i64);
const CELL_M: f64 = 0.1;
/// A change is where the pictures differ when it is this near, metres.
const NEAR_M: f64 = 0.3;
/// Differences closer than this are one thing, metres.
const JOIN_M: f64 = 0.35;
/// A thing counts when both drives came this near with nothing in between, metres.
const SEEN_M: f64 = 5.0;

/// Smaller things need not be found, m².
const THING_MIN_M2: f64 = 0.1;

/// Precision: listed changes that are where the pictures differ, if only by the leg of a chair. Recall: things that differ,
/// are large enough, were there to be seen in both drives, and have a listed change.
fn judge_changes(worlds: &[World; 2], runs: &[Driven; 2], world_from_map: &Pose2, found: &[Change]) {
    let cells = differing_cells(worlds);
    let mut things = things(&cells);
    things.retain(|thing| thing_m2(worlds, thing) >= THING_MIN_M2);
    let centers: Vec<Point2> =
        found.iter().map(|change| world_from_map.transform_point(&change.center)).collect();
    let boxes: Vec<f64> = found.iter().map(|change| 0.5 * change.low.distance(&change.high)).collect();
    let near_cell = |point: &Point2, reach_m: f64| {
        let steps = (reach_m / CELL_M).ceil() as i64;
        let (x, y) = cell_of(point);
        (-steps..=steps).any(|dy| (-steps..=steps).any(|dx| cells.contains(&(x + dx, y + dy))))
    };
    let is_right: Vec<bool> =
        centers.iter().zip(&boxes).map(|(center, half)| near_cell(center, NEAR_M.max(*half))).collect();
    let num_right = is_right.iter().filter(|right| **right).count();
    let right_m2: f64 =
        found.iter().zip(&is_right).filter(|(_, right)| **right).map(|(change, _)| change.area_m2).sum();
    let all_m2: f64 = found.iter().map(|change| change.area_m2).sum();
    let seen: Vec<&Vec<Cell>> =
        things.iter().filter(|thing| (0..2).all(|k| is_seen(thing, &worlds[1], &runs[k]))).collect();
    let is_listed = |thing: &Vec<Cell>| {
        centers
            .iter()
            .zip(&boxes)
            .any(|(center, half)| thing.iter().any(|cell| point_of(*cell).distance(center) <= NEAR_M + half))
    };
    let num_found = seen.iter().filter(|thing| is_listed(thing)).count();
    println!(
        "{} changes listed, {num_right} right: precision {:.3} ({:.3} of the surface); {} things of {THING_MIN_M2} m² \
         differ, {} were there to be seen, {num_found} found: recall {:.3}",
        found.len(),
        num_right as f64 / found.len().max(1) as f64,
        right_m2 / all_m2.max(1e-9),
        things.len(),
        seen.len(),
        num_found as f64 / seen.len().max(1) as f64
    );
}

fn cell_of(point: &Point2) -> Cell {
    ((point.x / CELL_M).floor() as i64, (point.y / CELL_M).floor() as i64)
}

fn point_of((x, y): Cell) -> Point2 {
    Point2::new((x as f64 + 0.5) * CELL_M, (y as f64 + 0.5) * CELL_M)
}

/// Quarters of a cell: the pixels of the worlds.
fn quarters(cell: Cell) -> [Point2; 4] {
    let middle = point_of(cell);
    let quarter = CELL_M / 4.0;
    [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
        .map(|(x, y)| Point2::new(middle.x + x * quarter, middle.y + y * quarter))
}

fn num_differing(worlds: &[World; 2], cell: Cell) -> usize {
    quarters(cell).iter().filter(|point| worlds[0].is_free(point) != worlds[1].is_free(point)).count()
}

/// Surface of a thing, m².
fn thing_m2(worlds: &[World; 2], thing: &[Cell]) -> f64 {
    thing.iter().map(|cell| num_differing(worlds, *cell)).sum::<usize>() as f64 * CELL_M * CELL_M / 4.0
}

/// Cells of which some part is free in one world and not in the other.
fn differing_cells(worlds: &[World; 2]) -> BTreeSet<Cell> {
    let (low, size) = (worlds[0].origin(), worlds[0].size());
    let first = cell_of(&low);
    let (width, height) = (
        (size.0 as f64 * worlds[0].resolution_m() / CELL_M) as i64,
        (size.1 as f64 * worlds[0].resolution_m() / CELL_M) as i64,
    );
    (0..width)
        .flat_map(|x| (0..height).map(move |y| (first.0 + x, first.1 + y)))
        .filter(|cell| num_differing(worlds, *cell) > 0)
        .collect()
}

/// Groups of differing cells.
fn things(cells: &BTreeSet<Cell>) -> Vec<Vec<Cell>> {
    let mut left = cells.clone();
    let steps = (JOIN_M / CELL_M) as i64;
    let mut things = Vec::new();
    while let Some(seed) = left.pop_first() {
        let mut thing = vec![seed];
        let mut next = 0;
        while next < thing.len() {
            let (x, y) = thing[next];
            next += 1;
            for near in (-steps..=steps).flat_map(|dy| (-steps..=steps).map(move |dx| (x + dx, y + dy))) {
                if left.remove(&near) {
                    thing.push(near);
                }
            }
        }
        things.push(thing);
    }
    things
}

/// True when the robot came near some cell of the thing with free floor up to it.
fn is_seen(thing: &[Cell], world: &World, run: &Driven) -> bool {
    let is_open = |from: &Point2, to: &Point2| {
        let length_m = from.distance(to);
        let num_steps = (length_m / CELL_M) as usize;
        // The last steps may lie in the thing itself.
        (0..num_steps.saturating_sub(2)).all(|step| {
            let share = step as f64 / num_steps as f64;
            world.is_free(&Point2::new(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)))
        })
    };
    (0..run.keyframes.len()).step_by(3).any(|keyframe| {
        let pose = run.truth(keyframe);
        thing.iter().step_by(2).any(|cell| {
            let point = point_of(*cell);
            let bearing = wrap_angle((point.y - pose.y).atan2(point.x - pose.x) - pose.theta);
            pose.position().distance(&point) <= SEEN_M
                && bearing.abs() <= std::f64::consts::FRAC_PI_2
                && is_open(&pose.position(), &point)
        })
    })
}
