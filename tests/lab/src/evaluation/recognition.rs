//! Precision and recall of place recognition (SPEC section 9).
//!
//! A match of two intervals claims its observations proportionally: a tenth of the way along one interval is said
//! to be the place a tenth of the way along the other (from its other end when driven the opposite way).

use std::collections::HashSet;
use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use super::revisits::{JudgedRun, Revisits, find_revisits, is_return};
use super::summary::share;
use locution_engine::geometry::angle_between;
use locution_engine::mapping::{Direction, Interval};

/// A claim is right when the two observations are truly nearer than this.
const RIGHT_CLAIM_M: f64 = 1.5;
/// What a map survives.
const HIGH_PRECISION: f64 = 0.99;
/// The curve is thinned to about this many points.
const MAX_CURVE_POINTS: usize = 200;

/// A match, as far as judging it needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgedMatch {
    /// One stretch; `run_idx` counts in the list of runs given to the judge.
    pub earlier: Interval,
    /// The other stretch.
    pub later: Interval,
    /// Same or opposite way.
    pub direction: Direction,
    /// Matches are ranked by this, best first.
    pub score: f64,
    /// Whether the map would use it.
    pub is_verified: bool,
}

/// Numbers of revisiting observations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RevisitCounts {
    /// Driven the same way before.
    pub same: usize,
    /// Driven the opposite way before.
    pub opposite: usize,
}

/// Precision and recall of all matches that score at least the threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Lowest score that counts.
    pub threshold: f64,
    /// Right claims among claims.
    pub precision: f64,
    /// Same-direction revisits with a right claim of that direction.
    pub recall_same: f64,
    /// Opposite-direction revisits with a right claim of that direction.
    pub recall_opposite: f64,
    /// Revisits with any right claim.
    pub recall_all: f64,
}

/// The largest recall at which precision is at least 0.99.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecallAtPrecision {
    /// Same direction.
    pub same: f64,
    /// Opposite direction.
    pub opposite: f64,
    /// Both.
    pub all: f64,
}

/// What the map would use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VerifiedReport {
    /// Claims of all verified matches.
    pub claims: usize,
    /// Right ones among them.
    pub precision: f64,
    /// Revisits with a right claim.
    pub recall_all: f64,
}

/// Everything that is measured of recognition; names and timing are the caller's to add.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecognitionReport {
    /// Observations with a true pose.
    pub observations: usize,
    /// Those that are revisits.
    pub revisits: RevisitCounts,
    /// Precision and recall over falling thresholds, all retrieved candidates.
    pub curve: Vec<CurvePoint>,
    /// The figure to compare.
    pub recall_at_precision_99: RecallAtPrecision,
    /// What the map would use.
    pub verified: VerifiedReport,
}

/// Judges all matches of a site. Claims about an observation whose true pose is unknown are left out.
///
/// Runs are named by index; a match that names a run or an observation that does not exist is left out.
pub fn judge_recognition(runs: &[JudgedRun], matches: &[JudgedMatch]) -> RecognitionReport {
    let revisits = find_revisits(runs);
    let known = runs.iter().flat_map(|run| &run.visits).filter(|visit| visit.truth_from_robot.is_some());
    let count = |flags: &[Vec<bool>]| flags.iter().flatten().filter(|&&is| is).count();
    let mut ranked: Vec<&JudgedMatch> = matches.iter().collect();
    ranked.sort_by(|a, b| b.score.total_cmp(&a.score));
    let (curve, recall_at_precision_99) = curve(runs, &revisits, &ranked);
    let mut verified = Tally::new(runs, &revisits);
    ranked.iter().filter(|judged| judged.is_verified).for_each(|judged| verified.add(judged));
    RecognitionReport {
        observations: known.count(),
        revisits: RevisitCounts { same: count(&revisits.same), opposite: count(&revisits.opposite) },
        curve,
        recall_at_precision_99,
        verified: VerifiedReport {
            claims: verified.num_claims,
            precision: share(verified.num_right, verified.num_claims),
            recall_all: verified.point(0.0).recall_all,
        },
    }
}

fn curve(
    runs: &[JudgedRun],
    revisits: &Revisits,
    ranked: &[&JudgedMatch],
) -> (Vec<CurvePoint>, RecallAtPrecision) {
    let mut tally = Tally::new(runs, revisits);
    let mut points = Vec::new();
    let mut best = RecallAtPrecision::default();
    for same_score in ranked.chunk_by(|a, b| a.score == b.score) {
        same_score.iter().for_each(|judged| tally.add(judged));
        let point = tally.point(same_score[0].score);
        if point.precision >= HIGH_PRECISION {
            best.same = best.same.max(point.recall_same);
            best.opposite = best.opposite.max(point.recall_opposite);
            best.all = best.all.max(point.recall_all);
        }
        points.push(point);
    }
    let stride = points.len().div_ceil(MAX_CURVE_POINTS).max(1);
    let last = points.len().saturating_sub(1);
    let thinned = points.into_iter().enumerate().filter(|(idx, _)| idx % stride == 0 || *idx == last);
    (thinned.map(|(_, point)| point).collect(), best)
}

/// Claims so far, and which revisits have a right one.
struct Tally<'a> {
    runs: &'a [JudgedRun],
    revisits: &'a Revisits,
    seen: HashSet<(u32, u32, u32, u32, Direction)>,
    num_claims: usize,
    num_right: usize,
    found_same: Vec<Vec<bool>>,
    found_opposite: Vec<Vec<bool>>,
    num_found: (usize, usize, usize),
    num_revisits: (usize, usize, usize),
}

impl<'a> Tally<'a> {
    fn new(runs: &'a [JudgedRun], revisits: &'a Revisits) -> Self {
        let none = || runs.iter().map(|run| vec![false; run.visits.len()]).collect();
        let count = |is: &dyn Fn(bool, bool) -> bool| {
            let pairs = revisits.same.iter().flatten().zip(revisits.opposite.iter().flatten());
            pairs.filter(|&(&same, &opposite)| is(same, opposite)).count()
        };
        Self {
            runs,
            revisits,
            seen: HashSet::new(),
            num_claims: 0,
            num_right: 0,
            found_same: none(),
            found_opposite: none(),
            num_found: (0, 0, 0),
            num_revisits: (count(&|same, _| same), count(&|_, opposite| opposite), count(&|a, b| a || b)),
        }
    }

    fn add(&mut self, judged: &JudgedMatch) {
        for (earlier, later) in claims(judged) {
            self.add_claim(
                (judged.earlier.run_idx, earlier),
                (judged.later.run_idx, later),
                judged.direction,
            );
        }
    }

    /// One pair of (run, observation), each judged once per direction.
    fn add_claim(&mut self, one: (u32, u32), other: (u32, u32), direction: Direction) {
        let (earlier, later) = if one <= other { (one, other) } else { (other, one) };
        let runs = self.runs;
        let visit = |(run, idx): (u32, u32)| runs.get(run as usize)?.visits.get(idx as usize);
        let (Some(first), Some(second)) = (visit(earlier), visit(later)) else { return };
        let (Some(first_pose), Some(second_pose)) = (first.truth_from_robot, second.truth_from_robot) else {
            return;
        };
        if !self.seen.insert((earlier.0, earlier.1, later.0, later.1, direction)) {
            return;
        }
        let same_frame = self.runs[earlier.0 as usize].truth_frame == self.runs[later.0 as usize].truth_frame;
        let is_same_way = angle_between(first_pose.theta, second_pose.theta) < FRAC_PI_2;
        let is_right = same_frame
            && first_pose.distance(&second_pose) < RIGHT_CLAIM_M
            && is_same_way == (direction == Direction::Same);
        self.num_claims += 1;
        self.num_right += usize::from(is_right);
        if is_right && is_return(earlier.0 == later.0, first, second) {
            self.mark(later, direction);
            if earlier.0 != later.0 {
                self.mark(earlier, direction);
            }
        }
    }

    fn mark(&mut self, (run, idx): (u32, u32), direction: Direction) {
        let (run, idx) = (run as usize, idx as usize);
        let (is_same, is_opposite) = (self.revisits.same[run][idx], self.revisits.opposite[run][idx]);
        let was_found = self.found_same[run][idx] || self.found_opposite[run][idx];
        if (is_same || is_opposite) && !was_found {
            self.num_found.2 += 1;
        }
        match direction {
            Direction::Same => {
                let found = &mut self.found_same[run][idx];
                self.num_found.0 += usize::from(is_same && !*found);
                *found = true;
            }
            Direction::Opposite => {
                let found = &mut self.found_opposite[run][idx];
                self.num_found.1 += usize::from(is_opposite && !*found);
                *found = true;
            }
        }
    }

    fn point(&self, threshold: f64) -> CurvePoint {
        CurvePoint {
            threshold,
            precision: share(self.num_right, self.num_claims),
            recall_same: share(self.num_found.0, self.num_revisits.0),
            recall_opposite: share(self.num_found.1, self.num_revisits.1),
            recall_all: share(self.num_found.2, self.num_revisits.2),
        }
    }
}

/// Pairs of observations, as many as the longer interval has.
fn claims(judged: &JudgedMatch) -> impl Iterator<Item = (u32, u32)> {
    let span = |interval: &Interval| interval.last.saturating_sub(interval.first);
    let (earlier, later, direction) = (judged.earlier, judged.later, judged.direction);
    let num_steps = span(&earlier).max(span(&later));
    (0..=num_steps).map(move |step| {
        let along = |interval: &Interval, step: u32| {
            let share = if num_steps == 0 { 0.0 } else { f64::from(step) / f64::from(num_steps) };
            interval.first + (share * f64::from(span(interval))).round() as u32
        };
        let earlier_step = match direction {
            Direction::Same => step,
            Direction::Opposite => num_steps - step,
        };
        (along(&earlier, earlier_step), along(&later, step))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::Visit;
    use locution_engine::geometry::Pose2;
    use std::f64::consts::PI;

    /// 0..10 m east, then (after a detour without truth) 0..10 m east again, then back west.
    fn three_passes() -> Vec<JudgedRun> {
        let pass = |from_m: f64, xs: Vec<f64>, theta: f64| {
            xs.into_iter().enumerate().map(move |(idx, x)| Visit {
                travel_m: from_m + idx as f64,
                truth_from_robot: Some(Pose2::new(x, 0.0, theta)),
            })
        };
        let east: Vec<f64> = (0..10).map(f64::from).collect();
        let west: Vec<f64> = (0..10).rev().map(f64::from).collect();
        let visits =
            pass(0.0, east.clone(), 0.0).chain(pass(100.0, east, 0.0)).chain(pass(200.0, west, PI)).collect();
        vec![JudgedRun { truth_frame: 0, visits }]
    }

    fn judged(earlier: (u32, u32), later: (u32, u32), direction: Direction, score: f64) -> JudgedMatch {
        let interval = |(first, last)| Interval { run_idx: 0, first, last };
        JudgedMatch {
            earlier: interval(earlier),
            later: interval(later),
            direction,
            score,
            is_verified: score > 0.5,
        }
    }

    #[test]
    fn right_and_wrong_matches_are_told_apart() {
        let matches = [
            judged((0, 9), (10, 19), Direction::Same, 0.9),
            judged((0, 9), (20, 29), Direction::Opposite, 0.8),
            // Claimed in the wrong direction: only near the middle are the places the same, and none of the headings.
            judged((0, 9), (20, 29), Direction::Same, 0.3),
        ];
        let report = judge_recognition(&three_passes(), &matches);
        assert_eq!(report.observations, 30);
        assert_eq!(report.revisits, RevisitCounts { same: 10, opposite: 10 });
        assert_eq!(report.curve.len(), 3);
        assert_eq!((report.curve[0].precision, report.curve[0].recall_same), (1.0, 1.0));
        assert_eq!((report.curve[0].recall_opposite, report.curve[0].recall_all), (0.0, 0.5));
        assert_eq!((report.curve[1].precision, report.curve[1].recall_all), (1.0, 1.0));
        assert_eq!(report.curve[2].precision, 20.0 / 30.0);
        assert_eq!(report.recall_at_precision_99, RecallAtPrecision { same: 1.0, opposite: 1.0, all: 1.0 });
        assert_eq!(report.verified, VerifiedReport { claims: 20, precision: 1.0, recall_all: 1.0 });
    }

    #[test]
    fn claims_are_proportional() {
        let stretched = judged((0, 4), (10, 18), Direction::Opposite, 1.0);
        let pairs: Vec<(u32, u32)> = claims(&stretched).collect();
        assert_eq!((pairs[0], pairs[4], pairs[8]), ((4, 10), (2, 14), (0, 18)));
        assert_eq!(claims(&judged((3, 3), (7, 7), Direction::Same, 1.0)).collect::<Vec<_>>(), [(3, 7)]);
    }

    #[test]
    fn a_match_between_buildings_is_false_and_a_nonsense_match_is_left_out() {
        let mut runs = three_passes();
        runs.push(JudgedRun { truth_frame: 1, visits: runs[0].visits[..10].to_vec() });
        let mut wrong = judged((0, 9), (0, 9), Direction::Same, 1.0);
        wrong.later.run_idx = 1;
        let mut nonsense = wrong;
        nonsense.later = Interval { run_idx: 7, first: 0, last: 3 };
        let report = judge_recognition(&runs, &[wrong, nonsense]);
        assert_eq!(report.verified, VerifiedReport { claims: 10, precision: 0.0, recall_all: 0.0 });
    }

    #[test]
    fn the_same_claim_counts_once() {
        let twice =
            [judged((0, 9), (10, 19), Direction::Same, 0.9), judged((0, 9), (10, 19), Direction::Same, 0.8)];
        assert_eq!(judge_recognition(&three_passes(), &twice).verified.claims, 10);
    }
}
