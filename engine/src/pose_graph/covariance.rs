//! How sure the graph is of its poses: blocks of H⁻¹ at the optimum.
//!
//! The covariance of a pose depends on what is held, that between two poses does not: use the latter to decide how
//! far to search for a match.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::components::Components;
use super::normal_equations::NormalEquations;
use super::optimizer::Problem;
use super::selected_inverse::Workspace;
use super::{PoseGraph, PoseGraphError};
use crate::geometry::Pose2;

/// A factorised graph that answers questions about covariances.
///
/// Building it costs one factorisation. The covariances of all poses together cost about another one; each pose
/// between which and others the covariance is asked for costs two substitutions along the ways of these poses to the
/// root of the elimination tree.
pub struct CovarianceSolver {
    system: NormalEquations<3>,
    components: Components,
    poses: Vec<Pose2>,
    /// Diagonal blocks of H⁻¹, once they were needed.
    marginals: Option<Vec<Matrix3<f64>>>,
}

impl CovarianceSolver {
    /// Factorises the graph at its present poses, which should be optimised.
    ///
    /// # Errors
    /// `Empty`, `NotPositiveDefinite`, `OutOfMemory`.
    pub fn new(graph: &PoseGraph) -> Result<Self, PoseGraphError> {
        if graph.poses().is_empty() {
            return Err(PoseGraphError::Empty);
        }
        let components = Components::of(graph, |_| true);
        let system = Problem::factorized(graph, &components)?;
        Ok(Self { system, components, poses: graph.poses().to_vec(), marginals: None })
    }

    /// Covariances of (x, y, θ) of all poses in the map's axes, given the held pose of their component; zero for held
    /// poses themselves.
    pub fn marginals(&mut self) -> &[Matrix3<f64>] {
        if self.marginals.is_none() {
            let mut blocks = self.system.inverse_diagonal().unwrap_or_default();
            for (pose, block) in blocks.iter_mut().enumerate() {
                if self.system.is_held(pose) {
                    *block = Matrix3::zeros();
                }
            }
            self.marginals = Some(blocks);
        }
        self.marginals.as_deref().unwrap_or_default()
    }

    /// Covariance of (x, y, θ) of one pose, as in [`CovarianceSolver::marginals`].
    ///
    /// # Errors
    /// `UnknownPose`.
    pub fn marginal(&mut self, pose: u32) -> Result<Matrix3<f64>, PoseGraphError> {
        self.check(pose)?;
        Ok(self.marginals()[pose as usize])
    }

    /// Something not smaller than the covariance of [`CovarianceSolver::relative`], without a solve: the two poses'
    /// errors are taken to be as contrary as they can be.
    ///
    /// # Errors
    /// `UnknownPose`, `NotConnected`.
    pub fn relative_bound(&mut self, pose: u32, other: u32) -> Result<(Pose2, Matrix3<f64>), PoseGraphError> {
        self.check_pair(pose, other)?;
        let (own, theirs) = (self.marginals()[pose as usize], self.marginals()[other as usize]);
        let (x_i, x_j) = (&self.poses[pose as usize], &self.poses[other as usize]);
        let (i_from_j, sum) = relative_covariance((x_i, &own), (x_j, &theirs), &Matrix3::zeros());
        Ok((i_from_j, sum * 2.0))
    }

    /// Pose of `other` seen from `pose` and the covariance of (x, y, θ) of that relative pose, in the axes of `pose`.
    ///
    /// # Errors
    /// `UnknownPose`, `NotConnected`.
    pub fn relative(&mut self, pose: u32, other: u32) -> Result<(Pose2, Matrix3<f64>), PoseGraphError> {
        Ok(self.relatives(&[(pose, vec![other])])?[0][0])
    }

    /// Like [`CovarianceSolver::relative`] for many poses and, of each, many others; answers in the order of the
    /// questions. Uses all cores.
    ///
    /// # Errors
    /// `UnknownPose`, `NotConnected`.
    pub fn relatives(
        &mut self,
        questions: &[(u32, Vec<u32>)],
    ) -> Result<Vec<Vec<(Pose2, Matrix3<f64>)>>, PoseGraphError> {
        for (pose, others) in questions {
            self.check(*pose)?;
            others.iter().try_for_each(|&other| self.check_pair(*pose, other))?;
        }
        self.marginals();
        let marginals = self.marginals.as_deref().unwrap_or_default();
        let answer = |workspace: &mut Workspace<3>, (pose, others): &(u32, Vec<u32>)| {
            let seen = (&self.poses[*pose as usize], &marginals[*pose as usize]);
            let relative = |(&other, cross): (&u32, Matrix3<f64>)| {
                let theirs = (&self.poses[other as usize], &marginals[other as usize]);
                relative_covariance(seen, theirs, &cross)
            };
            others.iter().zip(self.blocks(*pose, others, workspace)).map(relative).collect()
        };
        Ok(questions.par_iter().map_init(|| self.system.workspace(), answer).collect())
    }

    fn check_pair(&self, pose: u32, other: u32) -> Result<(), PoseGraphError> {
        self.check(pose)?;
        self.check(other)?;
        let component_of = |p: u32| self.components.component_of_pose[p as usize];
        if component_of(pose) == component_of(other) {
            return Ok(());
        }
        Err(PoseGraphError::NotConnected { first: pose as usize, second: other as usize })
    }

    fn check(&self, pose: u32) -> Result<(), PoseGraphError> {
        if (pose as usize) < self.poses.len() {
            return Ok(());
        }
        Err(PoseGraphError::UnknownPose { pose: pose as usize, num_poses: self.poses.len() })
    }

    /// Covariance blocks (other, pose) for every other; held poses vary with nothing.
    fn blocks(&self, pose: u32, others: &[u32], workspace: &mut Workspace<3>) -> Vec<Matrix3<f64>> {
        let mut blocks = self.system.inverse_blocks(pose as usize, others, workspace);
        for (block, &other) in blocks.iter_mut().zip(others) {
            if self.system.is_held(pose as usize) || self.system.is_held(other as usize) {
                *block = Matrix3::zeros();
            }
        }
        blocks
    }
}

/// Propagates the joint covariance of two poses through x_i⁻¹ x_j; `cross` is the block of rows j, columns i.
fn relative_covariance(
    (x_i, sigma_ii): (&Pose2, &Matrix3<f64>),
    (x_j, sigma_jj): (&Pose2, &Matrix3<f64>),
    cross: &Matrix3<f64>,
) -> (Pose2, Matrix3<f64>) {
    let i_from_j = x_i.between(x_j);
    let (sin, cos) = x_i.theta.sin_cos();
    let by_j = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
    let mut by_i = -by_j;
    by_i[(0, 2)] = i_from_j.y;
    by_i[(1, 2)] = -i_from_j.x;
    let mixed = by_j * cross * by_i.transpose();
    let covariance =
        by_i * sigma_ii * by_i.transpose() + by_j * sigma_jj * by_j.transpose() + mixed + mixed.transpose();
    (i_from_j, (covariance + covariance.transpose()) * 0.5)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{constraint, dense_information, random_drive};
    use super::*;

    #[test]
    fn marginals_are_blocks_of_the_dense_inverse() {
        let (graph, _) = random_drive(5, 30, 20);
        let dense = dense_information(&graph).try_inverse().unwrap();
        let mut solver = CovarianceSolver::new(&graph).unwrap();
        assert_eq!(solver.marginal(0).unwrap(), Matrix3::zeros());
        let (_, bound) = solver.relative_bound(4, 20).unwrap();
        let (_, exact) = solver.relative(4, 20).unwrap();
        assert!((bound - exact).symmetric_eigenvalues().min() >= -1e-12);
        for pose in 1..30u32 {
            let first = 3 * (pose as usize - 1);
            let expected = dense.fixed_view::<3, 3>(first, first);
            let marginal = solver.marginal(pose).unwrap();
            assert!((marginal - expected).amax() < 1e-5 * expected.amax(), "pose {pose}");
        }
    }

    #[test]
    fn covariances_between_poses_are_those_of_the_dense_inverse() {
        let (graph, _) = random_drive(7, 60, 40);
        let dense = dense_information(&graph).try_inverse().unwrap();
        let block = |i: u32, j: u32| {
            if i == 0 || j == 0 {
                return Matrix3::zeros();
            }
            dense.fixed_view::<3, 3>(3 * (i as usize - 1), 3 * (j as usize - 1)).into_owned()
        };
        let questions: Vec<(u32, Vec<u32>)> =
            (0..60).map(|pose| (pose, vec![(pose * 7 + 3) % 60, (pose * 31 + 8) % 60, 0])).collect();
        let mut solver = CovarianceSolver::new(&graph).unwrap();
        let answers = solver.relatives(&questions).unwrap();
        for ((pose, others), answers) in questions.iter().zip(&answers) {
            for (&other, (_, covariance)) in others.iter().zip(answers) {
                let (x_i, x_j) = (&graph.poses()[*pose as usize], &graph.poses()[other as usize]);
                let own = (x_i, &block(*pose, *pose));
                let expected = relative_covariance(own, (x_j, &block(other, other)), &block(other, *pose)).1;
                assert!((covariance - expected).amax() < 1e-5 * expected.amax().max(1e-6), "{pose} {other}");
            }
        }
    }

    #[test]
    fn relative_covariance_does_not_depend_on_what_is_held() {
        let (graph, _) = random_drive(6, 40, 25);
        let mut moved = graph.clone();
        moved.hold(17).unwrap();
        let mut solver = CovarianceSolver::new(&graph).unwrap();
        let mut other_solver = CovarianceSolver::new(&moved).unwrap();
        for (i, j) in [(3, 30), (30, 3), (0, 12), (17, 5), (8, 9)] {
            let (pose, covariance) = solver.relative(i, j).unwrap();
            let (other_pose, other) = other_solver.relative(i, j).unwrap();
            assert_eq!(pose, other_pose);
            assert!((covariance - other).amax() < 1e-6 * covariance.amax(), "{i} {j}");
        }
    }

    #[test]
    fn along_a_chain_covariances_compose() {
        let mut graph = PoseGraph::new();
        let step = Pose2::new(2.0, 0.5, 0.7);
        let mut pose = Pose2::new(1.0, -1.0, 0.4);
        for _ in 0..4 {
            graph.add_pose(pose).unwrap();
            pose = pose.compose(&step);
        }
        for i in 0..3 {
            graph.add_constraint(constraint(i, i + 1, step, [100.0, 400.0, 900.0])).unwrap();
        }
        let one = Matrix3::from_diagonal(&[0.01, 0.0025, 1.0 / 900.0].into());
        // Ω stands in the axes of z, which are turned against those of the pose by z's own heading.
        let (sin, cos) = step.theta.sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let one = turn * one * turn.transpose();
        let two = step.compose_covariance(&one, &step, &one);
        let mut solver = CovarianceSolver::new(&graph).unwrap();
        let (i_from_j, covariance) = solver.relative(1, 3).unwrap();
        assert!(i_from_j.distance(&step.compose(&step)) < 1e-9);
        assert!((covariance - two).amax() < 1e-9, "{covariance} {two}");
    }

    #[test]
    fn says_what_it_cannot_answer() {
        let (mut graph, _) = random_drive(1, 5, 0);
        graph.add_pose(Pose2::identity()).unwrap();
        let mut solver = CovarianceSolver::new(&graph).unwrap();
        assert_eq!(solver.marginal(9), Err(PoseGraphError::UnknownPose { pose: 9, num_poses: 6 }));
        assert_eq!(solver.relative(0, 5), Err(PoseGraphError::NotConnected { first: 0, second: 5 }));
        assert!(CovarianceSolver::new(&PoseGraph::new()).is_err());
    }
}
