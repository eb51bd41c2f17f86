//! The graph of anchors: odometry between neighbours, closures between places driven twice.

use nalgebra::Matrix3;

use super::anchors::AnchorSet;
use super::config::MappingConfig;
use super::run::RunRecord;
use crate::geometry::Pose2;
use crate::pose_graph::{
    CovarianceSolver, InformationMatrix, PoseConstraint, PoseGraph, PoseGraphError, consistent_sets,
    optimize_robust,
};
use crate::registration::SubmapFit;

/// A registration that may constrain the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closure {
    /// Anchor of the earlier submap.
    pub earlier: usize,
    /// Anchor of the later submap.
    pub later: usize,
    /// How they fit.
    pub fit: SubmapFit,
}

/// Anchors at their best poses.
#[derive(Clone)]
pub(crate) struct CoarseGraph {
    /// Odometry between consecutive anchors of a run: index of the first, covariance.
    odometry: Vec<(usize, Matrix3<f64>)>,
    /// Poses of all anchors in the frame of their component.
    pub poses: Vec<Pose2>,
    graph: PoseGraph,
}

impl CoarseGraph {
    /// Every run on its own, as its odometry says.
    pub fn new(set: &AnchorSet, runs: &[RunRecord<'_>], config: &MappingConfig) -> Self {
        let mut odometry = Vec::new();
        for run_idx in 0..runs.len() {
            let range = set.of_run(run_idx);
            for from in range.start..range.end.saturating_sub(1) {
                odometry.push((from, set.step_covariance(from, runs, config)));
            }
        }
        let poses = set.anchors.iter().map(|anchor| anchor.run_from_anchor).collect();
        Self { odometry, poses, graph: PoseGraph::new() }
    }

    /// Optimises all poses under these closures; those that contradict the rest lose their weight.
    ///
    /// Returns for each closure whether it was kept.
    ///
    /// # Errors
    /// Whatever the optimiser cannot solve.
    pub fn optimize(
        &mut self,
        set: &AnchorSet,
        closures: &[Closure],
        config: &MappingConfig,
    ) -> Result<Vec<bool>, PoseGraphError> {
        self.optimize_within(set, closures, &|_| true, config)
    }

    /// Optimises only the anchors for which `is_in_scope`; nothing but constraints between them counts.
    ///
    /// # Errors
    /// Whatever the optimiser cannot solve.
    pub fn optimize_within(
        &mut self,
        set: &AnchorSet,
        closures: &[Closure],
        is_in_scope: &dyn Fn(usize) -> bool,
        config: &MappingConfig,
    ) -> Result<Vec<bool>, PoseGraphError> {
        let mut graph = self.odometry_graph(set, is_in_scope)?;
        let num_odometry = graph.constraints().len();
        for closure in closures {
            graph.add_doubtful(closure_constraint(closure, &Matrix3::zeros(), config))?;
        }
        let report = optimize_robust(&mut graph, &config.pose_graph, &config.robust)?;
        let is_kept: Vec<bool> = report.inlier_weights.iter().map(|&weight| weight > 0.0).collect();
        self.poses = graph.poses().to_vec();
        self.graph = graph.with_constraints(|index| is_kept[index]);
        Ok(is_kept[num_odometry..].to_vec())
    }

    /// Takes up the constraints of the whole site again, after optimisations of parts of it.
    ///
    /// # Errors
    /// A closure between anchors that do not exist.
    pub fn assemble(
        &mut self,
        set: &AnchorSet,
        closures: &[Closure],
        config: &MappingConfig,
    ) -> Result<(), PoseGraphError> {
        let mut graph = self.odometry_graph(set, &|_| true)?;
        for closure in closures {
            graph.add_doubtful(closure_constraint(closure, &Matrix3::zeros(), config))?;
        }
        self.graph = graph;
        Ok(())
    }

    fn odometry_graph(
        &self,
        set: &AnchorSet,
        is_in_scope: &dyn Fn(usize) -> bool,
    ) -> Result<PoseGraph, PoseGraphError> {
        let mut graph = PoseGraph::new();
        for pose in &self.poses {
            graph.add_pose(*pose)?;
        }
        for (from, covariance) in self.odometry.iter().filter(|(from, _)| is_in_scope(*from)) {
            let motion = set.anchors[*from].run_from_anchor.between(&set.anchors[from + 1].run_from_anchor);
            graph.add_constraint(constraint(*from, from + 1, motion, covariance))?;
        }
        Ok(graph)
    }

    /// The largest set of closures between two components that agree pair by pair, by index, ascending; `is_in_scope`
    /// holds for the anchors of the two. Only after [`CoarseGraph::optimize`].
    ///
    /// # Errors
    /// Whatever the graph cannot solve.
    pub fn consistent(
        &self,
        closures: &[Closure],
        is_in_scope: &dyn Fn(usize) -> bool,
        config: &MappingConfig,
    ) -> Result<Vec<usize>, PoseGraphError> {
        let candidates: Vec<PoseConstraint> =
            closures.iter().map(|closure| closure_constraint(closure, &slack(), config)).collect();
        let constraints = self.graph.constraints();
        let graph = self.graph.with_constraints(|index| is_in_scope(constraints[index].i as usize));
        let sets = consistent_sets(&graph, &candidates, &config.consistency)?;
        let largest = sets.into_iter().max_by_key(|set| set.members.len());
        Ok(largest.map_or(Vec::new(), |set| set.members.iter().map(|&member| member as usize).collect()))
    }

    /// Squared deviations of a closure from the present poses.
    pub fn chi2(&self, closure: &Closure, config: &MappingConfig) -> f64 {
        let relative = self.poses[closure.earlier].between(&self.poses[closure.later]);
        deviation2(&closure.fit.earlier_from_later, &relative, &with_floor(&closure.fit.covariance, config))
    }

    /// Answers how sure the graph is of relative poses; only after [`CoarseGraph::optimize`].
    ///
    /// # Errors
    /// Whatever the factorisation cannot solve.
    pub fn covariances(&self) -> Result<CovarianceSolver, PoseGraphError> {
        CovarianceSolver::new(&self.graph)
    }
}

/// The covariance of a fit, with what registration itself cannot know.
pub(crate) fn with_floor(covariance: &Matrix3<f64>, config: &MappingConfig) -> Matrix3<f64> {
    let place = config.fit_floor_m * config.fit_floor_m;
    let turn = config.fit_floor_rad * config.fit_floor_rad;
    covariance + Matrix3::from_diagonal(&nalgebra::Vector3::new(place, place, turn))
}

/// Squared Mahalanobis length of the difference of two poses, in the axes of their common frame.
pub(crate) fn deviation2(a: &Pose2, b: &Pose2, covariance: &Matrix3<f64>) -> f64 {
    let difference =
        nalgebra::Vector3::new(b.x - a.x, b.y - a.y, crate::geometry::wrap_angle(b.theta - a.theta));
    covariance
        .try_inverse()
        .map_or(f64::INFINITY, |inverse| (difference.transpose() * inverse * difference)[0])
}

/// What the graph's covariance does not know: submaps are not rigid.
pub(crate) fn slack() -> Matrix3<f64> {
    Matrix3::from_diagonal(&nalgebra::Vector3::new(0.1 * 0.1, 0.1 * 0.1, 0.03 * 0.03))
}

fn closure_constraint(closure: &Closure, doubt: &Matrix3<f64>, config: &MappingConfig) -> PoseConstraint {
    let covariance = with_floor(&closure.fit.covariance, config) + doubt;
    constraint(closure.earlier, closure.later, closure.fit.earlier_from_later, &covariance)
}

/// Covariances are given in the axes of the first pose; the graph wants them in those of the measurement.
fn constraint(i: usize, j: usize, i_from_j: Pose2, covariance: &Matrix3<f64>) -> PoseConstraint {
    let turned = crate::registration::rotated(covariance, -i_from_j.theta);
    let symmetric = (turned + turned.transpose()) * 0.5;
    let information = symmetric.try_inverse().unwrap_or_else(|| Matrix3::identity() * 1e-6);
    let information = InformationMatrix::try_new((information + information.transpose()) * 0.5)
        .or_else(|_| InformationMatrix::from_standard_deviations(1.0, 1.0, 1.0))
        .expect("unit deviations make a positive definite matrix");
    PoseConstraint { i: i as u32, j: j as u32, i_from_j, information }
}
