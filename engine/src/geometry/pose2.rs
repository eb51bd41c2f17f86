//! Rigid motions of the plane, SE(2).

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::wrap_angle;

/// A point in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point2 {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
}

impl Point2 {
    /// The point (x, y), metres.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Euclidean distance in metres.
    pub fn distance(&self, other: &Point2) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// A pose, equally a rigid transform: rotate by `theta`, then move by (`x`, `y`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose2 {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Heading in radians, counter-clockwise, in (−π, π].
    pub theta: f64,
}

impl Pose2 {
    /// A pose from metres and radians; the angle is wrapped to (−π, π].
    pub fn new(x: f64, y: f64, theta: f64) -> Self {
        Self { x, y, theta: wrap_angle(theta) }
    }

    /// The transform that changes nothing.
    pub const fn identity() -> Self {
        Self { x: 0.0, y: 0.0, theta: 0.0 }
    }

    /// `a_from_b.compose(&b_from_c)` is `a_from_c`.
    pub fn compose(&self, other: &Pose2) -> Pose2 {
        let (sin, cos) = self.theta.sin_cos();
        Pose2::new(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            self.theta + other.theta,
        )
    }

    /// `a_from_b.inverse()` is `b_from_a`.
    pub fn inverse(&self) -> Pose2 {
        let (sin, cos) = self.theta.sin_cos();
        Pose2::new(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, -self.theta)
    }

    /// The pose of `other` seen from `self`: `self.inverse().compose(other)`.
    pub fn between(&self, other: &Pose2) -> Pose2 {
        let (sin, cos) = self.theta.sin_cos();
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        Pose2::new(cos * dx + sin * dy, -sin * dx + cos * dy, other.theta - self.theta)
    }

    /// Maps a point of the source frame into the target frame.
    pub fn transform_point(&self, point: &Point2) -> Point2 {
        let (sin, cos) = self.theta.sin_cos();
        Point2::new(self.x + cos * point.x - sin * point.y, self.y + sin * point.x + cos * point.y)
    }

    /// The position, metres.
    pub const fn position(&self) -> Point2 {
        Point2::new(self.x, self.y)
    }

    /// Distance between the positions in metres.
    pub fn distance(&self, other: &Pose2) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    /// (x, y, θ) as a column, metres and radians.
    pub fn to_vector(&self) -> Vector3<f64> {
        Vector3::new(self.x, self.y, self.theta)
    }

    /// The pose whose coordinates are the column (x, y, θ).
    pub fn from_vector(vector: &Vector3<f64>) -> Pose2 {
        Pose2::new(vector.x, vector.y, vector.z)
    }

    /// True when all three numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.theta.is_finite()
    }

    /// Covariance of `self.compose(other)` in the target frame's axes, to first order, when both factors carry
    /// independent covariances of their (x, y, θ).
    pub fn compose_covariance(
        &self,
        covariance: &Matrix3<f64>,
        other: &Pose2,
        other_covariance: &Matrix3<f64>,
    ) -> Matrix3<f64> {
        let (sin, cos) = self.theta.sin_cos();
        let by_self = Matrix3::new(
            1.0,
            0.0,
            -sin * other.x - cos * other.y, //
            0.0,
            1.0,
            cos * other.x - sin * other.y, //
            0.0,
            0.0,
            1.0,
        );
        let by_other = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        by_self * covariance * by_self.transpose() + by_other * other_covariance * by_other.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = Pose2> {
        (-50.0..50.0f64, -50.0..50.0f64, -10.0..10.0f64).prop_map(|(x, y, theta)| Pose2::new(x, y, theta))
    }

    fn assert_close(a: &Pose2, b: &Pose2) {
        assert!(a.distance(b) < 1e-9 && wrap_angle(a.theta - b.theta).abs() < 1e-9, "{a:?} is not {b:?}");
    }

    proptest! {
        #[test]
        fn a_pose_times_its_inverse_is_the_identity(a in pose()) {
            assert_close(&a.compose(&a.inverse()), &Pose2::identity());
            assert_close(&a.inverse().compose(&a), &Pose2::identity());
        }

        #[test]
        fn composition_is_associative(a in pose(), b in pose(), c in pose()) {
            assert_close(&a.compose(&b).compose(&c), &a.compose(&b.compose(&c)));
        }

        #[test]
        fn between_undoes_compose(a in pose(), b in pose()) {
            assert_close(&a.between(&a.compose(&b)), &b);
            assert_close(&a.between(&b), &a.inverse().compose(&b));
        }

        #[test]
        fn composition_acts_on_points(a in pose(), b in pose(), x in -9.0..9.0f64, y in -9.0..9.0f64) {
            let point = Point2::new(x, y);
            let once = a.compose(&b).transform_point(&point);
            let twice = a.transform_point(&b.transform_point(&point));
            prop_assert!(once.distance(&twice) < 1e-9);
        }
    }
}
