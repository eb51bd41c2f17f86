//! Places of the map: connected stretches of driven ground with one label, on which all passes have voted.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::config::SemanticsConfig;
use super::label::PlaceLabel;
use super::label_map::{DrivenRun, LabeledRun};
use super::outline::outline;
use crate::geometry::{Point2, Pose2, wrap_angle};
use crate::text::Interval;

/// A place of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// What it is.
    pub label: PlaceLabel,
    /// The share of the votes of all passes that agree with the label, in [0, 1].
    pub confidence: f32,
    /// Border of the ground that was driven, counter-clockwise, metres, closed implicitly.
    pub outline: Vec<Point2>,
    /// Mean of the positions observed in it.
    pub center: Point2,
    /// Length of the longest pass through it, metres.
    pub length_m: f64,
    /// Stretches of driving in it.
    pub visits: Vec<Interval>,
    /// Places that were driven to from it or from which it was entered, ascending.
    pub connections: Vec<u32>,
}

/// A pass through a place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Visit {
    /// The place.
    pub place: u32,
    /// The stretch of driving.
    pub interval: Interval,
    /// Way driven in it, metres.
    pub length_m: f64,
    /// From the direction in which it was entered to that in which it was left, radians, left positive.
    pub turn_rad: f64,
}

/// A spot of driven ground, where routes can go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spot {
    /// Mean of the positions observed there.
    pub position: Point2,
    /// The place it belongs to.
    pub place: u32,
    /// Spots that can be reached at once, ascending.
    pub neighbors: Vec<u32>,
}

/// All places of one component of a map.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaceMap {
    /// The places; their position in this list is their number.
    pub places: Vec<Place>,
    /// The passes of each run, in order of travel.
    pub visits: Vec<Vec<Visit>>,
    /// The ground they are made of.
    pub spots: Vec<Spot>,
}

type Key = (i64, i64);

/// What was seen in one cell of ground.
#[derive(Clone, Default)]
struct Ground {
    votes: [f32; 5],
    sum: Point2,
    num_observations: usize,
}

impl Ground {
    /// The label with most votes, the first of equals.
    fn label(&self) -> PlaceLabel {
        let mut best = PlaceLabel::Bifurcation;
        for label in PlaceLabel::ALL {
            if self.votes[label.index()] > self.votes[best.index()] {
                best = label;
            }
        }
        best
    }
}

impl PlaceMap {
    /// Gathers the labels of all runs of a component into places.
    pub fn build(config: &SemanticsConfig, runs: &[DrivenRun<'_>], labeled: &[LabeledRun]) -> Self {
        let key = |pose: &Pose2| -> Key {
            ((pose.x / config.place_cell_m).floor() as i64, (pose.y / config.place_cell_m).floor() as i64)
        };
        let mut grounds: BTreeMap<Key, Ground> = BTreeMap::new();
        let mut steps: BTreeSet<(Key, Key)> = BTreeSet::new();
        for (run, labels) in runs.iter().zip(labeled) {
            let mut last: Option<Key> = None;
            for (pose, (label, confidence)) in
                run.map_from_observations.iter().zip(labels.labels.iter().zip(&labels.confidences))
            {
                let here = key(pose);
                let ground = grounds.entry(here).or_default();
                ground.votes[label.index()] += confidence.max(0.01);
                ground.sum = Point2::new(ground.sum.x + pose.x, ground.sum.y + pose.y);
                ground.num_observations += 1;
                if let Some(last) = last.replace(here).filter(|last| *last != here) {
                    steps.insert((last, here));
                    steps.insert((here, last));
                }
            }
        }
        let labels = settled_labels(config, &grounds);
        let groups = connected(&labels);
        let mut map = Self { spots: spots(&grounds, &groups, &steps), ..Self::default() };
        map.visits = runs
            .iter()
            .enumerate()
            .map(|(run_idx, run)| {
                let place_of = |pose: &Pose2| groups[&key(pose)];
                visits(config, run_idx as u32, &run.map_from_observations, place_of)
            })
            .collect();
        map.places = describe(config, &grounds, &labels, &groups, &map.visits);
        map
    }

    /// The label of each observation of a run, as its place has it.
    pub fn labels_of_run(&self, run_idx: usize) -> Vec<PlaceLabel> {
        self.visits[run_idx]
            .iter()
            .flat_map(|visit| {
                let num = (visit.interval.last - visit.interval.first + 1) as usize;
                std::iter::repeat_n(self.places[visit.place as usize].label, num)
            })
            .collect()
    }
}

/// The label of each cell after places too small to be any have gone over to the neighbour they touch most.
fn settled_labels(config: &SemanticsConfig, grounds: &BTreeMap<Key, Ground>) -> BTreeMap<Key, PlaceLabel> {
    let mut labels: BTreeMap<Key, PlaceLabel> =
        grounds.iter().map(|(key, ground)| (*key, ground.label())).collect();
    let groups = connected(&labels);
    let mut members: BTreeMap<u32, Vec<Key>> = BTreeMap::new();
    for (key, group) in &groups {
        members.entry(*group).or_default().push(*key);
    }
    for cells in members.values().filter(|cells| cells.len() < config.place_cells_min) {
        let mut touched = [0usize; 5];
        for cell in cells {
            for neighbor in around(*cell) {
                if let Some(label) = labels.get(&neighbor)
                    && !cells.contains(&neighbor)
                {
                    touched[label.index()] += 1;
                }
            }
        }
        let most = PlaceLabel::ALL.into_iter().rev().max_by_key(|label| touched[label.index()]);
        if let Some(label) = most.filter(|label| touched[label.index()] > 0) {
            for cell in cells {
                labels.insert(*cell, label);
            }
        }
    }
    labels
}

/// Numbers groups of neighbouring cells of one label, in the order of their first cell.
fn connected(labels: &BTreeMap<Key, PlaceLabel>) -> BTreeMap<Key, u32> {
    let mut groups: BTreeMap<Key, u32> = BTreeMap::new();
    let mut num_groups = 0;
    for (start, label) in labels {
        if groups.contains_key(start) {
            continue;
        }
        groups.insert(*start, num_groups);
        let mut waiting = vec![*start];
        while let Some(cell) = waiting.pop() {
            for neighbor in around(cell) {
                if labels.get(&neighbor) == Some(label) && !groups.contains_key(&neighbor) {
                    groups.insert(neighbor, num_groups);
                    waiting.push(neighbor);
                }
            }
        }
        num_groups += 1;
    }
    groups
}

/// The eight cells around one.
fn around((column, row): Key) -> impl Iterator<Item = Key> {
    (-1..=1).flat_map(move |dy| {
        (-1..=1).filter(move |dx| (*dx, dy) != (0, 0)).map(move |dx| (column + dx, row + dy))
    })
}

/// Cells as nodes of routes: joined where a robot drove from one to the other, or where both were driven and touch.
fn spots(
    grounds: &BTreeMap<Key, Ground>,
    groups: &BTreeMap<Key, u32>,
    steps: &BTreeSet<(Key, Key)>,
) -> Vec<Spot> {
    let number: BTreeMap<Key, u32> = grounds.keys().zip(0..).map(|(key, number)| (*key, number)).collect();
    grounds
        .iter()
        .map(|(key, ground)| {
            let driven = steps.range((*key, (i64::MIN, i64::MIN))..=(*key, (i64::MAX, i64::MAX)));
            let reached = driven.map(|(_, to)| *to).chain(around(*key));
            let neighbors: BTreeSet<u32> = reached.filter_map(|to| number.get(&to).copied()).collect();
            let share = 1.0 / ground.num_observations.max(1) as f64;
            Spot {
                position: Point2::new(ground.sum.x * share, ground.sum.y * share),
                place: groups[key],
                neighbors: neighbors.into_iter().collect(),
            }
        })
        .collect()
}

/// The passes of one run through places.
fn visits(
    config: &SemanticsConfig,
    run_idx: u32,
    poses: &[Pose2],
    place_of: impl Fn(&Pose2) -> u32,
) -> Vec<Visit> {
    let places: Vec<u32> = poses.iter().map(place_of).collect();
    let mut travel_m = vec![0.0];
    for pair in poses.windows(2) {
        travel_m.push(travel_m[travel_m.len() - 1] + pair[0].distance(&pair[1]));
    }
    let mut visits = Vec::new();
    let mut first = 0;
    for last in 0..places.len() {
        if last + 1 < places.len() && places[last + 1] == places[first] {
            continue;
        }
        let entered = travel_m.partition_point(|&travel| travel < travel_m[first] - config.turn_reach_m);
        let left = travel_m.partition_point(|&travel| travel <= travel_m[last] + config.turn_reach_m) - 1;
        let turn_rad = match (direction(poses, entered, first), direction(poses, last, left)) {
            (Some(entering), Some(leaving)) => wrap_angle(leaving - entering),
            _ => 0.0,
        };
        visits.push(Visit {
            place: places[first],
            interval: Interval { run_idx, first: first as u32, last: last as u32 },
            length_m: travel_m[last] - travel_m[first],
            turn_rad,
        });
        first = last + 1;
    }
    visits
}

/// Direction from one position to another, unless they are the same.
fn direction(poses: &[Pose2], from: usize, to: usize) -> Option<f64> {
    let (dx, dy) = (poses[to].x - poses[from].x, poses[to].y - poses[from].y);
    (dx.hypot(dy) > 1e-6).then(|| dy.atan2(dx))
}

fn describe(
    config: &SemanticsConfig,
    grounds: &BTreeMap<Key, Ground>,
    labels: &BTreeMap<Key, PlaceLabel>,
    groups: &BTreeMap<Key, u32>,
    visits: &[Vec<Visit>],
) -> Vec<Place> {
    let mut members: BTreeMap<u32, Vec<Key>> = BTreeMap::new();
    for (key, group) in groups {
        members.entry(*group).or_default().push(*key);
    }
    let mut places: Vec<Place> = members
        .values()
        .map(|cells| {
            let label = labels[&cells[0]];
            let (mut agreeing, mut votes, mut sum, mut num) = (0.0f32, 0.0f32, Point2::default(), 0usize);
            for cell in cells {
                let ground = &grounds[cell];
                agreeing += ground.votes[label.index()];
                votes += ground.votes.iter().sum::<f32>();
                sum = Point2::new(sum.x + ground.sum.x, sum.y + ground.sum.y);
                num += ground.num_observations;
            }
            Place {
                label,
                confidence: agreeing / votes.max(f32::MIN_POSITIVE),
                outline: outline(cells, config.place_cell_m),
                center: Point2::new(sum.x / num.max(1) as f64, sum.y / num.max(1) as f64),
                length_m: 0.0,
                visits: Vec::new(),
                connections: Vec::new(),
            }
        })
        .collect();
    for run in visits {
        for (position, visit) in run.iter().enumerate() {
            let beside = [position.checked_sub(1), Some(position + 1)];
            let connections = beside.into_iter().flatten().filter_map(|idx| run.get(idx)).map(|v| v.place);
            let place = &mut places[visit.place as usize];
            place.length_m = place.length_m.max(visit.length_m);
            place.visits.push(visit.interval);
            place.connections.extend(connections);
        }
    }
    for place in &mut places {
        place.connections.sort_unstable();
        place.connections.dedup();
    }
    places
}
