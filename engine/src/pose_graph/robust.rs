//! Least squares that survives wrong constraints.
//!
//! Where all constraints fit together nothing is doubted. Else they are first taken in one after the other, the surest
//! first (`surest_first.rs`); what that cannot place is left out, unless it holds parts of the graph together. Then
//! doubtful constraints get weights w in [0, 1] that multiply their information; solving and reweighting alternate.
//!
//! - *Graduated non-convexity* with truncated least squares: begin with a kernel so flat that the problem is nearly
//!   ordinary least squares, sharpen it step by step, end with weights of 0 or 1.
//! - *Dynamic covariance scaling*: w = s², s = min(1, 2c / (c + χ²)), sharp from the start.
//!
//! What is left is decided by χ²: the graph is solved with the accepted constraints alone, then every doubtful
//! constraint is judged by how it fits the result, until nothing changes. Rejected constraints stay in the graph
//! with their weight, so that a caller can show them.

use super::components::Components;
use super::covariance::CovarianceSolver;
use super::optimizer::Problem;
use super::support::find_backing;
use super::surest_first::{Judge, Standing, judge_surest_first, pose_space};
use super::{
    Kernel, Method, OptimizeReport, PoseConstraint, PoseGraph, PoseGraphConfig, PoseGraphError, RobustConfig,
    Start, Trust, optimize, spanning_tree_start,
};

/// What robust optimisation did.
#[derive(Clone, Debug, PartialEq)]
pub struct RobustReport {
    /// The final solve over the accepted constraints; `iterations` counts all linear solves, `chi2_initial` is that
    /// of all constraints at the poses as given.
    pub report: OptimizeReport,
    /// Weight of every constraint, 1: counts fully, 0: rejected.
    pub inlier_weights: Vec<f64>,
    /// Number of constraints with weight 0.
    pub num_rejected: usize,
}

/// Weights never fall below this while solving, or poses that only wrong constraints reach would be undetermined.
const WEIGHT_FLOOR: f64 = 1e-6;
/// Rounds of judging every doubtful constraint by the result.
const MAX_JUDGEMENTS: usize = 10;
/// Damping for a system that has become singular to working precision.
const RESCUE_DAMPING: f64 = 1e-6;
/// A weight that changes by less counts as settled.
const WEIGHT_TOLERANCE: f64 = 1e-3;

/// Moves the poses to the least χ² over the constraints that hold together; on an error the graph is unchanged.
///
/// Starts at the given poses or at the chain of trusted constraints, whichever fits better. Trusted constraints are
/// never rejected. When rejection cuts the graph, each part keeps its own frame and `num_components` says so.
///
/// # Errors
/// As [`optimize`].
pub fn optimize_robust(
    graph: &mut PoseGraph,
    config: &PoseGraphConfig,
    robust: &RobustConfig,
) -> Result<RobustReport, PoseGraphError> {
    robust.validate("robust")?;
    let num_constraints = graph.constraints().len();
    if robust.kernel == Kernel::None {
        let report = optimize(graph, config)?;
        return Ok(RobustReport { report, inlier_weights: vec![1.0; num_constraints], num_rejected: 0 });
    }
    config.validate("pose_graph")?;
    if graph.poses().is_empty() {
        return Err(PoseGraphError::Empty);
    }
    let chi2_initial = graph.chi2();
    let mut started = graph.clone();
    choose_start(&mut started, config, robust);
    let backing = find_backing(&started, robust);
    let bound = robust.inlier_chi2_max * backing.covariance_scale;
    let is_candidate = if all_fit(&mut started, config, bound) {
        vec![true; num_constraints]
    } else {
        let given = PoseGraphConfig { start: Start::Given, ..config.clone() };
        let standings = judge_surest_first(&mut started, &given, bound, robust.support_steps_max)?;
        candidates(&started, &backing.is_backed, &standings)
    };
    let candidate_graph = started.with_constraints(|index| is_candidate[index]);
    let mut reweighting = Reweighting::new(&candidate_graph, robust, bound)?;
    let num_solves = reweighting.run()?;
    let mut weights = reweighting.problem.weights.iter();
    let mut is_heavy = || weights.next().is_some_and(|&weight| weight >= 0.5);
    let is_accepted: Vec<bool> = is_candidate.iter().map(|&candidate| candidate && is_heavy()).collect();
    started.replace_poses(reweighting.problem.into_poses());
    let (mut report, is_accepted) = judge(&mut started, is_accepted, config, bound)?;
    report.iterations += num_solves;
    report.chi2_initial = chi2_initial;
    graph.replace_poses(started.poses().to_vec());
    Ok(RobustReport {
        report,
        num_rejected: is_accepted.iter().filter(|&&accepted| !accepted).count(),
        inlier_weights: is_accepted.iter().map(|&accepted| f64::from(u8::from(accepted))).collect(),
    })
}

/// Whether nothing need be doubted: all constraints fit the solution with all of them, to which the poses then move.
fn all_fit(graph: &mut PoseGraph, config: &PoseGraphConfig, bound: f64) -> bool {
    let mut solved = graph.clone();
    let fits = |solved: &PoseGraph| {
        let is_doubtful = |index: &usize| solved.trusts()[*index] == Trust::Doubtful;
        let mut doubtful = (0..solved.constraints().len()).filter(is_doubtful);
        doubtful.all(|index| solved.constraint_chi2(index as u32).is_some_and(|chi2| chi2 <= bound))
    };
    // A graph without wrong constraints needs few; with many of them each is dear, since they tie all to all.
    let few = PoseGraphConfig {
        max_iterations: config.max_iterations.min(ITERATIONS_WITHOUT_DOUBT),
        ..config.clone()
    };
    let all_fit = optimize(&mut solved, &few).is_ok() && fits(&solved);
    if all_fit {
        *graph = solved;
    }
    all_fit
}

/// The constraints that take part in the reweighting: those accepted, and of those that are still open the ones without
/// which parts of the graph would not hang together. Where no doubtful one could be accepted they are those that a
/// neighbour backs, or all that are open when none is backed.
fn candidates(graph: &PoseGraph, is_backed: &[bool], standings: &[Standing]) -> Vec<bool> {
    let all = || graph.constraints().iter().enumerate();
    let is_open = |index: usize| standings[index] == Standing::Open;
    let has_accepted = all()
        .any(|(index, _)| standings[index] == Standing::Accepted && graph.trusts()[index] == Trust::Doubtful);
    let any_backed = all().any(|(index, _)| is_open(index) && is_backed[index]);
    let is_sure = |index: usize| match standings[index] {
        Standing::Accepted => true,
        Standing::Refuted => false,
        Standing::Open => !has_accepted && (!any_backed || is_backed[index]),
    };
    let components = Components::of(graph, is_sure);
    let component_of = |pose: u32| components.component_of_pose[pose as usize];
    let joins = |constraint: &PoseConstraint| component_of(constraint.i) != component_of(constraint.j);
    all().map(|(index, constraint)| is_sure(index) || is_open(index) && joins(constraint)).collect()
}

/// Keeps the given poses unless the chain of trusted constraints has the smaller truncated cost.
fn choose_start(graph: &mut PoseGraph, config: &PoseGraphConfig, robust: &RobustConfig) {
    if config.start == Start::Given {
        return;
    }
    let mut chained = graph.clone();
    spanning_tree_start(&mut chained, &vec![false; graph.poses().len()]);
    if truncated_cost(&chained, robust) < truncated_cost(graph, robust) {
        *graph = chained;
    }
}

/// Σ min(χ², c) over the doubtful and Σ χ² over the trusted constraints.
fn truncated_cost(graph: &PoseGraph, robust: &RobustConfig) -> f64 {
    let cost = |(index, &trust): (usize, &Trust)| {
        let chi2 = graph.constraint_chi2(index as u32).unwrap_or_default();
        if trust == Trust::Doubtful { chi2.min(robust.inlier_chi2_max) } else { chi2 }
    };
    graph.trusts().iter().enumerate().map(cost).sum()
}

/// Alternates linear solves and new weights.
struct Reweighting<'a> {
    problem: Problem<'a>,
    doubtful: Vec<usize>,
    robust: &'a RobustConfig,
    /// Largest χ² of a right constraint.
    bound: f64,
    num_solves: u32,
}

impl<'a> Reweighting<'a> {
    fn new(graph: &'a PoseGraph, robust: &'a RobustConfig, bound: f64) -> Result<Self, PoseGraphError> {
        let components = Components::of(graph, |_| true);
        let is_doubtful = |&index: &usize| graph.trusts()[index] == Trust::Doubtful;
        let doubtful = (0..graph.constraints().len()).filter(is_doubtful).collect();
        Ok(Self { problem: Problem::new(graph, &components)?, doubtful, robust, bound, num_solves: 0 })
    }

    /// Returns the number of linear solves.
    fn run(&mut self) -> Result<u32, PoseGraphError> {
        match self.robust.kernel {
            Kernel::None => {}
            Kernel::GraduatedNonConvexity => self.run_graduated()?,
            Kernel::DynamicCovarianceScaling => self.run_scaled()?,
        }
        Ok(self.num_solves)
    }

    fn run_graduated(&mut self) -> Result<(), PoseGraphError> {
        let bound = self.bound;
        let largest = self.doubtful_chi2s().into_iter().fold(0.0, f64::max);
        if largest <= bound {
            return Ok(());
        }
        let mut sharpness = bound / (2.0 * largest - bound);
        while self.num_solves < self.robust.max_reweightings {
            self.solve()?;
            let change = self.reweight(|chi2| truncated_weight(chi2, bound, sharpness));
            let is_binary = |&index: &usize| {
                let weight = self.problem.weights[index];
                !(WEIGHT_TOLERANCE..=1.0 - WEIGHT_TOLERANCE).contains(&weight)
            };
            if sharpness > 1.0 && change < WEIGHT_TOLERANCE && self.doubtful.iter().all(is_binary) {
                return Ok(());
            }
            sharpness *= self.robust.sharpening;
        }
        Ok(())
    }

    fn run_scaled(&mut self) -> Result<(), PoseGraphError> {
        let bound = self.bound;
        let scaled = |chi2: f64| (2.0 * bound / (bound + chi2)).min(1.0).powi(2);
        self.reweight(scaled);
        while self.num_solves < self.robust.max_reweightings {
            self.solve()?;
            if self.reweight(scaled) < WEIGHT_TOLERANCE {
                break;
            }
        }
        Ok(())
    }

    fn solve(&mut self) -> Result<(), PoseGraphError> {
        self.num_solves += 1;
        match self.problem.step(0.0) {
            Err(PoseGraphError::NotPositiveDefinite { .. }) => self.problem.step(RESCUE_DAMPING),
            result => result,
        }
    }

    fn doubtful_chi2s(&self) -> Vec<f64> {
        let all: Vec<f64> = self.problem.constraint_chi2s().collect();
        self.doubtful.iter().map(|&index| all[index]).collect()
    }

    /// Gives every doubtful constraint a new weight; returns the largest change.
    fn reweight(&mut self, weight_of: impl Fn(f64) -> f64) -> f64 {
        let mut change = 0.0_f64;
        for (&index, chi2) in self.doubtful.iter().zip(self.doubtful_chi2s()) {
            let weight = weight_of(chi2).max(WEIGHT_FLOOR);
            change = change.max((weight - self.problem.weights[index]).abs());
            self.problem.weights[index] = weight;
        }
        change
    }
}

/// Weight of truncated least squares at a stage of graduation; flat for small, a step at the bound for large
/// `sharpness` (μ of Yang et al., Eq 14).
fn truncated_weight(chi2: f64, bound: f64, sharpness: f64) -> f64 {
    if chi2 <= bound * sharpness / (sharpness + 1.0) {
        return 1.0;
    }
    if chi2 >= bound * (sharpness + 1.0) / sharpness {
        return 0.0;
    }
    (bound / chi2 * sharpness * (sharpness + 1.0)).sqrt() - sharpness
}

/// Solves with the accepted constraints alone and judges all doubtful ones by the result, until that is stable.
fn judge(
    graph: &mut PoseGraph,
    mut is_accepted: Vec<bool>,
    config: &PoseGraphConfig,
    bound: f64,
) -> Result<(OptimizeReport, Vec<bool>), PoseGraphError> {
    let config = PoseGraphConfig { start: Start::Given, ..config.clone() };
    let mut num_solves = 0;
    let mut round = 0;
    loop {
        round += 1;
        let mut accepted = graph.with_constraints(|index| is_accepted[index]);
        let mut report = solve_accepted(&mut accepted, &config)?;
        num_solves += report.iterations;
        report.iterations = num_solves;
        graph.replace_poses(accepted.poses().to_vec());
        let verdicts = verdicts(graph, &accepted, &is_accepted, bound)?;
        if verdicts == is_accepted || round == MAX_JUDGEMENTS {
            return Ok((report, is_accepted));
        }
        is_accepted = verdicts;
    }
}

pub(super) fn solve_accepted(
    graph: &mut PoseGraph,
    config: &PoseGraphConfig,
) -> Result<OptimizeReport, PoseGraphError> {
    match optimize(graph, config) {
        Err(PoseGraphError::NotPositiveDefinite { .. }) => {
            optimize(graph, &PoseGraphConfig { method: Method::LevenbergMarquardt, ..config.clone() })
        }
        result => result,
    }
}

/// Which constraints fit the present poses.
///
/// An accepted one has pulled the poses to itself and must fit well. A rejected one is measured against how sure the
/// accepted ones are of the poses it joins; where they are so unsure that a random constraint would pass, it stays
/// rejected, as does one that joins two components.
fn verdicts(
    graph: &PoseGraph,
    accepted: &PoseGraph,
    is_accepted: &[bool],
    bound: f64,
) -> Result<Vec<bool>, PoseGraphError> {
    let solver = CovarianceSolver::new(accepted)?;
    let mut judge = Judge { solver, bound, chance_max: CHANCE_MAX, space: pose_space(graph) };
    let mut verdicts = Vec::with_capacity(is_accepted.len());
    for (index, constraint) in graph.constraints().iter().enumerate() {
        let is_right = if graph.trusts()[index] == Trust::Trusted {
            true
        } else if is_accepted[index] {
            let chi2 = graph.constraint_chi2(index as u32);
            chi2.is_some_and(|chi2| chi2 <= TOLERANCE_OF_ACCEPTED * bound)
        } else {
            judge.admits(constraint)
        };
        verdicts.push(is_right);
    }
    Ok(verdicts)
}

/// Linear solves with all constraints before any is doubted.
const ITERATIONS_WITHOUT_DOUBT: u32 = 6;
/// χ² up to this multiple of the bound is forgiven to a constraint that was accepted.
const TOLERANCE_OF_ACCEPTED: f64 = 4.0;
/// A rejected constraint is not taken back where one at random would pass with this probability.
const CHANCE_MAX: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::super::testing::{constraint, random_drive, random_pose};
    use super::*;
    use crate::geometry::Pose2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const KERNELS: [Kernel; 2] = [Kernel::GraduatedNonConvexity, Kernel::DynamicCovarianceScaling];

    fn with(kernel: Kernel) -> RobustConfig {
        RobustConfig { kernel, ..RobustConfig::default() }
    }

    #[test]
    fn random_closures_are_rejected_and_true_ones_kept() {
        for seed in 0..10 {
            let (mut graph, _) = random_drive(seed, 120, 60);
            let num_true = graph.constraints().len();
            let mut clean = graph.clone();
            optimize(&mut clean, &PoseGraphConfig::default()).unwrap();
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            for _ in 0..30 {
                let i = rng.random_range(0..120);
                let j = (i + rng.random_range(10..110)) % 120;
                let z = random_pose(&mut rng, 20.0, 3.0);
                graph.add_doubtful(constraint(i, j, z, [900.0, 1200.0, 2500.0])).unwrap();
            }
            for kernel in KERNELS {
                let mut graph = graph.clone();
                let report = optimize_robust(&mut graph, &PoseGraphConfig::default(), &with(kernel)).unwrap();
                let num_kept =
                    report.inlier_weights[num_true..].iter().filter(|&&weight| weight > 0.0).count();
                assert_eq!(num_kept, 0, "seed {seed} {kernel:?}");
                assert!(report.inlier_weights[..num_true].iter().all(|&weight| weight == 1.0));
                for (pose, expected) in graph.poses().iter().zip(clean.poses()) {
                    assert!(pose.distance(expected) < 1e-2);
                }
            }
        }
    }

    #[test]
    fn without_false_closures_the_result_is_the_ordinary_one() {
        let (graph, _) = random_drive(4, 100, 60);
        let (mut ordinary, mut robust) = (graph.clone(), graph);
        let expected = optimize(&mut ordinary, &PoseGraphConfig::default()).unwrap();
        for kernel in [Kernel::None, Kernel::GraduatedNonConvexity] {
            let report = optimize_robust(&mut robust, &PoseGraphConfig::default(), &with(kernel)).unwrap();
            assert_eq!(report.num_rejected, 0);
            assert!((report.report.chi2 - expected.chi2).abs() < 1e-6 * expected.chi2);
        }
    }

    #[test]
    fn rejecting_the_only_tie_leaves_two_components() {
        let (mut graph, _) = random_drive(2, 20, 10);
        for _ in 0..3 {
            graph.add_pose(Pose2::identity()).unwrap();
        }
        let step = Pose2::new(1.0, 0.0, 0.0);
        for i in 20..22 {
            graph.add_constraint(constraint(i, i + 1, step, [100.0; 3])).unwrap();
        }
        graph.add_doubtful(constraint(3, 20, Pose2::new(5.0, 0.0, 0.0), [1e4; 3])).unwrap();
        graph.add_doubtful(constraint(3, 22, Pose2::new(-5.0, 0.0, 0.0), [1e4; 3])).unwrap();
        let report =
            optimize_robust(&mut graph, &PoseGraphConfig::default(), &with(Kernel::GraduatedNonConvexity))
                .unwrap();
        assert!(report.num_rejected >= 1, "{report:?}");
        assert!(graph.poses().iter().all(Pose2::is_finite));
    }

    #[test]
    fn weights_of_truncated_least_squares_fall_from_one_to_zero() {
        for sharpness in [1e-3, 1.0, 1e3] {
            let weights: Vec<f64> =
                (0..2000).map(|k| truncated_weight(f64::from(k) * 0.1, 16.0, sharpness)).collect();
            assert!(weights.windows(2).all(|pair| pair[1] <= pair[0] + 1e-12));
            assert!(weights.iter().all(|weight| (0.0..=1.0).contains(weight)));
            assert_eq!(weights[0], 1.0);
        }
    }

    #[test]
    fn impossible_settings_name_the_field() {
        let (mut graph, _) = random_drive(1, 5, 2);
        let robust = RobustConfig { sharpening: 1.0, ..RobustConfig::default() };
        let error = optimize_robust(&mut graph, &PoseGraphConfig::default(), &robust).unwrap_err();
        assert!(matches!(error, PoseGraphError::Config(ref config) if config.field == "robust.sharpening"));
    }
}
