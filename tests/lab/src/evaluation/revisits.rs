//! Which observations were truly taken at a place that had been visited before (SPEC section 9).

use std::collections::BTreeMap;
use std::f64::consts::PI;

use locution_engine::geometry::{Pose2, angle_between};

/// Nearer than this is the same place.
const SAME_PLACE_M: f64 = 1.0;
/// A robot that has driven less than this has not come back.
const COMING_BACK_M: f64 = 10.0;
/// Headings closer than this are the same direction; closer to half a turn, opposite.
const SAME_HEADING_RAD: f64 = PI / 4.0;

/// One observation and where it truly was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// Distance driven since the run began, metres.
    pub travel_m: f64,
    /// True pose, where it is known.
    pub truth_from_robot: Option<Pose2>,
}

/// The observations of one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JudgedRun {
    /// Runs of one building share a frame of truth; runs of different buildings do not, and no place of one is
    /// ever a place of another.
    pub truth_frame: u32,
    /// In order of travel.
    pub visits: Vec<Visit>,
}

/// For every observation of every run, whether it is a revisit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Revisits {
    /// Driven the same way before, per run and observation.
    pub same: Vec<Vec<bool>>,
    /// Driven the opposite way before.
    pub opposite: Vec<Vec<bool>>,
}

/// Whether the later of two observations of one run, or either of two runs, revisits the other.
pub(super) fn is_return(same_run: bool, earlier: &Visit, later: &Visit) -> bool {
    !same_run || later.travel_m - earlier.travel_m >= COMING_BACK_M
}

/// Finds all revisits. Cost: observations times those within a metre.
pub fn find_revisits(runs: &[JudgedRun]) -> Revisits {
    let mut cells: BTreeMap<(u32, i64, i64), Vec<(usize, usize)>> = BTreeMap::new();
    let cell_of = |value: f64| (value / SAME_PLACE_M).floor() as i64;
    for (run_idx, run) in runs.iter().enumerate() {
        for (idx, visit) in run.visits.iter().enumerate() {
            if let Some(pose) = visit.truth_from_robot {
                cells
                    .entry((run.truth_frame, cell_of(pose.x), cell_of(pose.y)))
                    .or_default()
                    .push((run_idx, idx));
            }
        }
    }
    let none = |run: &JudgedRun| vec![false; run.visits.len()];
    let mut revisits =
        Revisits { same: runs.iter().map(none).collect(), opposite: runs.iter().map(none).collect() };
    for (run_idx, run) in runs.iter().enumerate() {
        for (idx, visit) in run.visits.iter().enumerate() {
            let Some(pose) = visit.truth_from_robot else { continue };
            let (column, row) = (cell_of(pose.x), cell_of(pose.y));
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (column + dx, row + dy)));
            let near = around.filter_map(|(x, y)| cells.get(&(run.truth_frame, x, y))).flatten();
            for &(other_run, other_idx) in near {
                let other = &runs[other_run].visits[other_idx];
                let Some(other_pose) = other.truth_from_robot else { continue };
                if !is_return(other_run == run_idx, other, visit) || pose.distance(&other_pose) > SAME_PLACE_M
                {
                    continue;
                }
                let apart_rad = angle_between(pose.theta, other_pose.theta);
                revisits.same[run_idx][idx] |= apart_rad <= SAME_HEADING_RAD;
                revisits.opposite[run_idx][idx] |= apart_rad >= PI - SAME_HEADING_RAD;
            }
        }
    }
    revisits
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn visit(travel_m: f64, x: f64, y: f64, theta: f64) -> Visit {
        Visit { travel_m, truth_from_robot: Some(Pose2::new(x, y, theta)) }
    }

    #[test]
    fn there_and_back() {
        let mut visits: Vec<Visit> =
            (0..20).map(|idx| visit(f64::from(idx), f64::from(idx), 0.0, 0.0)).collect();
        visits.extend((0..20).map(|idx| visit(f64::from(20 + idx), f64::from(19 - idx), 0.5, PI)));
        let revisits = find_revisits(&[JudgedRun { truth_frame: 0, visits }]);
        assert!(!revisits.same[0].contains(&true));
        // The turn itself is less than ten metres of driving away from where it began.
        let first = revisits.opposite[0].iter().position(|&is| is).unwrap();
        assert_eq!(first, 25);
        assert!(revisits.opposite[0][25..].iter().all(|&is| is));
    }

    #[test]
    fn runs_of_one_building_revisit_each_other_and_others_never() {
        let run = |truth_frame| JudgedRun { truth_frame, visits: vec![visit(0.0, 1.0, 1.0, 0.0)] };
        assert_eq!(find_revisits(&[run(0), run(0)]).same, [[true], [true]]);
        assert_eq!(find_revisits(&[run(0), run(1)]).same, [[false], [false]]);
    }

    #[test]
    fn cells_agree_with_looking_at_all_pairs() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let mut random_run = |truth_frame| JudgedRun {
            truth_frame,
            visits: (0..150)
                .map(|idx| {
                    let (x, y) = (rng.random_range(-4.0..4.0), rng.random_range(-4.0..4.0));
                    visit(f64::from(idx), x, y, rng.random_range(-PI..PI))
                })
                .collect(),
        };
        let runs = [random_run(0), random_run(0), random_run(1)];
        let fast = find_revisits(&runs);
        for (a, run) in runs.iter().enumerate() {
            for (i, visit) in run.visits.iter().enumerate() {
                let pose = visit.truth_from_robot.unwrap();
                let others = runs
                    .iter()
                    .enumerate()
                    .flat_map(|(b, run)| run.visits.iter().map(move |visit| (b, run.truth_frame, visit)));
                let near: Vec<f64> = others
                    .filter(|&(b, frame, other)| {
                        frame == run.truth_frame
                            && (b != a || visit.travel_m - other.travel_m >= 10.0)
                            && other.truth_from_robot.unwrap().distance(&pose) <= 1.0
                    })
                    .map(|(_, _, other)| angle_between(other.truth_from_robot.unwrap().theta, pose.theta))
                    .collect();
                assert_eq!(fast.same[a][i], near.iter().any(|apart| apart.to_degrees() <= 45.0));
                assert_eq!(fast.opposite[a][i], near.iter().any(|apart| apart.to_degrees() >= 135.0));
            }
        }
    }
}
