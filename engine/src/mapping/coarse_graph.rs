//! The graph of anchors: odometry between neighbours, closures between places driven twice.

use nalgebra::Matrix3;

use super::anchors::AnchorSet;
use super::config::MappingConfig;
use super::run::RunRecord;
use crate::geometry::Pose2;
use crate::pose_graph::{
    CovarianceSolver, InformationMatrix, PoseConstraint, PoseGraph, PoseGraphError, optimize,
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

    /// Optimises all poses under these closures, dropping one by one in rounds those that contradict the rest.
    ///
    /// Returns for each closure whether it was kept.
    ///
    /// # Errors
    /// Whatever the optimiser cannot solve.
    pub fn optimise(
        &mut self,
        set: &AnchorSet,
        closures: &[Closure],
        config: &MappingConfig,
    ) -> Result<Vec<bool>, PoseGraphError> {
        let mut kept = vec![true; closures.len()];
        for factor in [16.0, 4.0, 1.0, 1.0] {
            self.solve(set, closures, &kept, config)?;
            let mut num_dropped = 0;
            for (index, closure) in closures.iter().enumerate() {
                let chi2 = self.chi2(closure, config);
                let keeps = chi2 <= config.max_chi2 * factor;
                if kept[index] && !keeps {
                    num_dropped += 1;
                }
                kept[index] = keeps;
            }
            if num_dropped == 0 && factor <= 1.0 {
                break;
            }
        }
        self.solve(set, closures, &kept, config)?;
        Ok(kept)
    }

    fn solve(
        &mut self,
        set: &AnchorSet,
        closures: &[Closure],
        kept: &[bool],
        config: &MappingConfig,
    ) -> Result<(), PoseGraphError> {
        let mut graph = PoseGraph::new();
        for pose in &self.poses {
            graph.add_pose(*pose)?;
        }
        for (from, covariance) in &self.odometry {
            let motion = set.anchors[*from].run_from_anchor.between(&set.anchors[from + 1].run_from_anchor);
            add(&mut graph, *from, from + 1, motion, covariance)?;
        }
        for (closure, _) in closures.iter().zip(kept).filter(|(_, kept)| **kept) {
            let covariance = with_floor(&closure.fit.covariance, config);
            add(&mut graph, closure.earlier, closure.later, closure.fit.earlier_from_later, &covariance)?;
        }
        optimize(&mut graph, &config.pose_graph)?;
        self.poses = graph.poses().to_vec();
        self.graph = graph;
        Ok(())
    }

    /// Squared deviations of a closure from the present poses.
    pub fn chi2(&self, closure: &Closure, config: &MappingConfig) -> f64 {
        let relative = self.poses[closure.earlier].between(&self.poses[closure.later]);
        deviation2(&closure.fit.earlier_from_later, &relative, &with_floor(&closure.fit.covariance, config))
    }

    /// Answers how sure the graph is of relative poses; only after [`CoarseGraph::optimise`].
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

/// Covariances are given in the axes of the first pose; the graph wants them in those of the measurement.
fn add(
    graph: &mut PoseGraph,
    i: usize,
    j: usize,
    i_from_j: Pose2,
    covariance: &Matrix3<f64>,
) -> Result<(), PoseGraphError> {
    let turned = crate::registration::rotated(covariance, -i_from_j.theta);
    let symmetric = (turned + turned.transpose()) * 0.5;
    let information = symmetric.try_inverse().unwrap_or_else(|| Matrix3::identity() * 1e-6);
    let information = InformationMatrix::try_new((information + information.transpose()) * 0.5)
        .or_else(|_| InformationMatrix::from_standard_deviations(1.0, 1.0, 1.0));
    let Ok(information) = information else { return Ok(()) };
    graph.add_constraint(PoseConstraint { i: i as u32, j: j as u32, i_from_j, information })?;
    Ok(())
}
