//! `locution eval rooms`: rooms and doors of plans and of what robots saw of them, against those that a person drew.
//!
//! The floor plan itself is one grid; with `--driven` the grid is drawn from the scans of a simulated robot at its true
//! poses, so that noise, people's paths and what was not seen count, and errors of mapping do not.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use locution_engine::geometry::Point2;
use locution_engine::occupancy::{CellState, GridMap, OccupancyConfig, TiledOccupancy};
use locution_engine::semantics::{RoomsConfig, find_rooms};
use rayon::prelude::*;
use serde::Serialize;

use crate::evaluation::{DoorScore, RoomScore, judge_doors, judge_rooms};
use crate::report::{table, write_json};
use crate::simulation::{SimulationConfig, Task, World, simulate_run};
use crate::worlds::{decode_picture, read_world};

/// Edge of a cell of a grid drawn from scans, metres: that of served grids.
const RESOLUTION_M: f64 = 0.05;
/// Beams are followed this far, as in served grids, metres.
const RANGE_LIMIT_M: f64 = 20.0;
/// Scans between two that are drawn.
const SCANS_PER_KEYFRAME: usize = 5;
/// Shorter lines along which two drawn rooms touch are no doors, metres.
const DOOR_MIN_M: f64 = 0.4;
/// Settings among which a plan left out is judged.
const DOOR_SHARES: [f64; 3] = [0.85, 0.9, 0.93];
const MOUTH_SHARES: [f64; 3] = [0.33, 0.4, 0.45];

/// Which plans, and how.
#[derive(Debug, Args)]
pub struct RoomsArguments {
    /// Plans: NAME.yaml and NAME-furniture.yaml in --worlds, NAME.rooms.png in --rooms [default: all that have rooms].
    names: Vec<String>,
    /// Folder of the plans, ROS map_server pairs.
    #[arg(long)]
    worlds: PathBuf,
    /// Folder of the drawn rooms: a pixel is the number of its room, 0 where there is no floor.
    #[arg(long)]
    rooms: PathBuf,
    /// See each plan through a simulated robot that wanders so far, in metres.
    #[arg(long)]
    driven: Option<f64>,
    /// Chooses the robots' ways.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Also choose the two shares of the settings on all other plans and judge each plan by that choice.
    #[arg(long)]
    leave_one_out: bool,
    /// JSON file with settings of the rooms, whole or in part [default: the defaults].
    #[arg(long)]
    config: Option<PathBuf>,
    /// Write the report here.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// One plan, judged.
#[derive(Clone, Debug, Serialize)]
pub struct RoomTrial {
    /// The plan.
    pub world: String,
    /// Whether it has furniture.
    pub is_furnished: bool,
    /// Share of the drawn floor that the grid knows; only that is judged.
    pub seen: f64,
    /// Its rooms.
    #[serde(flatten)]
    pub rooms: RoomScore,
    /// Its doors.
    pub doors: DoorScore,
}

/// Means over plans.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct RoomMeans {
    matthews: f64,
    mean_iou: f64,
    door_precision: f64,
    door_recall: f64,
}

#[derive(Serialize)]
struct RoomReport {
    config: RoomsConfig,
    trials: Vec<RoomTrial>,
    bare: RoomMeans,
    furnished: RoomMeans,
    /// Each plan judged by what all others chose.
    #[serde(skip_serializing_if = "Option::is_none")]
    left_out: Option<LeftOut>,
}

#[derive(Serialize)]
struct LeftOut {
    trials: Vec<RoomTrial>,
    /// Door share and mouth share that the others chose, for each plan.
    chosen: Vec<(String, f64, f64)>,
    bare: RoomMeans,
    furnished: RoomMeans,
}

/// A grid in which rooms are to be found, with the drawn ones.
struct Drawn {
    world: String,
    is_furnished: bool,
    grid: GridMap,
    /// Centres of the drawn cells and the numbers of their rooms.
    cells: Vec<(Point2, u32)>,
    doors: Vec<Point2>,
}

/// Runs the trials.
///
/// # Errors
/// Files that cannot be read or written, settings that cannot work, a world without room to drive.
pub fn run(arguments: &RoomsArguments) -> Result<()> {
    let config: RoomsConfig = match &arguments.config {
        Some(path) => serde_json::from_str(&crate::recordings::read_text(path)?)
            .with_context(|| path.display().to_string())?,
        None => RoomsConfig::default(),
    };
    config.validate("rooms")?;
    let names = names(arguments)?;
    ensure!(!names.is_empty(), "no NAME.rooms.png in {}", arguments.rooms.display());
    let mut drawn = Vec::new();
    for name in &names {
        for is_furnished in [false, true] {
            drawn.push(Drawn::read(arguments, name, is_furnished)?);
        }
    }
    let trials = judged(&drawn, &config);
    print_trials(&trials);
    let left_out = arguments.leave_one_out.then(|| leave_one_out(&drawn, &names, &config));
    let report = RoomReport {
        bare: RoomMeans::of(&trials, false),
        furnished: RoomMeans::of(&trials, true),
        config,
        trials,
        left_out,
    };
    report.bare.print("bare");
    report.furnished.print("furnished");
    if let Some(left_out) = &report.left_out {
        left_out.bare.print("bare, left out");
        left_out.furnished.print("furnished, left out");
    }
    arguments.json.as_ref().map_or(Ok(()), |path| write_json(path, &report))
}

fn names(arguments: &RoomsArguments) -> Result<Vec<String>> {
    if !arguments.names.is_empty() {
        return Ok(arguments.names.clone());
    }
    let folder = std::fs::read_dir(&arguments.rooms)
        .with_context(|| format!("cannot open {}", arguments.rooms.display()))?;
    let mut names = BTreeSet::new();
    for entry in folder {
        let file = entry?.file_name();
        names.extend(file.to_string_lossy().strip_suffix(".rooms.png").map(str::to_owned));
    }
    Ok(names.into_iter().collect())
}

impl Drawn {
    fn read(arguments: &RoomsArguments, name: &str, is_furnished: bool) -> Result<Self> {
        let suffix = if is_furnished { "-furniture" } else { "" };
        let world = read_world(&arguments.worlds.join(format!("{name}{suffix}.yaml")))?;
        let rooms = room_numbers(&arguments.rooms.join(format!("{name}.rooms.png")))?;
        let (width, height) = world.size();
        ensure!(rooms.len() == width * height, "the rooms of {name} are not as large as its plan");
        let center = |cell: usize| {
            let along = |index: usize| (index as f64 + 0.5) * world.resolution_m();
            Point2::new(world.origin().x + along(cell % width), world.origin().y + along(cell / width))
        };
        let grid = match arguments.driven {
            Some(length_m) => seen_by_robot(&world, length_m, arguments.seed)?,
            None => {
                let state = |cell| {
                    if world.is_free(&center(cell)) { CellState::Free } else { CellState::Occupied }
                };
                let cells = (0..width * height).map(state).collect();
                GridMap::new(width, world.resolution_m(), world.origin(), cells)
                    .context("a world has cells and a resolution")?
            }
        };
        let doors =
            doors_of(&rooms, width, world.resolution_m()).into_iter().map(|line| middle(&line, center));
        Ok(Self {
            world: name.to_owned(),
            is_furnished,
            doors: doors.collect(),
            cells: rooms
                .iter()
                .enumerate()
                .filter(|(_, room)| **room != 0)
                .map(|(c, r)| (center(c), *r))
                .collect(),
            grid,
        })
    }

    fn judge(&self, config: &RoomsConfig) -> RoomTrial {
        let found = find_rooms(&self.grid, config);
        let is_seen = |point: &Point2| {
            let (column, row) = self.grid.cell_at(point);
            self.grid.state(column, row) != CellState::Unknown
        };
        let seen: Vec<(u32, Option<u32>)> = self
            .cells
            .iter()
            .filter(|(point, _)| is_seen(point))
            .map(|(point, room)| (*room, found.room_at(point)))
            .collect();
        let doors: Vec<Point2> = self.doors.iter().copied().filter(is_seen).collect();
        let doors_found: Vec<Point2> = found.doors.iter().map(|door| door.position).collect();
        RoomTrial {
            world: self.world.clone(),
            is_furnished: self.is_furnished,
            seen: seen.len() as f64 / self.cells.len().max(1) as f64,
            rooms: judge_rooms(&seen),
            doors: judge_doors(&doors, &doors_found),
        }
    }
}

/// The grid that a wandering robot's scans give at their true poses.
fn seen_by_robot(world: &World, length_m: f64, seed: u64) -> Result<GridMap> {
    let run =
        simulate_run(world, &Task::Wander { length_m, start: None }, &SimulationConfig::default(), seed)?;
    let mut occupancy = TiledOccupancy::new(OccupancyConfig {
        resolution_m: RESOLUTION_M,
        range_limit_m: RANGE_LIMIT_M,
        no_return_clear_m: 0.0,
        ..OccupancyConfig::default()
    })?;
    for (scan, truth) in run.scans.iter().zip(&run.truth).step_by(SCANS_PER_KEYFRAME) {
        occupancy.add_scan(&run.geometry, &scan.ranges_m, &truth.truth_from_robot);
    }
    GridMap::of_occupancy(&occupancy).context("the robot saw nothing")
}

/// Numbers of rooms, row by row from the lower left.
fn room_numbers(path: &Path) -> Result<Vec<u32>> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot open {}", path.display()))?;
    let image = decode_picture(&bytes).with_context(|| path.display().to_string())?.gray;
    let rows = image.pixels.chunks(image.width.max(1)).rev();
    Ok(rows.flatten().map(|&number| u32::from(number)).collect())
}

/// Lines of cells along which two drawn rooms touch.
fn doors_of(rooms: &[u32], width: usize, resolution_m: f64) -> Vec<Vec<usize>> {
    let mut touching: BTreeSet<(u32, u32, usize)> = BTreeSet::new();
    for (cell, &room) in rooms.iter().enumerate().filter(|(_, room)| **room != 0) {
        for beside in [cell + 1, cell + width] {
            let is_in_row = beside != cell + 1 || beside % width != 0;
            if let Some(&other) =
                rooms.get(beside).filter(|other| is_in_row && **other != 0 && **other != room)
            {
                touching.insert((room.min(other), room.max(other), cell));
            }
        }
    }
    let mut lines = Vec::new();
    while let Some((first, second, start)) = touching.pop_first() {
        let mut line = vec![start];
        let mut next = 0;
        while let Some(&cell) = line.get(next) {
            next += 1;
            // Cells of one line may touch over corners, and lie on either side of it.
            for (down, left) in (0..5).flat_map(|down| (0..5).map(move |left| (down, left))) {
                let around = (cell + 2 * width + 2).checked_sub(down * width + left);
                line.extend(around.filter(|&other| touching.remove(&(first, second, other))));
            }
        }
        if line.len() as f64 * resolution_m >= DOOR_MIN_M {
            lines.push(line);
        }
    }
    lines
}

fn middle(line: &[usize], center: impl Fn(usize) -> Point2) -> Point2 {
    let share = 1.0 / line.len() as f64;
    line.iter()
        .map(|&cell| center(cell))
        .fold(Point2::default(), |sum, at| Point2::new(sum.x + share * at.x, sum.y + share * at.y))
}

fn judged(drawn: &[Drawn], config: &RoomsConfig) -> Vec<RoomTrial> {
    drawn.par_iter().map(|drawn| drawn.judge(config)).collect()
}

/// Judges every plan, bare and furnished, with the settings that do best on all other plans.
fn leave_one_out(drawn: &[Drawn], names: &[String], config: &RoomsConfig) -> LeftOut {
    let mut tried: Vec<(f64, f64, Vec<RoomTrial>)> = Vec::new();
    for (door_share, mouth_share) in
        DOOR_SHARES.into_iter().flat_map(|door| MOUTH_SHARES.map(move |mouth| (door, mouth)))
    {
        let trials = judged(drawn, &RoomsConfig { door_share, mouth_share, ..config.clone() });
        println!("doors {door_share}, mouths {mouth_share}");
        RoomMeans::of(&trials, false).print("bare");
        tried.push((door_share, mouth_share, trials));
    }
    let (mut trials, mut chosen) = (Vec::new(), Vec::new());
    for name in names {
        let worth = |of: &[RoomTrial]| -> f64 {
            of.iter().filter(|trial| trial.world != *name).map(|trial| trial.rooms.matthews).sum()
        };
        let best = tried.iter().rev().max_by(|a, b| worth(&a.2).total_cmp(&worth(&b.2)));
        let Some((door_share, mouth_share, of)) = best else { continue };
        chosen.push((name.clone(), *door_share, *mouth_share));
        trials.extend(of.iter().filter(|trial| trial.world == *name).cloned());
    }
    LeftOut { bare: RoomMeans::of(&trials, false), furnished: RoomMeans::of(&trials, true), trials, chosen }
}

impl RoomMeans {
    fn of(trials: &[RoomTrial], is_furnished: bool) -> Self {
        let trials: Vec<&RoomTrial> = trials.iter().filter(|t| t.is_furnished == is_furnished).collect();
        let mean = |of: fn(&RoomTrial) -> f64| {
            trials.iter().map(|trial| of(trial)).sum::<f64>() / trials.len().max(1) as f64
        };
        Self {
            matthews: mean(|trial| trial.rooms.matthews),
            mean_iou: mean(|trial| trial.rooms.mean_iou),
            door_precision: mean(|trial| trial.doors.precision),
            door_recall: mean(|trial| trial.doors.recall),
        }
    }

    fn print(&self, of: &str) {
        println!(
            "{of}: Matthews correlation {:.3}, intersection over union {:.3}; doors: precision {:.3}, recall {:.3}",
            self.matthews, self.mean_iou, self.door_precision, self.door_recall
        );
    }
}

fn print_trials(trials: &[RoomTrial]) {
    let rows: Vec<Vec<String>> = trials
        .iter()
        .map(|trial| {
            vec![
                format!("{}{}", trial.world, if trial.is_furnished { ", furnished" } else { "" }),
                format!("{:.2}", trial.seen),
                format!("{:.3}", trial.rooms.matthews),
                format!("{:.3}", trial.rooms.mean_iou),
                format!("{} ({})", trial.rooms.rooms_found, trial.rooms.rooms),
                format!("{:.2} / {:.2}", trial.doors.precision, trial.doors.recall),
                format!("{} ({})", trial.doors.doors_found, trial.doors.doors),
            ]
        })
        .collect();
    let header = ["plan", "seen", "Matthews", "IoU", "rooms (drawn)", "doors P / R", "doors (drawn)"];
    println!("{}", table(&header, &rows));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_rooms_have_a_door_where_they_touch_along_a_line() {
        // Two rooms with a wall between them but for a gap of three cells and one of a single cell.
        let plan = "1111111111\n1111111111\n000...000.\n2222222222\n2222222222";
        let numbers: Vec<u32> = plan
            .bytes()
            .filter(|byte| *byte != b'\n')
            .map(|byte| if byte == b'.' { 2 } else { u32::from(byte - b'0') })
            .collect();
        let lines = doors_of(&numbers, 10, 0.2);
        let columns: Vec<f64> =
            lines.iter().map(|line| middle(line, |cell| Point2::new((cell % 10) as f64, 0.0)).x).collect();
        assert_eq!(columns, [4.0], "the gap of one cell is none");
    }
}
