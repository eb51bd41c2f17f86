//! The rival of Tables 4.2 and 5.1: every pair of local maps is put through ICP, and good fits are claimed.
//!
//! As good as it can be made at the thesis' 150 points: occupied cells of the same local map, spread evenly; the
//! first guess is "same place, same heading", which is what a revisit is; the worst fifth of the correspondences is
//! left out (trimmed ICP); fits that end elsewhere than where a revisit can be are refused; the score is the mean
//! distance of the rest.

use crate::evaluation::{CurvePoint, JudgedMatch, judge_recognition};
use anyhow::Result;
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::grid::{Cell, LocalMap};
use locution_engine::mapping::Interval;
use locution_engine::text::Direction;
use locution_engine::translator::Translator;
use locution_engine::translator::TranslatorConfig;
use rayon::prelude::*;

use super::scenarios::Scenario;
use super::text_sweep::Texts;

/// A local map every so many observations ("regions created at each 20 steps").
const STEP_OBSERVATIONS: usize = 20;
const NUM_POINTS: usize = 150;
const NUM_ITERATIONS: usize = 12;
/// Correspondences farther apart than this are none.
const REACH_M: f64 = 1.5;
/// Share of the correspondences that count.
const KEPT_SHARE: f64 = 0.8;
const CELL_M: f64 = 0.5;
/// Edge of the bucket grid, in buckets; it holds the local map of 9 m radius and the reach around it.
const GRID: usize = 44;

/// Points of one local map in the robot's frame, in buckets.
struct Submap {
    run: u32,
    observation: u32,
    travel_m: f64,
    points: Vec<Point2>,
    buckets: Vec<Vec<u16>>,
}

impl Submap {
    fn new(run: u32, observation: u32, travel_m: f64, points: Vec<Point2>) -> Self {
        let mut buckets = vec![Vec::new(); GRID * GRID];
        for (idx, point) in points.iter().enumerate() {
            if let Some((column, row)) = bucket(point) {
                buckets[row * GRID + column].push(idx as u16);
            }
        }
        Self { run, observation, travel_m, points, buckets }
    }

    /// The nearest point within reach, and its squared distance.
    fn nearest(&self, place: &Point2) -> Option<(usize, f64)> {
        let (column, row) = bucket(place)?;
        let mut best: Option<(usize, f64)> = None;
        for ring in 0..=(REACH_M / CELL_M) as usize {
            // Whatever lies farther out is farther than this.
            if best.is_some_and(|(_, squared)| squared < ((ring as f64 - 1.0).max(0.0) * CELL_M).powi(2)) {
                break;
            }
            let (low_row, high_row) = (row.saturating_sub(ring), (row + ring).min(GRID - 1));
            let (low_column, high_column) = (column.saturating_sub(ring), (column + ring).min(GRID - 1));
            for y in low_row..=high_row {
                for x in low_column..=high_column {
                    if y.abs_diff(row).max(x.abs_diff(column)) != ring {
                        continue;
                    }
                    for &idx in &self.buckets[y * GRID + x] {
                        let point = &self.points[usize::from(idx)];
                        let squared = (point.x - place.x).powi(2) + (point.y - place.y).powi(2);
                        if best.is_none_or(|(_, least)| squared < least) {
                            best = Some((usize::from(idx), squared));
                        }
                    }
                }
            }
        }
        best.filter(|&(_, squared)| squared <= REACH_M * REACH_M)
    }
}

fn bucket(point: &Point2) -> Option<(usize, usize)> {
    let along = |value: f64| {
        let cell = (value / CELL_M).floor() + GRID as f64 / 2.0;
        (cell >= 0.0 && cell < GRID as f64).then_some(cell as usize)
    };
    Some((along(point.x)?, along(point.y)?))
}

/// Precision and recall of ICP over all acceptance thresholds; the score is minus the mean distance in metres.
///
/// # Errors
/// A configuration that cannot work.
pub(super) fn icp_curve(
    scenario: &Scenario,
    texts: &Texts,
    config: &TranslatorConfig,
) -> Result<Vec<CurvePoint>> {
    let submaps = submaps_of(scenario, texts, config)?;
    let matches: Vec<JudgedMatch> = (0..submaps.len())
        .into_par_iter()
        .flat_map_iter(|later_idx| {
            let later = &submaps[later_idx];
            let submaps = &submaps;
            let earlier = submaps[..later_idx]
                .iter()
                .filter(move |earlier| earlier.run != later.run || later.travel_m - earlier.travel_m >= 10.0);
            earlier.filter_map(move |earlier| claim(earlier, later))
        })
        .collect();
    Ok(judge_recognition(&texts.runs, &matches).curve)
}

fn claim(earlier: &Submap, later: &Submap) -> Option<JudgedMatch> {
    let (earlier_from_later, mean_distance_m) = trimmed_icp(earlier, later)?;
    let stays = earlier_from_later.x.hypot(earlier_from_later.y) < 1.5
        && earlier_from_later.theta.abs() < std::f64::consts::FRAC_PI_4;
    // A fit that is worse than this would only fill memory: no threshold worth having lets it in.
    if !stays || mean_distance_m > 0.25 {
        return None;
    }
    let around = |submap: &Submap| Interval {
        run_idx: submap.run,
        first: submap.observation.saturating_sub(STEP_OBSERVATIONS as u32 / 2),
        last: submap.observation + STEP_OBSERVATIONS as u32 / 2,
    };
    Some(JudgedMatch {
        earlier: around(earlier),
        later: around(later),
        direction: Direction::Same,
        // Centimetres are as fine as thresholds need to be.
        score: -(mean_distance_m * 200.0).round() / 200.0,
        is_verified: false,
    })
}

/// Where the later map lies in the earlier one, and the mean distance of the correspondences that count.
fn trimmed_icp(earlier: &Submap, later: &Submap) -> Option<(Pose2, f64)> {
    let mut earlier_from_later = Pose2::identity();
    let mut mean_distance_m = f64::INFINITY;
    for _ in 0..NUM_ITERATIONS {
        let mut pairs: Vec<(f64, Point2, Point2)> = later
            .points
            .iter()
            .filter_map(|point| {
                let moved = earlier_from_later.transform_point(point);
                let (idx, squared) = earlier.nearest(&moved)?;
                Some((squared, moved, earlier.points[idx]))
            })
            .collect();
        // Points without a counterpart count as the worst ones.
        let num_kept = (later.points.len() as f64 * KEPT_SHARE) as usize;
        if num_kept < 20 || pairs.len() < num_kept {
            return None;
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs.truncate(num_kept);
        let mean = pairs.iter().map(|pair| pair.0.sqrt()).sum::<f64>() / num_kept as f64;
        if mean_distance_m - mean < 1e-4 {
            return Some((earlier_from_later, mean_distance_m.min(mean)));
        }
        mean_distance_m = mean;
        earlier_from_later = rigid_step(&pairs).compose(&earlier_from_later);
    }
    Some((earlier_from_later, mean_distance_m))
}

/// The motion that brings the second of each triple nearest to the third.
fn rigid_step(pairs: &[(f64, Point2, Point2)]) -> Pose2 {
    let num = pairs.len() as f64;
    let mean = |of: &dyn Fn(&(f64, Point2, Point2)) -> f64| pairs.iter().map(of).sum::<f64>() / num;
    let from = Point2::new(mean(&|pair| pair.1.x), mean(&|pair| pair.1.y));
    let to = Point2::new(mean(&|pair| pair.2.x), mean(&|pair| pair.2.y));
    let (mut along, mut across) = (0.0, 0.0);
    for (_, a, b) in pairs {
        let ((ax, ay), (bx, by)) = ((a.x - from.x, a.y - from.y), (b.x - to.x, b.y - to.y));
        along += ax * bx + ay * by;
        across += ax * by - ay * bx;
    }
    let theta = across.atan2(along);
    let (sin, cos) = theta.sin_cos();
    Pose2::new(to.x - cos * from.x + sin * from.y, to.y - sin * from.x - cos * from.y, theta)
}

/// Drives the runs once more and takes the local map at every twentieth observation.
fn submaps_of(scenario: &Scenario, texts: &Texts, config: &TranslatorConfig) -> Result<Vec<Submap>> {
    let mut submaps = Vec::new();
    for (run_idx, run) in scenario.runs.iter().enumerate() {
        let mut translator = Translator::new(config, run.geometry.clone())?;
        let mut next = STEP_OBSERVATIONS / 2;
        let mut num_observations = 0;
        for scan in &run.scans {
            let translation = translator.push(scan);
            num_observations += translation.observations.len();
            if num_observations <= next {
                continue;
            }
            let robot_from_run = translation.run_from_robot.inverse();
            let occupied: Vec<Point2> = occupied_points(translator.local_map(), config.local_map.radius_m)
                .map(|point| robot_from_run.transform_point(&point))
                .collect();
            let travel_m = texts.observations[run_idx][next].travel_m;
            submaps.push(Submap::new(run_idx as u32, next as u32, travel_m, spread(&occupied)));
            next += STEP_OBSERVATIONS;
        }
    }
    Ok(submaps)
}

/// Centres of the occupied cells around the robot, in the run's frame.
fn occupied_points(map: &LocalMap, radius_m: f64) -> impl Iterator<Item = Point2> + '_ {
    let reach = (radius_m / map.resolution_m()).ceil() as i32;
    map.robot_cell().into_iter().flat_map(move |center| {
        let around = (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dx| (dx, dy)));
        around
            .map(move |(dx, dy)| Cell { x: center.x + dx, y: center.y + dy })
            .filter(|&cell| map.is_occupied(cell))
            .map(|cell| cell.center(map.resolution_m()))
    })
}

/// About [`NUM_POINTS`] of the points, evenly through their list.
fn spread(points: &[Point2]) -> Vec<Point2> {
    let num = points.len().min(NUM_POINTS);
    (0..num).map(|idx| points[idx * points.len() / num]).collect()
}
