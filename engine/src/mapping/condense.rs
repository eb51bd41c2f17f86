//! Which exemplars of runs stand for a place: a bounded number, however often it was driven.
//!
//! Whoever was first somewhere stays, so that the map keeps its place over the years; beside it stands whoever was there
//! last, so that it shows what is there now.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_3;

use super::config::MappingConfig;
use super::exemplar::{Chunk, Exemplar};
use crate::geometry::{Pose2, angle_between};

/// Exemplars are cut at every so much travel, metres: longer than the longest window of profiles, so that they can be found.
const CHUNK_M: f64 = 24.0;
/// A place is covered by another this near, metres …
const COVER_M: f64 = 3.0;
/// … that was passed in about the same direction.
const COVER_RAD: f64 = FRAC_PI_3;
/// Places that stand for something, in squares as wide as one covers.
#[derive(Default)]
struct Covered {
    squares: BTreeMap<(i64, i64), Vec<(Pose2, usize, f64)>>,
}

impl Covered {
    fn square(pose: &Pose2) -> (i64, i64) {
        ((pose.x / COVER_M).floor() as i64, (pose.y / COVER_M).floor() as i64)
    }

    fn add(&mut self, chunk: &Chunk, exemplar: usize) {
        for (pose, travel_m) in &chunk.places {
            self.squares.entry(Self::square(pose)).or_default().push((*pose, exemplar, *travel_m));
        }
    }

    /// True when at least half of the places of a part are new.
    fn lacks(&self, chunk: &Chunk, exemplar: usize, min_gap_m: f64) -> bool {
        let is_new = |place: &&(Pose2, f64)| !self.holds(place, exemplar, min_gap_m);
        2 * chunk.places.iter().filter(is_new).count() >= chunk.places.len()
    }

    /// True when a place lies beside one that was added; what the same exemplar passes right before does not count.
    fn holds(&self, (pose, travel_m): &(Pose2, f64), exemplar: usize, min_gap_m: f64) -> bool {
        let (x, y) = Self::square(pose);
        let covers = |(other, of, at_m): &(Pose2, usize, f64)| {
            let is_right_before = *of == exemplar && (at_m - travel_m).abs() < min_gap_m;
            !is_right_before
                && pose.distance(other) <= COVER_M
                && angle_between(pose.theta, other.theta) <= COVER_RAD
        };
        (y - 1..=y + 1)
            .flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)))
            .filter_map(|square| self.squares.get(&square))
            .any(|places| places.iter().any(covers))
    }
}

/// Chooses the parts of exemplars that stand for a body, of exemplars in the order in which they were driven. The first
/// `num_kept` exemplars were chosen before: founders among them stay.
pub(crate) fn condensed(exemplars: &[Exemplar], num_kept: usize, config: &MappingConfig) -> Vec<Exemplar> {
    let chunks: Vec<Vec<Chunk>> =
        exemplars.iter().map(|exemplar| exemplar.chunks(CHUNK_M, config.anchor_spacing_m)).collect();
    let mut roles: Vec<Vec<Option<bool>>> = chunks.iter().map(|chunks| vec![None; chunks.len()]).collect();
    let mut founded = Covered::default();
    for (exemplar, chunks) in chunks.iter().enumerate() {
        let is_firm = exemplar < num_kept && exemplars[exemplar].is_founder;
        for (idx, chunk) in chunks.iter().enumerate() {
            if is_firm || founded.lacks(chunk, exemplar, config.min_gap_m) {
                roles[exemplar][idx] = Some(true);
                founded.add(chunk, exemplar);
            }
        }
    }
    let mut recent = Covered::default();
    for (exemplar, chunks) in chunks.iter().enumerate().rev() {
        for (idx, chunk) in chunks.iter().enumerate() {
            if roles[exemplar][idx].is_some() {
                continue;
            }
            if recent.lacks(chunk, exemplar, config.min_gap_m) {
                roles[exemplar][idx] = Some(false);
                recent.add(chunk, exemplar);
            }
        }
    }
    let mut chosen = Vec::new();
    for ((exemplar, chunks), roles) in exemplars.iter().zip(&chunks).zip(&roles) {
        let with_roles: Vec<(&Chunk, Option<bool>)> = chunks.iter().zip(roles.iter().copied()).collect();
        for alike in with_roles.chunk_by(|a, b| a.1 == b.1) {
            let (Some(is_founder), Some((first, _)), Some((last, _))) =
                (alike[0].1, alike.first(), alike.last())
            else {
                continue;
            };
            chosen.push(exemplar.part(first.keyframes.start..last.keyframes.end, is_founder));
        }
    }
    chosen
}
