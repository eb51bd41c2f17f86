//! The conductor: start, linearise, solve, update, until nothing is gained (thesis Eqs B.15 to B.17).

use super::chordal::chordal_start;
use super::components::{Components, held_poses};
use super::normal_equations::{BlockPattern, NormalEquations};
use super::residual::{PreparedConstraint, TurnedPose};
use super::{Method, PoseGraph, PoseGraphConfig, PoseGraphError, Start};
use crate::geometry::Pose2;

/// Why the optimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// χ² changed by less than `relative_gain_min`, or is zero but for rounding.
    Converged,
    /// `max_iterations` linear solves were made.
    MaxIterations,
    /// No damping, however strong, lowered χ² any more.
    NoDescent,
}

/// What the optimisation did.
#[derive(Clone, Debug, PartialEq)]
pub struct OptimizeReport {
    /// χ² of the poses as given.
    pub chi2_initial: f64,
    /// χ² where the iterations began; differs from `chi2_initial` after a chordal start.
    pub chi2_start: f64,
    /// χ² of the result.
    pub chi2: f64,
    /// Linear solves, without those of the chordal start.
    pub iterations: u32,
    /// Why it ended.
    pub stop_reason: StopReason,
    /// True when the iterations began at the chordal start.
    pub used_chordal_start: bool,
    /// Connected components; poses of different components have no relative pose.
    pub num_components: usize,
}

/// Moves the poses of `graph` to the least χ²; on an error the graph is unchanged.
///
/// Deterministic: the same graph and configuration give the same bytes. Cost: one ordering and one symbolic
/// analysis, then one sparse factorisation per iteration.
///
/// # Errors
/// `Empty`, `Config`, `CostNotFinite`, `NotPositiveDefinite`, `OutOfMemory`.
pub fn optimize(graph: &mut PoseGraph, config: &PoseGraphConfig) -> Result<OptimizeReport, PoseGraphError> {
    config.validate("pose_graph")?;
    if graph.poses().is_empty() {
        return Err(PoseGraphError::Empty);
    }
    let components = Components::of(graph, |_| true);
    let mut problem = Problem::new(graph, &components)?;
    let chi2_initial = problem.chi2();
    let used_chordal_start = problem.choose_start(config, components.num_components)?;
    let chi2_start = problem.chi2();
    if !chi2_start.is_finite() {
        return Err(PoseGraphError::CostNotFinite);
    }
    let (iterations, stop_reason) = problem.run(config)?;
    let chi2 = problem.chi2();
    graph.replace_poses(problem.into_poses());
    Ok(OptimizeReport {
        chi2_initial,
        chi2_start,
        chi2,
        iterations,
        stop_reason,
        used_chordal_start,
        num_components: components.num_components,
    })
}

/// First damping that is tried, relative to the diagonal of H.
const DAMPING_START: f64 = 1e-4;
/// Beyond this damping a step is too short to matter.
const DAMPING_MAX: f64 = 1e12;
/// Factor by which damping rises after a refused step and falls after an accepted one.
const DAMPING_FACTOR: f64 = 10.0;

/// A graph under optimisation: poses, weights of the constraints, and the reusable linear system.
pub(super) struct Problem<'a> {
    graph: &'a PoseGraph,
    pattern: BlockPattern,
    constraints: Vec<PreparedConstraint>,
    /// Multiplies each constraint's information; all 1 unless a robust kernel says otherwise.
    pub weights: Vec<f64>,
    poses: Vec<TurnedPose>,
    system: NormalEquations<3>,
}

impl<'a> Problem<'a> {
    pub fn new(graph: &'a PoseGraph, components: &Components) -> Result<Self, PoseGraphError> {
        Self::with_columns(graph, components, false)
    }

    fn with_columns(
        graph: &'a PoseGraph,
        components: &Components,
        by_columns: bool,
    ) -> Result<Self, PoseGraphError> {
        let pattern = BlockPattern::new(graph.constraints(), held_poses(graph, components))?;
        let system = NormalEquations::with_columns(&pattern, graph.constraints(), by_columns)?;
        Ok(Self {
            pattern,
            constraints: graph.constraints().iter().map(PreparedConstraint::new).collect(),
            weights: vec![1.0; graph.constraints().len()],
            poses: graph.poses().iter().map(TurnedPose::new).collect(),
            system,
            graph,
        })
    }

    /// Σ w eᵀ Ω e at the present poses.
    pub fn chi2(&self) -> f64 {
        self.constraints.iter().zip(&self.weights).map(|(c, weight)| weight * c.chi2(&self.poses)).sum()
    }

    /// eᵀ Ω e of every constraint, without weights.
    pub fn constraint_chi2s(&self) -> impl Iterator<Item = f64> + '_ {
        self.constraints.iter().map(|constraint| constraint.chi2(&self.poses))
    }

    /// χ² below which nothing but rounding is left at the present poses.
    fn chi2_of_rounding(&self) -> f64 {
        let extent_m = self
            .poses
            .iter()
            .fold(0.0_f64, |extent, turned| extent.max(turned.pose.x.abs()).max(turned.pose.y.abs()));
        self.constraints.iter().map(|constraint| constraint.chi2_of_rounding(extent_m)).sum()
    }

    pub fn into_poses(self) -> Vec<Pose2> {
        self.poses.into_iter().map(|turned| turned.pose).collect()
    }

    /// Moves the poses to where the iterations shall begin; true when that is the chordal start.
    pub fn choose_start(
        &mut self,
        config: &PoseGraphConfig,
        num_components: usize,
    ) -> Result<bool, PoseGraphError> {
        match config.start {
            Start::Given => Ok(false),
            Start::Chordal => {
                self.poses = self.chordal_poses()?;
                Ok(true)
            }
            Start::Best => {
                let given_chi2 = self.chi2();
                let num_free = self.poses.len() - num_components;
                let redundancy = 3 * self.constraints.len().saturating_sub(num_free);
                if given_chi2 <= config.poor_start_chi2 * redundancy as f64 {
                    return Ok(false);
                }
                // A graph whose headings or positions alone are not determined has no chordal start.
                let Ok(chordal) = self.chordal_poses() else { return Ok(false) };
                let given = std::mem::replace(&mut self.poses, chordal);
                let is_better = !given_chi2.is_finite() || self.chi2() < given_chi2;
                if !is_better {
                    self.poses = given;
                }
                Ok(is_better)
            }
        }
    }

    fn chordal_poses(&self) -> Result<Vec<TurnedPose>, PoseGraphError> {
        let mut system = NormalEquations::<2>::new(&self.pattern, self.graph.constraints())?;
        let given: Vec<Pose2> = self.poses.iter().map(|turned| turned.pose).collect();
        let poses = chordal_start(&given, &self.constraints, &self.pattern, &mut system)?;
        Ok(poses.iter().map(TurnedPose::new).collect())
    }

    /// Iterates until nothing is gained; returns the number of linear solves and why it ended.
    pub fn run(&mut self, config: &PoseGraphConfig) -> Result<(u32, StopReason), PoseGraphError> {
        match config.method {
            Method::LevenbergMarquardt => self.run_damped(config, 0),
            Method::GaussNewton => self.run_gauss_newton(config),
        }
    }

    fn run_gauss_newton(&mut self, config: &PoseGraphConfig) -> Result<(u32, StopReason), PoseGraphError> {
        let mut chi2 = self.chi2();
        let (mut best, mut best_chi2) = (self.poses.clone(), chi2);
        let chi2_of_rounding = self.chi2_of_rounding();
        for iteration in 1..=config.max_iterations {
            self.step(0.0)?;
            let previous = std::mem::replace(&mut chi2, self.chi2());
            if chi2 <= best_chi2 {
                best_chi2 = chi2;
                best.clone_from(&self.poses);
            }
            let is_best = chi2 <= best_chi2 * (1.0 + config.relative_gain_min);
            if chi2 <= chi2_of_rounding || is_converged(previous, chi2, config) && is_best {
                return Ok((iteration, StopReason::Converged));
            }
            if !chi2.is_finite() || chi2 > RUNAWAY_FACTOR * best_chi2.max(1.0) {
                self.poses = best;
                return self.run_damped(config, iteration);
            }
        }
        self.poses = best;
        Ok((config.max_iterations, StopReason::MaxIterations))
    }

    fn run_damped(
        &mut self,
        config: &PoseGraphConfig,
        num_solves: u32,
    ) -> Result<(u32, StopReason), PoseGraphError> {
        let mut chi2 = self.chi2();
        let chi2_of_rounding = self.chi2_of_rounding();
        let mut damping = DAMPING_START;
        for iteration in num_solves + 1..=config.max_iterations.max(num_solves + 1) {
            let before = self.poses.clone();
            // A system that is indefinite without damping may be solvable with more of it.
            let is_accepted = match self.step(damping) {
                Ok(()) => self.chi2() <= chi2,
                Err(PoseGraphError::NotPositiveDefinite { .. }) => false,
                Err(error) => return Err(error),
            };
            if is_accepted {
                let previous = std::mem::replace(&mut chi2, self.chi2());
                damping /= DAMPING_FACTOR;
                if chi2 <= chi2_of_rounding || is_converged(previous, chi2, config) {
                    return Ok((iteration, StopReason::Converged));
                }
            } else {
                self.poses = before;
                damping *= DAMPING_FACTOR;
                if damping > DAMPING_MAX {
                    return Ok((iteration, StopReason::NoDescent));
                }
            }
        }
        Ok((config.max_iterations, StopReason::MaxIterations))
    }

    /// One linear solve and the update of all poses.
    pub fn step(&mut self, damping: f64) -> Result<(), PoseGraphError> {
        self.linearize();
        if damping > 0.0 {
            self.system.damp(damping);
        }
        self.system.factorize()?;
        self.system.solve();
        for (index, pose) in self.poses.iter_mut().enumerate() {
            let step = self.system.solution(index);
            *pose = TurnedPose::new(&Pose2::from_vector(&(pose.pose.to_vector() - step)));
        }
        Ok(())
    }

    /// Fills H and b at the present poses.
    pub fn linearize(&mut self) {
        self.system.clear();
        for (index, (constraint, &weight)) in self.constraints.iter().zip(&self.weights).enumerate() {
            let block = constraint.linearize(&self.poses, weight);
            self.system.add_constraint(
                index,
                (constraint.i, constraint.j),
                (&block.h_ii, &block.h_ij, &block.h_jj),
                (&block.b_i, &block.b_j),
            );
        }
    }

    /// The linear system of a graph at its present poses, factorised by columns.
    pub fn factorized(
        graph: &'a PoseGraph,
        components: &Components,
    ) -> Result<NormalEquations<3>, PoseGraphError> {
        let mut problem = Self::with_columns(graph, components, true)?;
        problem.linearize();
        problem.system.factorize()?;
        Ok(problem.system)
    }
}

/// A rise of χ² over the best seen by this factor is not a detour any more.
const RUNAWAY_FACTOR: f64 = 1e6;

fn is_converged(previous: f64, chi2: f64, config: &PoseGraphConfig) -> bool {
    (previous - chi2).abs() <= config.relative_gain_min * previous
}

#[cfg(test)]
mod tests {
    use super::super::testing::{constraint, random_drive, random_pose};
    use super::*;
    use crate::geometry::wrap_angle;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const UNIT: [f64; 3] = [1.0; 3];

    fn with(start: Start, method: Method) -> PoseGraphConfig {
        PoseGraphConfig { start, method, ..PoseGraphConfig::default() }
    }

    /// A square of four sides whose start is badly wrong.
    fn square() -> PoseGraph {
        let mut graph = PoseGraph::new();
        for k in 0..4 {
            graph.add_pose(Pose2::new(f64::from(k), 0.5 * f64::from(k), 0.3 * f64::from(k))).unwrap();
        }
        let side = Pose2::new(2.0, 0.0, std::f64::consts::FRAC_PI_2);
        for k in 0..4 {
            graph.add_constraint(constraint(k, (k + 1) % 4, side, UNIT)).unwrap();
        }
        graph
    }

    #[test]
    fn every_method_and_start_closes_a_square() {
        for start in [Start::Given, Start::Chordal, Start::Best] {
            for method in [Method::GaussNewton, Method::LevenbergMarquardt] {
                let mut graph = square();
                let report = optimize(&mut graph, &with(start, method)).unwrap();
                assert!(report.chi2 < 1e-6, "{start:?} {method:?}: {report:?}");
                assert_eq!(report.num_components, 1);
                let corner = graph.poses()[2];
                assert!((corner.x - 2.0).abs() < 1e-3 && (corner.y - 2.0).abs() < 1e-3);
                assert_eq!(graph.poses()[0], Pose2::identity());
            }
        }
    }

    #[test]
    fn gauss_newton_and_levenberg_marquardt_agree_on_random_drives() {
        for seed in 0..20 {
            let (mut graph, truth) = random_drive(seed, 60, 40);
            let mut damped = graph.clone();
            let report = optimize(&mut graph, &with(Start::Chordal, Method::GaussNewton)).unwrap();
            let other = optimize(&mut damped, &with(Start::Given, Method::LevenbergMarquardt)).unwrap();
            assert!((report.chi2 - other.chi2).abs() < 1e-5 * report.chi2, "{report:?} {other:?}");
            for (pose, truth) in graph.poses().iter().zip(&truth) {
                assert!(pose.distance(truth) < 0.5 && wrap_angle(pose.theta - truth.theta).abs() < 0.1);
            }
        }
    }

    #[test]
    fn the_chordal_start_ignores_the_given_poses() {
        let (mut graph, _) = random_drive(3, 80, 60);
        let mut scattered = graph.clone();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for pose in 1..80 {
            scattered.set_pose(pose, random_pose(&mut rng, 100.0, 3.0)).unwrap();
        }
        let config = PoseGraphConfig::default();
        let report = optimize(&mut scattered, &config).unwrap();
        assert!(report.used_chordal_start);
        let reference = optimize(&mut graph, &config).unwrap();
        assert!((report.chi2 - reference.chi2).abs() < 1e-6 * reference.chi2);
    }

    #[test]
    fn components_keep_their_own_frames() {
        let mut graph = PoseGraph::new();
        for k in 0..6 {
            graph.add_pose(Pose2::new(10.0 * f64::from(k), 1.0, 0.1)).unwrap();
        }
        let step = Pose2::new(1.0, 0.0, 0.0);
        for (i, j) in [(0, 2), (2, 4), (1, 3)] {
            graph.add_constraint(constraint(i, j, step, UNIT)).unwrap();
        }
        let report = optimize(&mut graph, &PoseGraphConfig::default()).unwrap();
        assert_eq!(report.num_components, 3);
        assert!(report.chi2 < 1e-9);
        assert_eq!(graph.poses()[5], Pose2::new(50.0, 1.0, 0.1));
        assert_eq!(graph.poses()[1], Pose2::new(10.0, 1.0, 0.1));
    }

    #[test]
    fn held_poses_stay_even_when_they_disagree() {
        let mut graph = square();
        graph.hold(0).unwrap();
        graph.hold(2).unwrap();
        let before = graph.poses()[2];
        optimize(&mut graph, &PoseGraphConfig::default()).unwrap();
        assert_eq!(graph.poses()[0], Pose2::identity());
        assert_eq!(graph.poses()[2], before);
    }

    #[test]
    fn graphs_that_cannot_be_solved_are_errors() {
        let config = PoseGraphConfig::default();
        assert_eq!(optimize(&mut PoseGraph::new(), &config), Err(PoseGraphError::Empty));

        let mut undetermined = square();
        undetermined.add_pose(Pose2::identity()).unwrap();
        undetermined.add_constraint(constraint(3, 4, Pose2::identity(), [1.0, 0.0, 1.0])).unwrap();
        let before = undetermined.clone();
        let error = optimize(&mut undetermined, &config).unwrap_err();
        assert!(matches!(error, PoseGraphError::NotPositiveDefinite { .. }), "{error}");
        assert_eq!(undetermined, before);

        let mut huge = square();
        huge.set_pose(2, Pose2 { x: 1e200, y: 0.0, theta: 0.0 }).unwrap();
        let given = with(Start::Given, Method::GaussNewton);
        assert_eq!(optimize(&mut huge, &given), Err(PoseGraphError::CostNotFinite));

        let wrong = PoseGraphConfig { max_iterations: 0, ..config };
        let error = optimize(&mut square(), &wrong).unwrap_err();
        assert!(
            matches!(error, PoseGraphError::Config(ref config) if config.field == "pose_graph.max_iterations")
        );
    }

    #[test]
    fn a_graph_without_closures_has_converged_when_only_rounding_is_left() {
        let mut graph = PoseGraph::new();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut pose = Pose2::identity();
        graph.add_pose(pose).unwrap();
        for k in 0..450 {
            let step = Pose2::new(0.5, 0.0, 0.0).compose(&random_pose(&mut rng, 0.1, 0.3));
            pose = pose.compose(&step);
            let rounded = |value: f64| (value * 1e6).round() / 1e6;
            graph.add_pose(Pose2::new(rounded(pose.x), rounded(pose.y), rounded(pose.theta))).unwrap();
            graph.add_constraint(constraint(k, k + 1, step, [500.0, 500.0, 5000.0])).unwrap();
        }
        for method in [Method::GaussNewton, Method::LevenbergMarquardt] {
            let report = optimize(&mut graph.clone(), &with(Start::Given, method)).unwrap();
            assert_eq!(report.stop_reason, StopReason::Converged);
            assert!(report.iterations <= 8, "{report:?}");
        }
    }

    #[test]
    fn a_lone_pose_is_a_solved_graph() {
        let mut graph = PoseGraph::new();
        graph.add_pose(Pose2::new(1.0, 2.0, 3.0)).unwrap();
        let report = optimize(&mut graph, &PoseGraphConfig::default()).unwrap();
        assert_eq!((report.chi2, report.num_components), (0.0, 1));
        assert_eq!(graph.poses()[0], Pose2::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn the_same_graph_gives_the_same_bytes() {
        let (graph, _) = random_drive(9, 200, 150);
        let run = || {
            let mut graph = graph.clone();
            optimize(&mut graph, &with(Start::Chordal, Method::GaussNewton)).unwrap();
            graph
                .poses()
                .iter()
                .flat_map(|p| [p.x.to_bits(), p.y.to_bits(), p.theta.to_bits()])
                .collect::<Vec<_>>()
        };
        assert_eq!(run(), run());
    }
}
