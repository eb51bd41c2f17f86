//! The surest paths of a graph from one pose to those about it.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::Matrix3;

use super::PoseGraph;
use super::support::Uncertain;

/// The constraints of a graph by the poses they lead from.
pub(super) struct Paths {
    steps: Vec<Vec<Step>>,
}

struct Step {
    to: u32,
    step: Uncertain,
    /// What the step adds to the doubt that paths are compared by.
    doubt: f64,
}

impl Paths {
    /// All constraints that determine all of the relative pose, either way.
    pub fn of(graph: &PoseGraph) -> Self {
        let mut steps: Vec<Vec<Step>> = graph.poses().iter().map(|_| Vec::new()).collect();
        for constraint in graph.constraints() {
            let Some(forward) = Uncertain::of(constraint) else { continue };
            let both =
                [(constraint.i, constraint.j, forward), (constraint.j, constraint.i, forward.inverse())];
            for (from, to, step) in both {
                // Metres and radians weigh alike: a radian moves what is a metre away by a metre.
                steps[from as usize].push(Step { to, step, doubt: step.covariance.trace() });
            }
        }
        Self { steps }
    }

    /// Finds the surest paths from a pose until all that are `wanted` are reached, going no farther than where the
    /// covariance is `sure`.
    pub fn search(
        &self,
        from: u32,
        wanted: &[u32],
        is_sure: impl Fn(&Matrix3<f64>) -> bool,
        search: &mut Search,
    ) {
        search.begin();
        search.offer(from, 0.0, Uncertain::EXACT);
        let mut num_missing = wanted.len();
        while let Some(Offer { pose, doubt, reached }) = search.heap.pop() {
            if !search.settle(pose, reached) {
                continue;
            }
            num_missing -= wanted.iter().filter(|&&other| other == pose).count();
            if num_missing == 0 {
                break;
            }
            if is_sure(&reached.covariance) {
                for step in &self.steps[pose as usize] {
                    if search.reached(step.to).is_none() {
                        search.offer(step.to, doubt + step.doubt, reached.compose(&step.step));
                    }
                }
            }
        }
    }
}

/// Working memory of [`Paths::search`], and what it found.
pub(super) struct Search {
    heap: BinaryHeap<Offer>,
    /// For every pose the number of the search that reached it last, and how.
    settled: Vec<(u32, Uncertain)>,
    number: u32,
}

impl Search {
    pub fn new(num_poses: usize) -> Self {
        Self { heap: BinaryHeap::new(), settled: vec![(0, Uncertain::EXACT); num_poses], number: 0 }
    }

    /// The pose along the surest path of the last search.
    pub fn reached(&self, pose: u32) -> Option<&Uncertain> {
        let (number, reached) = &self.settled[pose as usize];
        (*number == self.number).then_some(reached)
    }

    fn begin(&mut self) {
        self.heap.clear();
        self.number += 1;
    }

    fn offer(&mut self, pose: u32, doubt: f64, reached: Uncertain) {
        self.heap.push(Offer { pose, doubt, reached });
    }

    fn settle(&mut self, pose: u32, reached: Uncertain) -> bool {
        let settled = &mut self.settled[pose as usize];
        let is_first = settled.0 != self.number;
        if is_first {
            *settled = (self.number, reached);
        }
        is_first
    }
}

struct Offer {
    pose: u32,
    doubt: f64,
    reached: Uncertain,
}

/// The least doubt comes first, of equals the lower pose.
impl Ord for Offer {
    fn cmp(&self, other: &Self) -> Ordering {
        other.doubt.total_cmp(&self.doubt).then(other.pose.cmp(&self.pose))
    }
}

impl PartialOrd for Offer {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Offer {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Offer {}

#[cfg(test)]
mod tests {
    use super::super::CovarianceSolver;
    use super::super::testing::random_drive;
    use super::*;

    #[test]
    fn along_a_chain_the_covariance_is_that_of_the_whole_graph() {
        let (mut graph, _) = random_drive(3, 40, 0);
        super::super::optimize(&mut graph, &super::super::PoseGraphConfig::default()).unwrap();
        let paths = Paths::of(&graph);
        let mut search = Search::new(40);
        let mut solver = CovarianceSolver::new(&graph).unwrap();
        for (from, to) in [(0, 39), (17, 30), (30, 17), (5, 5)] {
            paths.search(from, &[to], |_| true, &mut search);
            let reached = search.reached(to).unwrap();
            let (pose, covariance) = solver.relative(from, to).unwrap();
            assert!(reached.pose.distance(&pose) < 1e-6);
            assert!(
                (reached.covariance - covariance).amax() <= 1e-6 * covariance.amax().max(1e-9),
                "{from} {to}"
            );
        }
    }

    #[test]
    fn with_closures_a_path_is_never_surer_than_the_whole_graph() {
        let (mut graph, _) = random_drive(4, 60, 40);
        super::super::optimize(&mut graph, &super::super::PoseGraphConfig::default()).unwrap();
        let paths = Paths::of(&graph);
        let mut search = Search::new(60);
        let mut solver = CovarianceSolver::new(&graph).unwrap();
        for (from, to) in [(0, 59), (17, 40), (50, 3)] {
            paths.search(from, &[to], |_| true, &mut search);
            let path = search.reached(to).unwrap().covariance;
            let (_, whole) = solver.relative(from, to).unwrap();
            assert!(path.determinant() >= 0.9 * whole.determinant(), "{from} {to}");
        }
        paths.search(0, &[59], |covariance| covariance.trace() < 1e-12, &mut search);
        assert!(search.reached(59).is_none(), "no farther than it is sure");
    }
}
