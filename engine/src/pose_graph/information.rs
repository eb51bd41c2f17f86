//! Information matrices Ω of constraints, checked once when they enter.

use nalgebra::{Matrix3, SymmetricEigen};
use thiserror::Error;

/// Relative size below which an asymmetry or a negative eigenvalue counts as rounding: matrices travel as text with
/// about six digits, and a nearly singular one (a plain corridor) may come back slightly indefinite.
const ROUNDING: f64 = 1e-5;

/// Products of three entries are finite below.
const LARGEST: f64 = 1e100;

/// Why three by three numbers are no information matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum InformationError {
    /// NaN, ∞, or so large that products of it are.
    #[error("it has numbers that are not finite, or beyond 1e100")]
    NotFinite,
    /// Ω differs from its transpose by more than rounding.
    #[error("it is not symmetric")]
    NotSymmetric,
    /// Some eigenvalue is negative by more than rounding.
    #[error("it is not positive semidefinite")]
    NotPositiveSemidefinite,
    /// A covariance without inverse.
    #[error("the covariance has no inverse")]
    SingularCovariance,
}

/// Inverse covariance of a relative pose (x, y, θ): finite, symmetric and positive semidefinite.
///
/// Metres and radians, so that the entries are 1/m², 1/(m rad) and 1/rad². Directions of no information are
/// allowed; whether the graph as a whole is determined is found when it is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InformationMatrix(Matrix3<f64>);

impl InformationMatrix {
    /// Checks a matrix; asymmetry within rounding is averaged away.
    ///
    /// # Errors
    /// [`InformationError`] with the first property that does not hold.
    pub fn try_new(matrix: Matrix3<f64>) -> Result<Self, InformationError> {
        if !matrix.iter().all(|number| number.abs() <= LARGEST) {
            return Err(InformationError::NotFinite);
        }
        let scale = matrix.amax();
        if (matrix - matrix.transpose()).amax() > ROUNDING * scale {
            return Err(InformationError::NotSymmetric);
        }
        let symmetric = (matrix + matrix.transpose()) * 0.5;
        if !is_positive_definite(&symmetric) && smallest_eigenvalue(&symmetric) < -ROUNDING * scale {
            return Err(InformationError::NotPositiveSemidefinite);
        }
        Ok(Self(symmetric))
    }

    /// The inverse of a covariance of (x, y, θ), row by row, m² and rad².
    ///
    /// # Errors
    /// [`InformationError::SingularCovariance`] and whatever [`InformationMatrix::try_new`] finds.
    pub fn from_covariance(covariance: &[[f64; 3]; 3]) -> Result<Self, InformationError> {
        let covariance = Matrix3::from_fn(|row, column| covariance[row][column]);
        if !covariance.iter().all(|number| number.is_finite()) {
            return Err(InformationError::NotFinite);
        }
        let inverse = covariance.try_inverse().ok_or(InformationError::SingularCovariance)?;
        Self::try_new(inverse)
    }

    /// Independent x, y and θ with these standard deviations, metres and radians.
    ///
    /// # Errors
    /// [`InformationError::NotFinite`] when a deviation is zero or not finite.
    pub fn from_standard_deviations(x_m: f64, y_m: f64, theta_rad: f64) -> Result<Self, InformationError> {
        let weight = |deviation: f64| (deviation * deviation).recip();
        Self::try_new(Matrix3::from_diagonal(&[weight(x_m), weight(y_m), weight(theta_rad)].into()))
    }

    /// The matrix.
    pub const fn as_matrix(&self) -> &Matrix3<f64> {
        &self.0
    }
}

/// Sylvester's criterion on the leading minors; decides nearly every matrix without an eigenvalue problem.
fn is_positive_definite(m: &Matrix3<f64>) -> bool {
    let second_minor = m[(0, 0)] * m[(1, 1)] - m[(0, 1)] * m[(1, 0)];
    m[(0, 0)] > 0.0 && second_minor > 0.0 && m.determinant() > 0.0
}

fn smallest_eigenvalue(symmetric: &Matrix3<f64>) -> f64 {
    SymmetricEigen::new(*symmetric).eigenvalues.min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accepts_definite_and_semidefinite_matrices() {
        assert!(InformationMatrix::try_new(Matrix3::identity()).is_ok());
        assert!(InformationMatrix::try_new(Matrix3::from_diagonal(&[1.0, 0.0, 2.0].into())).is_ok());
        assert!(InformationMatrix::try_new(Matrix3::zeros()).is_ok());
    }

    #[test]
    fn names_what_is_wrong() {
        let nan = Matrix3::from_diagonal(&[1.0, f64::NAN, 1.0].into());
        assert_eq!(InformationMatrix::try_new(nan), Err(InformationError::NotFinite));
        let huge = Matrix3::from_diagonal(&[1.0, -1e308, 1.0].into());
        assert_eq!(InformationMatrix::try_new(huge), Err(InformationError::NotFinite));
        let negative = Matrix3::from_diagonal(&[1.0, -1.0, 1.0].into());
        assert_eq!(InformationMatrix::try_new(negative), Err(InformationError::NotPositiveSemidefinite));
        let mut skew = Matrix3::identity();
        skew[(0, 1)] = 0.5;
        assert_eq!(InformationMatrix::try_new(skew), Err(InformationError::NotSymmetric));
        assert_eq!(
            InformationMatrix::from_covariance(&[[0.0; 3]; 3]),
            Err(InformationError::SingularCovariance)
        );
        assert_eq!(
            InformationMatrix::from_standard_deviations(0.0, 1.0, 1.0),
            Err(InformationError::NotFinite)
        );
    }

    #[test]
    fn inverts_covariances() {
        let information =
            InformationMatrix::from_covariance(&[[4.0, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 1.0]])
                .unwrap();
        assert_eq!(information.as_matrix().diagonal(), nalgebra::Vector3::new(0.25, 4.0, 1.0));
    }
}
