//! The graph of anchors of some runs: odometry between neighbors, closures between places driven twice.

use nalgebra::{Matrix3, Vector3};

use super::indices::{AnchorIdx, RunIdx};
use super::site_anchors::SiteAnchors;
use crate::geometry::Pose2;
use crate::pose_graph::{
    CovarianceSolver, InformationMatrix, PoseConstraint, PoseGraph, PoseGraphError, optimize_robust,
};
use crate::registration::SubmapFit;

/// A registration that may constrain the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closure {
    /// Anchor of the earlier submap.
    pub earlier: AnchorIdx,
    /// Anchor of the later submap.
    pub later: AnchorIdx,
    /// How they fit.
    pub fit: SubmapFit,
}

/// The anchors of some runs at their best poses in one frame.
#[derive(Clone)]
pub(crate) struct CoarseGraph<'a> {
    pub site: &'a SiteAnchors<'a>,
    /// Ascending.
    runs: Vec<RunIdx>,
    /// Ascending.
    members: Vec<AnchorIdx>,
    /// For each run of the site the node of its first anchor, if it belongs.
    first_nodes: Vec<Option<usize>>,
    graph: PoseGraph,
}

impl<'a> CoarseGraph<'a> {
    /// Runs with the poses that their anchors have; nothing is optimized yet.
    pub fn new(
        site: &'a SiteAnchors<'a>,
        mut runs: Vec<RunIdx>,
        pose_of: impl Fn(AnchorIdx) -> Pose2,
    ) -> Result<Self, PoseGraphError> {
        runs.sort_unstable();
        let mut members = Vec::new();
        let mut first_nodes = vec![None; site.runs().len()];
        for &run in &runs {
            first_nodes[run.at()] = Some(members.len());
            members.extend(site.of_run(run).map(AnchorIdx::new));
        }
        let mut graph = PoseGraph::new();
        for &anchor in &members {
            graph.add_pose(pose_of(anchor))?;
        }
        Ok(Self { site, runs, members, first_nodes, graph })
    }

    /// Its runs, ascending.
    pub fn runs(&self) -> &[RunIdx] {
        &self.runs
    }

    /// Its anchors, ascending.
    pub fn anchors(&self) -> &[AnchorIdx] {
        &self.members
    }

    /// True when it holds the anchor.
    pub fn holds(&self, anchor: AnchorIdx) -> bool {
        self.first_nodes[self.site.run_of(anchor).at()].is_some()
    }

    /// Where an anchor of it lies.
    pub fn pose(&self, anchor: AnchorIdx) -> Pose2 {
        self.graph.poses()[self.node(anchor)]
    }

    /// Anchors of it with their poses.
    pub fn placed(&self, anchors: &[AnchorIdx]) -> Vec<(AnchorIdx, Pose2)> {
        anchors.iter().map(|&anchor| (anchor, self.pose(anchor))).collect()
    }

    /// Node of an anchor of it.
    pub fn node(&self, anchor: AnchorIdx) -> usize {
        let run = self.site.run_of(anchor);
        let first = self.first_nodes[run.at()].expect("only anchors of the graph's runs are asked for");
        first + anchor.at() - self.site.of_run(run).start
    }

    /// Optimizes all poses under these closures; those that contradict the rest lose their weight.
    ///
    /// Returns for each closure whether it was kept.
    ///
    /// # Errors
    /// Whatever the optimizer cannot solve.
    pub fn optimize(&mut self, closures: &[Closure]) -> Result<Vec<bool>, PoseGraphError> {
        let mut graph = PoseGraph::new();
        for pose in self.graph.poses() {
            graph.add_pose(*pose)?;
        }
        for pair in
            self.members.windows(2).filter(|pair| self.site.run_of(pair[0]) == self.site.run_of(pair[1]))
        {
            let motion = self.site.step(pair[0], pair[1]);
            let covariance = self.site.step_covariance(pair[0]);
            graph.add_constraint(constraint(self.node(pair[0]), self.node(pair[1]), motion, covariance))?;
        }
        let num_odometry = graph.constraints().len();
        for closure in closures {
            let covariance = self.with_floor(&closure.fit.covariance);
            let (i, j) = (self.node(closure.earlier), self.node(closure.later));
            graph.add_doubtful(constraint(i, j, closure.fit.earlier_from_later, &covariance))?;
        }
        let config = self.site.config;
        let report = optimize_robust(&mut graph, &config.pose_graph, &config.robust)?;
        let is_kept: Vec<bool> = report.inlier_weights.iter().map(|&weight| weight > 0.0).collect();
        self.graph = graph.with_constraints(|index| is_kept[index]);
        Ok(is_kept[num_odometry..].to_vec())
    }

    /// Squared deviations of a closure from the present poses.
    pub fn chi2(&self, closure: &Closure) -> f64 {
        let relative = self.pose(closure.earlier).between(&self.pose(closure.later));
        let covariance = self.with_floor(&closure.fit.covariance);
        deviation2(&closure.fit.earlier_from_later, &relative, &covariance)
    }

    /// Answers how sure the graph is of relative poses, by node; only after [`CoarseGraph::optimize`].
    ///
    /// # Errors
    /// Whatever the factorization cannot solve.
    pub fn covariances(&self) -> Result<CovarianceSolver, PoseGraphError> {
        CovarianceSolver::new(&self.graph)
    }

    /// The covariance of a fit, with what registration itself cannot know.
    pub fn with_floor(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        let place = self.site.config.fit_floor_m.powi(2);
        let turn = self.site.config.fit_floor_rad.powi(2);
        covariance + Matrix3::from_diagonal(&Vector3::new(place, place, turn))
    }
}

/// Squared Mahalanobis length of the difference of two poses, in the axes of their common frame.
pub(crate) fn deviation2(a: &Pose2, b: &Pose2, covariance: &Matrix3<f64>) -> f64 {
    let difference = Vector3::new(b.x - a.x, b.y - a.y, crate::geometry::wrap_angle(b.theta - a.theta));
    covariance
        .try_inverse()
        .map_or(f64::INFINITY, |inverse| (difference.transpose() * inverse * difference)[0])
}

/// What the graph's covariance does not know: submaps are not rigid.
pub(crate) fn slack() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(0.1 * 0.1, 0.1 * 0.1, 0.03 * 0.03))
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
