//! A start that needs no first guess: rotations by a linear relaxation, then positions (Carlone et al. 2015).
//!
//! Headings are hard because they wrap. Written as unit vectors u = (cos θ, sin θ), a measured turn says
//! u_j ≈ R_z u_i, which is linear; forgetting |u| = 1 gives a sparse least squares problem with one solution, whose
//! vectors are then read as headings. With headings fixed, the best positions are linear too. Two systems of two
//! unknowns per pose are solved, on the ordering that the optimiser needs anyway.

use nalgebra::{Matrix2, Vector2};

use super::PoseGraphError;
use super::normal_equations::{BlockPattern, NormalEquations};
use super::residual::{PreparedConstraint, TurnedPose};
use crate::geometry::Pose2;

/// Poses that fit the constraints up to the relaxation; held poses stay.
///
/// Cost: one symbolic and two numeric factorisations with two unknowns per pose.
///
/// # Errors
/// `NotPositiveDefinite` when turns or positions are not determined, `OutOfMemory`.
pub(super) fn chordal_start(
    poses: &[Pose2],
    constraints: &[PreparedConstraint],
    pattern: &BlockPattern,
    system: &mut NormalEquations<2>,
) -> Result<Vec<Pose2>, PoseGraphError> {
    let mut turned: Vec<TurnedPose> = poses.iter().map(TurnedPose::new).collect();
    relax_headings(poses, constraints, pattern, system)?;
    for (index, pose) in turned.iter_mut().enumerate() {
        if !pattern.is_held(index) {
            let heading = system.solution(index);
            *pose = TurnedPose::new(&Pose2 { theta: heading.y.atan2(heading.x), ..pose.pose });
        }
    }
    solve_positions(&turned, constraints, pattern, system)?;
    let place = |(index, pose): (usize, &TurnedPose)| {
        if pattern.is_held(index) {
            return pose.pose;
        }
        let position = system.solution(index);
        Pose2 { x: position.x, y: position.y, ..pose.pose }
    };
    Ok(turned.iter().enumerate().map(place).collect())
}

/// min Σ w |u_j − R_z u_i|² over the vectors u of all free poses.
fn relax_headings(
    poses: &[Pose2],
    constraints: &[PreparedConstraint],
    pattern: &BlockPattern,
    system: &mut NormalEquations<2>,
) -> Result<(), PoseGraphError> {
    system.clear();
    for (index, constraint) in constraints.iter().enumerate() {
        let (cos, sin, weight) = constraint.turn_terms();
        let turn = Matrix2::new(cos, -sin, sin, cos) * weight;
        let diagonal = Matrix2::identity() * weight;
        // A held neighbour's vector is known and moves to the right-hand side.
        let known = |pose: usize| {
            let (sin, cos) = poses[pose].theta.sin_cos();
            if pattern.is_held(pose) { Vector2::new(cos, sin) } else { Vector2::zeros() }
        };
        let b_i = turn.transpose() * known(constraint.j);
        let b_j = turn * known(constraint.i);
        system.add_constraint(
            index,
            (constraint.i, constraint.j),
            (&diagonal, &-turn.transpose(), &diagonal),
            (&b_i, &b_j),
        );
    }
    system.factorize()?;
    system.solve();
    Ok(())
}

/// min χ² over the positions of all free poses with their headings as they are.
fn solve_positions(
    poses: &[TurnedPose],
    constraints: &[PreparedConstraint],
    pattern: &BlockPattern,
    system: &mut NormalEquations<2>,
) -> Result<(), PoseGraphError> {
    system.clear();
    for (index, constraint) in constraints.iter().enumerate() {
        let (x_i, x_j) = (&poses[constraint.i], &poses[constraint.j]);
        let (information, pull, measured) = constraint.translation_terms(x_i, x_j);
        let known = |pose: usize| {
            let held = &poses[pose].pose;
            if pattern.is_held(pose) { Vector2::new(held.x, held.y) } else { Vector2::zeros() }
        };
        // Gradient of (t_j − t_i − m)ᵀ Ω (t_j − t_i − m) + 2 pullᵀ (t_j − t_i), halved and set to zero.
        let target = information * measured - pull;
        let b_i = information * known(constraint.j) - target;
        let b_j = information * known(constraint.i) + target;
        system.add_constraint(
            index,
            (constraint.i, constraint.j),
            (&information, &-information, &information),
            (&b_i, &b_j),
        );
    }
    system.factorize()?;
    system.solve();
    Ok(())
}
