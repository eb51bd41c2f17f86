//! Error and linearisation of one constraint (thesis Eqs 2.4 and B.3, B.13, B.14).
//!
//! e = z⁻¹ · (x_i⁻¹ x_j) lives in the axes of z seen from x_i. Turned into the map's axes by the rotation
//! M = R(θ_i + θ_z) ⊕ 1 it becomes e' = M e with
//!
//! ```text
//! e' = ( t_j − t_i − R_i z_t ,  wrap(θ_j − θ_i − θ_z) )      Ω' = M Ω Mᵀ      eᵀΩe = e'ᵀΩ'e'
//! ∂e/∂x_j = Mᵀ                                               ∂e/∂x_i = −Mᵀ G
//! G = | 1 0 −d_y |
//!     | 0 1  d_x |      d = t_j − t_i
//!     | 0 0   1  |
//! ```
//!
//! so that with g = Ω' e' the four blocks of H and two of b are Ω', −GᵀΩ', GᵀΩ'G and g, −Gᵀg: the same numbers as
//! AᵀΩA, AᵀΩB, BᵀΩB of Eq B.14 with a third of the work.

use nalgebra::{Matrix3, Vector3};

use super::PoseConstraint;
use crate::geometry::{Pose2, wrap_angle};

/// A pose with the sine and cosine of its heading, computed once per pose instead of once per constraint.
#[derive(Clone, Copy, Debug)]
pub(super) struct TurnedPose {
    pub pose: Pose2,
    sin: f64,
    cos: f64,
}

impl TurnedPose {
    pub fn new(pose: &Pose2) -> Self {
        let (sin, cos) = pose.theta.sin_cos();
        Self { pose: *pose, sin, cos }
    }
}

/// A constraint with what does not change between iterations.
#[derive(Clone, Copy, Debug)]
pub(super) struct PreparedConstraint {
    pub i: usize,
    pub j: usize,
    i_from_j: TurnedPose,
    information: Matrix3<f64>,
}

/// The parts of e' and Ω' that cost and derivatives are made of.
struct MapError {
    error: Vector3<f64>,
    information: Matrix3<f64>,
    /// d = t_j − t_i.
    offset: (f64, f64),
}

/// Contribution of one constraint to the normal equations H Δ = −b.
pub(super) struct Linearized {
    pub h_ii: Matrix3<f64>,
    pub h_ij: Matrix3<f64>,
    pub h_jj: Matrix3<f64>,
    pub b_i: Vector3<f64>,
    pub b_j: Vector3<f64>,
}

impl PreparedConstraint {
    pub fn new(constraint: &PoseConstraint) -> Self {
        Self {
            i: constraint.i as usize,
            j: constraint.j as usize,
            i_from_j: TurnedPose::new(&constraint.i_from_j),
            information: *constraint.information.as_matrix(),
        }
    }

    /// eᵀ Ω e.
    pub fn chi2(&self, poses: &[TurnedPose]) -> f64 {
        let error = self.error(&poses[self.i], &poses[self.j]);
        (self.information * error).dot(&error)
    }

    /// eᵀ Ω e that rounding alone may leave where the poses reach `extent_m` from the origin.
    pub fn chi2_of_rounding(&self, extent_m: f64) -> f64 {
        let z = self.i_from_j.pose;
        let position = f64::EPSILON * (2.0 * extent_m + z.x.abs() + z.y.abs());
        let turn = f64::EPSILON * 3.0 * std::f64::consts::PI;
        let m = &self.information;
        (m[(0, 0)] + m[(1, 1)]) * position * position + m[(2, 2)] * turn * turn
    }

    /// e in its own axes: metres, metres, radians in (−π, π].
    fn error(&self, x_i: &TurnedPose, x_j: &TurnedPose) -> Vector3<f64> {
        let z = &self.i_from_j;
        let (dx, dy) = (x_j.pose.x - x_i.pose.x, x_j.pose.y - x_i.pose.y);
        let seen_x = x_i.cos * dx + x_i.sin * dy - z.pose.x;
        let seen_y = x_i.cos * dy - x_i.sin * dx - z.pose.y;
        let turn = wrap_angle(x_j.pose.theta - x_i.pose.theta - z.pose.theta);
        Vector3::new(z.cos * seen_x + z.sin * seen_y, z.cos * seen_y - z.sin * seen_x, turn)
    }

    fn map_error(&self, x_i: &TurnedPose, x_j: &TurnedPose) -> MapError {
        let z = &self.i_from_j;
        let offset = (x_j.pose.x - x_i.pose.x, x_j.pose.y - x_i.pose.y);
        let error = Vector3::new(
            offset.0 - (x_i.cos * z.pose.x - x_i.sin * z.pose.y),
            offset.1 - (x_i.sin * z.pose.x + x_i.cos * z.pose.y),
            wrap_angle(x_j.pose.theta - x_i.pose.theta - z.pose.theta),
        );
        let cos = x_i.cos * z.cos - x_i.sin * z.sin;
        let sin = x_i.sin * z.cos + x_i.cos * z.sin;
        MapError { error, information: rotated(&self.information, sin, cos), offset }
    }

    /// The blocks of H and b, multiplied by `weight`.
    pub fn linearize(&self, poses: &[TurnedPose], weight: f64) -> Linearized {
        let MapError { error, information, offset } = self.map_error(&poses[self.i], &poses[self.j]);
        let h_jj = information * weight;
        let b_j = h_jj * error;
        let h_ij = -lever_transposed_times(offset, &h_jj);
        // GᵀΩ'G = (Gᵀ (GᵀΩ')ᵀ)ᵀ, and the result is symmetric.
        let h_ii = -lever_transposed_times(offset, &h_ij.transpose());
        let b_i = -Vector3::new(b_j.x, b_j.y, b_j.z + offset.0 * b_j.y - offset.1 * b_j.x);
        Linearized { h_ii, h_ij, h_jj, b_i, b_j }
    }

    /// Ω' of the translation and its coupling with the rotation, for the translation step of the chordal start:
    /// (Ω'_tt, Ω'_tθ e_θ, R_i z_t).
    pub fn translation_terms(
        &self,
        x_i: &TurnedPose,
        x_j: &TurnedPose,
    ) -> (nalgebra::Matrix2<f64>, nalgebra::Vector2<f64>, nalgebra::Vector2<f64>) {
        let MapError { error, information, offset } = self.map_error(x_i, x_j);
        let pull = information.fixed_view::<2, 1>(0, 2) * error.z;
        let measured = nalgebra::Vector2::new(offset.0 - error.x, offset.1 - error.y);
        (information.fixed_view::<2, 2>(0, 0).into_owned(), pull, measured)
    }

    /// Cosine and sine of the measured turn, and its information.
    pub fn turn_terms(&self) -> (f64, f64, f64) {
        (self.i_from_j.cos, self.i_from_j.sin, self.information[(2, 2)])
    }
}

/// Gᵀ m for the lever arm d.
fn lever_transposed_times(d: (f64, f64), m: &Matrix3<f64>) -> Matrix3<f64> {
    let mut product = *m;
    for column in 0..3 {
        product[(2, column)] += d.0 * m[(1, column)] - d.1 * m[(0, column)];
    }
    product
}

/// M Ω Mᵀ for the rotation M = R ⊕ 1.
fn rotated(information: &Matrix3<f64>, sin: f64, cos: f64) -> Matrix3<f64> {
    let (xx, xy, yy) = (information[(0, 0)], information[(0, 1)], information[(1, 1)]);
    let (xt, yt, tt) = (information[(0, 2)], information[(1, 2)], information[(2, 2)]);
    let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
    let new_xx = cc * xx - 2.0 * cs * xy + ss * yy;
    let new_yy = ss * xx + 2.0 * cs * xy + cc * yy;
    let new_xy = cs * (xx - yy) + (cc - ss) * xy;
    let (new_xt, new_yt) = (cos * xt - sin * yt, sin * xt + cos * yt);
    Matrix3::new(new_xx, new_xy, new_xt, new_xy, new_yy, new_yt, new_xt, new_yt, tt)
}

/// χ² of one constraint at the given poses.
pub(super) fn constraint_chi2(poses: &[Pose2], constraint: &PoseConstraint) -> f64 {
    let prepared = PreparedConstraint::new(constraint);
    let (x_i, x_j) = (TurnedPose::new(&poses[prepared.i]), TurnedPose::new(&poses[prepared.j]));
    let error = prepared.error(&x_i, &x_j);
    (prepared.information * error).dot(&error)
}

/// Σ w eᵀ Ω e in the order of the constraints.
pub(super) fn weighted_chi2(poses: &[Pose2], constraints: &[PoseConstraint], weights: &[f64]) -> f64 {
    constraints
        .iter()
        .zip(weights)
        .map(|(constraint, weight)| weight * constraint_chi2(poses, constraint))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_graph::InformationMatrix;
    use nalgebra::Matrix3x6;
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = Pose2> {
        (-20.0..20.0f64, -20.0..20.0f64, -4.0..4.0f64).prop_map(|(x, y, theta)| Pose2::new(x, y, theta))
    }

    /// AᵀA is positive semidefinite for every A.
    fn information() -> impl Strategy<Value = InformationMatrix> {
        prop::array::uniform9(-3.0..3.0f64).prop_map(|numbers| {
            let a = Matrix3::from_row_slice(&numbers);
            InformationMatrix::try_new(a.transpose() * a).unwrap()
        })
    }

    /// The error as SPEC section 3.12 and thesis Eq 2.4 write it.
    fn textbook_error(x_i: &Pose2, x_j: &Pose2, z: &Pose2) -> Vector3<f64> {
        z.between(&x_i.between(x_j)).to_vector()
    }

    fn moved(pose: &Pose2, coordinate: usize, step: f64) -> Pose2 {
        let mut vector = pose.to_vector();
        vector[coordinate] += step;
        Pose2::from_vector(&vector)
    }

    /// Jacobian of the textbook error by central differences, columns x_i then x_j.
    fn numeric_jacobian(x_i: &Pose2, x_j: &Pose2, z: &Pose2) -> Matrix3x6<f64> {
        let step = 1e-5;
        let mut jacobian = Matrix3x6::zeros();
        for column in 0..6 {
            let at = |signed_step: f64| {
                let (a, b) = if column < 3 {
                    (moved(x_i, column, signed_step), *x_j)
                } else {
                    (*x_i, moved(x_j, column - 3, signed_step))
                };
                textbook_error(&a, &b, z)
            };
            let mut difference = at(step) - at(-step);
            difference.z = wrap_angle(difference.z);
            jacobian.set_column(column, &(difference / (2.0 * step)));
        }
        jacobian
    }

    proptest! {
        #[test]
        fn agrees_with_the_textbook(x_i in pose(), x_j in pose(), z in pose(), information in information()) {
            let constraint = PoseConstraint { i: 0, j: 1, i_from_j: z, information };
            let prepared = PreparedConstraint::new(&constraint);
            let poses = [TurnedPose::new(&x_i), TurnedPose::new(&x_j)];
            let error = textbook_error(&x_i, &x_j, &z);
            let omega = information.as_matrix();
            let mut difference = prepared.error(&poses[0], &poses[1]) - error;
            difference.z = wrap_angle(difference.z);
            prop_assert!(difference.amax() < 1e-9);

            let jacobian = numeric_jacobian(&x_i, &x_j, &z);
            let hessian = jacobian.transpose() * omega * jacobian;
            let gradient = jacobian.transpose() * omega * error;
            let linearized = prepared.linearize(&poses, 1.0);
            let tolerance = 1e-4 * (1.0 + hessian.amax());
            prop_assert!((hessian.fixed_view::<3, 3>(0, 0) - linearized.h_ii).amax() < tolerance);
            prop_assert!((hessian.fixed_view::<3, 3>(0, 3) - linearized.h_ij).amax() < tolerance);
            prop_assert!((hessian.fixed_view::<3, 3>(3, 3) - linearized.h_jj).amax() < tolerance);
            let tolerance = 1e-4 * (1.0 + gradient.amax() + hessian.amax());
            prop_assert!((gradient.fixed_rows::<3>(0) - linearized.b_i).amax() < tolerance);
            prop_assert!((gradient.fixed_rows::<3>(3) - linearized.b_j).amax() < tolerance);
        }
    }
}
