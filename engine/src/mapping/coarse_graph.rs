//! The graph of anchors of some runs: odometry between neighbors, closures between places driven twice.
//!
//! A body of the foundation is one node, however many anchors it has: they keep their places in it.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::indices::{AnchorIdx, BodyIdx, RunIdx};
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
    /// For each run of the site the node of its first anchor, or that of its body, if it belongs.
    first_nodes: Vec<Option<usize>>,
    graph: PoseGraph,
}

impl<'a> CoarseGraph<'a> {
    /// Runs with the poses that their anchors have, exemplars with that of their body; nothing is optimized yet.
    ///
    /// All exemplars of a body must be among the runs or none.
    pub fn new(
        site: &'a SiteAnchors<'a>,
        mut runs: Vec<RunIdx>,
        pose_of: impl Fn(AnchorIdx) -> Pose2,
        pose_of_body: impl Fn(RunIdx) -> Pose2,
    ) -> Result<Self, PoseGraphError> {
        runs.sort_unstable();
        let mut members = Vec::new();
        let mut first_nodes = vec![None; site.runs().len()];
        let mut nodes_of_bodies: BTreeMap<BodyIdx, usize> = BTreeMap::new();
        let mut graph = PoseGraph::new();
        for &run in &runs {
            let anchors = site.of_run(run).map(AnchorIdx::new);
            members.extend(anchors.clone());
            let next = graph.poses().len();
            match site.body_of(run).map(|body| *nodes_of_bodies.entry(body).or_insert(next)) {
                Some(node) => {
                    first_nodes[run.at()] = Some(node);
                    if node == next {
                        graph.add_pose(pose_of_body(run))?;
                    }
                }
                None => {
                    first_nodes[run.at()] = Some(next);
                    for anchor in anchors {
                        graph.add_pose(pose_of(anchor))?;
                    }
                }
            }
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
        let pose = self.graph.poses()[self.node(anchor)];
        self.in_body(anchor).map_or(pose, |body_from_anchor| pose.compose(&body_from_anchor))
    }

    /// Where the body of an exemplar lies.
    pub fn pose_of_body(&self, exemplar: RunIdx) -> Pose2 {
        self.graph.poses()[self.first_node(exemplar)]
    }

    /// Where an anchor lies in its body, if it has one.
    fn in_body(&self, anchor: AnchorIdx) -> Option<Pose2> {
        self.site.body_of(self.site.run_of(anchor)).map(|_| self.site.anchor(anchor).run_from_anchor)
    }

    /// Anchors of it with their poses.
    pub fn placed(&self, anchors: &[AnchorIdx]) -> Vec<(AnchorIdx, Pose2)> {
        anchors.iter().map(|&anchor| (anchor, self.pose(anchor))).collect()
    }

    /// Node of an anchor of it.
    fn node(&self, anchor: AnchorIdx) -> usize {
        let run = self.site.run_of(anchor);
        match self.site.body_of(run) {
            Some(_) => self.first_node(run),
            None => self.first_node(run) + anchor.at() - self.site.of_run(run).start,
        }
    }

    fn first_node(&self, run: RunIdx) -> usize {
        self.first_nodes[run.at()].expect("only the graph's own runs are asked for")
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
        let is_driven = |pair: &&[AnchorIdx]| {
            let run = self.site.run_of(pair[0]);
            run == self.site.run_of(pair[1]) && self.site.body_of(run).is_none()
        };
        for pair in self.members.windows(2).filter(is_driven) {
            let motion = self.site.step(pair[0], pair[1]);
            let covariance = self.site.step_covariance(pair[0]);
            graph.add_constraint(constraint(self.node(pair[0]), self.node(pair[1]), motion, covariance))?;
        }
        let num_odometry = graph.constraints().len();
        for closure in closures {
            graph.add_doubtful(self.constraint_of(closure))?;
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

    /// Poses of others seen from an anchor, each with the covariance of (x, y, θ) in the axes of that anchor; only after
    /// [`CoarseGraph::optimize`]. In the order of the questions.
    ///
    /// # Errors
    /// Whatever the factorization cannot solve.
    pub fn relatives(
        &self,
        questions: &[(AnchorIdx, Vec<AnchorIdx>)],
    ) -> Result<Vec<Vec<(Pose2, Matrix3<f64>)>>, PoseGraphError> {
        let node = |anchor: AnchorIdx| self.node(anchor) as u32;
        let of_nodes: Vec<(u32, Vec<u32>)> = (questions.iter())
            .map(|(anchor, others)| (node(*anchor), others.iter().map(|&other| node(other)).collect()))
            .collect();
        let mut relatives = CovarianceSolver::new(&self.graph)?.relatives(&of_nodes)?;
        for ((anchor, others), relatives) in questions.iter().zip(&mut relatives) {
            for (&other, relative) in others.iter().zip(relatives) {
                if let Some(body_from_other) = self.in_body(other) {
                    *relative = carried_on(relative, &body_from_other);
                }
                if let Some(body_from_anchor) = self.in_body(*anchor) {
                    let (seen, covariance) = &relative;
                    let turned = crate::registration::rotated(covariance, -body_from_anchor.theta);
                    *relative = (body_from_anchor.between(seen), turned);
                }
            }
        }
        Ok(relatives)
    }

    /// What a closure says of two nodes. Where an anchor lies in a body, the same is said of the body: the fit carried on
    /// to where the body's frame has its origin.
    fn constraint_of(&self, closure: &Closure) -> PoseConstraint {
        let covariance = self.with_floor(&closure.fit.covariance);
        let (i, j) = (self.node(closure.earlier), self.node(closure.later));
        let fit = closure.fit.earlier_from_later;
        let mut of_anchors = constraint(i, j, fit, &covariance);
        if let Some(body_from_earlier) = self.in_body(closure.earlier) {
            // The error counts in the axes of the later anchor, which stay.
            of_anchors.i_from_j = body_from_earlier.compose(&of_anchors.i_from_j);
        }
        if let Some(body_from_later) = self.in_body(closure.later) {
            of_anchors.i_from_j = of_anchors.i_from_j.compose(&body_from_later.inverse());
            let (sin, cos) = body_from_later.theta.sin_cos();
            let lever = Vector2::new(-body_from_later.y, body_from_later.x);
            let lever = Vector2::new(cos * lever.x + sin * lever.y, cos * lever.y - sin * lever.x);
            // The error at the anchor, by that of the body.
            let by_body = Matrix3::new(cos, sin, lever.x, -sin, cos, lever.y, 0.0, 0.0, 1.0);
            let information = by_body.transpose() * of_anchors.information.as_matrix() * by_body;
            of_anchors.information = positive(&information);
        }
        of_anchors
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
    PoseConstraint { i: i as u32, j: j as u32, i_from_j, information: positive(&information) }
}

/// The information that a matrix is meant to be, or hardly any.
fn positive(information: &Matrix3<f64>) -> InformationMatrix {
    InformationMatrix::try_new((information + information.transpose()) * 0.5)
        .or_else(|_| InformationMatrix::from_standard_deviations(1.0, 1.0, 1.0))
        .expect("unit deviations make a positive definite matrix")
}

/// An uncertain pose carried on by a sure one.
fn carried_on((pose, covariance): &(Pose2, Matrix3<f64>), step: &Pose2) -> (Pose2, Matrix3<f64>) {
    let there = pose.compose(step);
    let (dx, dy) = (there.x - pose.x, there.y - pose.y);
    let by_pose = Matrix3::new(1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0);
    (there, by_pose * covariance * by_pose.transpose())
}
