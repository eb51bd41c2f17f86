//! The pose graph: poses and the measured relative poses between them.

use super::{InformationMatrix, PoseGraphError, residual};
use crate::geometry::Pose2;

/// Indices are stored in 32 bits, and three unknowns per pose must still fit.
const MAX_ITEMS: usize = (u32::MAX / 16) as usize;

/// Whether a constraint may be wrong altogether.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trust {
    /// Motion measured between consecutive poses: noisy, never wrong.
    #[default]
    Trusted,
    /// A claim that two places are one: robust optimisation may reject it.
    Doubtful,
}

/// A measured relative pose ⟨z, Ω⟩ between two poses (an arc of thesis 2.1.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseConstraint {
    /// Index of the pose from which the other is seen.
    pub i: u32,
    /// Index of the pose that is seen.
    pub j: u32,
    /// z: pose j as measured from pose i.
    pub i_from_j: Pose2,
    /// Ω: inverse covariance of z in the axes of z.
    pub information: InformationMatrix,
}

/// Poses, named by the order in which they were added, and constraints between them.
///
/// Every pose is finite and every constraint names two different poses that exist; the methods that add them check.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseGraph {
    poses: Vec<Pose2>,
    constraints: Vec<PoseConstraint>,
    trusts: Vec<Trust>,
    held: Vec<u32>,
}

impl PoseGraph {
    /// A graph without poses.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a pose at its first guess and returns its index.
    ///
    /// # Errors
    /// `PoseNotFinite`, `TooLarge`.
    pub fn add_pose(&mut self, pose: Pose2) -> Result<u32, PoseGraphError> {
        let index = self.poses.len();
        if !pose.is_finite() {
            return Err(PoseGraphError::PoseNotFinite { pose: index });
        }
        if index >= MAX_ITEMS {
            return Err(PoseGraphError::TooLarge { limit: MAX_ITEMS });
        }
        self.poses.push(pose);
        Ok(index as u32)
    }

    /// Adds a trusted constraint and returns its index.
    ///
    /// # Errors
    /// `UnknownPose`, `SelfConstraint`, `MeasurementNotFinite`, `TooLarge`.
    pub fn add_constraint(&mut self, constraint: PoseConstraint) -> Result<u32, PoseGraphError> {
        self.add(constraint, Trust::Trusted)
    }

    /// Adds a constraint that robust optimisation may reject, and returns its index.
    ///
    /// # Errors
    /// As [`PoseGraph::add_constraint`].
    pub fn add_doubtful(&mut self, constraint: PoseConstraint) -> Result<u32, PoseGraphError> {
        self.add(constraint, Trust::Doubtful)
    }

    fn add(&mut self, constraint: PoseConstraint, trust: Trust) -> Result<u32, PoseGraphError> {
        let index = self.constraints.len();
        self.check_pose(constraint.i)?;
        self.check_pose(constraint.j)?;
        if constraint.i == constraint.j {
            return Err(PoseGraphError::SelfConstraint { constraint: index, pose: constraint.i as usize });
        }
        if !constraint.i_from_j.is_finite() {
            return Err(PoseGraphError::MeasurementNotFinite { constraint: index });
        }
        if index >= MAX_ITEMS {
            return Err(PoseGraphError::TooLarge { limit: MAX_ITEMS });
        }
        self.constraints.push(constraint);
        self.trusts.push(trust);
        Ok(index as u32)
    }

    /// Keeps a pose where it stands. A component without held poses is held by its first pose.
    ///
    /// # Errors
    /// `UnknownPose`.
    pub fn hold(&mut self, pose: u32) -> Result<(), PoseGraphError> {
        self.check_pose(pose)?;
        if let Err(position) = self.held.binary_search(&pose) {
            self.held.insert(position, pose);
        }
        Ok(())
    }

    /// Moves a pose, for instance to a better first guess.
    ///
    /// # Errors
    /// `UnknownPose`, `PoseNotFinite`.
    pub fn set_pose(&mut self, pose: u32, value: Pose2) -> Result<(), PoseGraphError> {
        self.check_pose(pose)?;
        if !value.is_finite() {
            return Err(PoseGraphError::PoseNotFinite { pose: pose as usize });
        }
        self.poses[pose as usize] = value;
        Ok(())
    }

    /// All poses, by index.
    pub fn poses(&self) -> &[Pose2] {
        &self.poses
    }

    /// All constraints, by index.
    pub fn constraints(&self) -> &[PoseConstraint] {
        &self.constraints
    }

    /// For every constraint whether robust optimisation may reject it.
    pub fn trusts(&self) -> &[Trust] {
        &self.trusts
    }

    /// Indices of the held poses, ascending.
    pub fn held(&self) -> &[u32] {
        &self.held
    }

    /// χ² = Σ eᵀ Ω e at the present poses (Eq 2.5).
    pub fn chi2(&self) -> f64 {
        let weights = vec![1.0; self.constraints.len()];
        residual::weighted_chi2(&self.poses, &self.constraints, &weights)
    }

    /// χ² of one constraint at the present poses; `None` when there is no such constraint.
    pub fn constraint_chi2(&self, constraint: u32) -> Option<f64> {
        let constraint = self.constraints.get(constraint as usize)?;
        Some(residual::constraint_chi2(&self.poses, constraint))
    }

    /// The same poses with only the constraints that `is_kept` names by index.
    pub fn with_constraints(&self, is_kept: impl Fn(usize) -> bool) -> PoseGraph {
        let kept = || (0..self.constraints.len()).filter(|&index| is_kept(index));
        PoseGraph {
            poses: self.poses.clone(),
            constraints: kept().map(|index| self.constraints[index]).collect(),
            trusts: kept().map(|index| self.trusts[index]).collect(),
            held: self.held.clone(),
        }
    }

    pub(super) fn check_pose(&self, pose: u32) -> Result<(), PoseGraphError> {
        if (pose as usize) < self.poses.len() {
            return Ok(());
        }
        Err(PoseGraphError::UnknownPose { pose: pose as usize, num_poses: self.poses.len() })
    }

    /// Replaces all poses by finite ones of the same number.
    pub(super) fn replace_poses(&mut self, poses: Vec<Pose2>) {
        debug_assert_eq!(poses.len(), self.poses.len());
        self.poses = poses;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constraint(i: u32, j: u32, x: f64) -> PoseConstraint {
        let information = InformationMatrix::try_new(nalgebra::Matrix3::identity()).unwrap();
        PoseConstraint { i, j, i_from_j: Pose2 { x, y: 0.0, theta: 0.0 }, information }
    }

    #[test]
    fn refuses_what_cannot_be_a_graph() {
        let mut graph = PoseGraph::new();
        graph.add_pose(Pose2::identity()).unwrap();
        graph.add_pose(Pose2::identity()).unwrap();
        let nan = Pose2 { x: f64::NAN, y: 0.0, theta: 0.0 };
        assert_eq!(graph.add_pose(nan), Err(PoseGraphError::PoseNotFinite { pose: 2 }));
        assert_eq!(graph.set_pose(1, nan), Err(PoseGraphError::PoseNotFinite { pose: 1 }));
        assert_eq!(
            graph.add_constraint(constraint(0, 2, 1.0)),
            Err(PoseGraphError::UnknownPose { pose: 2, num_poses: 2 })
        );
        assert_eq!(
            graph.add_constraint(constraint(1, 1, 1.0)),
            Err(PoseGraphError::SelfConstraint { constraint: 0, pose: 1 })
        );
        assert_eq!(
            graph.add_constraint(constraint(0, 1, f64::INFINITY)),
            Err(PoseGraphError::MeasurementNotFinite { constraint: 0 })
        );
        assert_eq!(graph.hold(7), Err(PoseGraphError::UnknownPose { pose: 7, num_poses: 2 }));
        assert!(graph.constraints().is_empty());
    }

    #[test]
    fn chi2_is_the_weighted_square_of_the_error() {
        let mut graph = PoseGraph::new();
        graph.add_pose(Pose2::identity()).unwrap();
        graph.add_pose(Pose2::new(3.0, 0.0, 0.0)).unwrap();
        graph.add_constraint(constraint(0, 1, 1.0)).unwrap();
        assert_eq!(graph.chi2(), 4.0);
        assert_eq!(graph.constraint_chi2(0), Some(4.0));
        assert_eq!(graph.constraint_chi2(1), None);
    }
}
