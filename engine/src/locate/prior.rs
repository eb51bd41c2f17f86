//! What is known of a robot before it has seen anything: a rough pose, declared by a person or another system.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Pose2, wrap_angle};

/// Weight of a place that the declaration rules out: declarations are wrong, too.
const MISTAKEN_SHARE: f64 = 0.01;
/// What a place that the declaration names gains over one that nothing is known about.
const GAIN: f64 = 10.0;
/// Squared distance, in standard deviations of three dimensions, beyond which a place disagrees: 99 of 100 true
/// declarations lie within.
const DISAGREES: f64 = 11.34;

/// Where a robot is said to be when its session begins.
#[derive(Clone, Debug, PartialEq)]
pub struct PosePrior {
    component: u32,
    map_from_robot: Pose2,
    information: Matrix3<f64>,
}

impl PosePrior {
    /// A rough pose in a component with the covariance of (x, y, θ) in the map's axes, row by row; none when that is no
    /// covariance: not symmetric or not positive.
    pub fn new(component: u32, map_from_robot: Pose2, covariance: [[f64; 3]; 3]) -> Option<Self> {
        let covariance = Matrix3::from(covariance).transpose();
        let is_finite = map_from_robot.is_finite() && covariance.iter().all(|value| value.is_finite());
        let asymmetry = (covariance - covariance.transpose()).amax();
        if !is_finite || asymmetry > 1e-6 * covariance.amax() {
            return None;
        }
        let information = covariance.cholesky()?.inverse();
        Some(Self { component, map_from_robot, information })
    }

    /// The component that is named.
    pub const fn component(&self) -> u32 {
        self.component
    }

    /// The pose that is named.
    pub const fn map_from_robot(&self) -> &Pose2 {
        &self.map_from_robot
    }

    /// What the declaration adds to the log odds of a place, given where the session would have begun there.
    pub fn log_odds(&self, component: u32, map_from_start: &Pose2) -> f64 {
        let fits =
            self.squared_distance(component, map_from_start).map_or(0.0, |square| (-0.5 * square).exp());
        (MISTAKEN_SHARE + GAIN * fits).ln()
    }

    /// Whether a place is one that the declaration means.
    pub fn agrees(&self, component: u32, map_from_start: &Pose2) -> bool {
        self.squared_distance(component, map_from_start).is_some_and(|square| square <= DISAGREES)
    }

    /// Squared distance in standard deviations; none in another component.
    fn squared_distance(&self, component: u32, map_from_start: &Pose2) -> Option<f64> {
        let off = Vector3::new(
            map_from_start.x - self.map_from_robot.x,
            map_from_start.y - self.map_from_robot.y,
            wrap_angle(map_from_start.theta - self.map_from_robot.theta),
        );
        (component == self.component).then(|| off.dot(&(self.information * off)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COVARIANCE: [[f64; 3]; 3] = [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.04]];

    #[test]
    fn a_place_that_is_named_gains_and_all_others_lose() {
        let prior = PosePrior::new(1, Pose2::new(2.0, 3.0, 3.1), COVARIANCE).unwrap();
        let near = Pose2::new(2.3, 3.0, -3.1);
        assert!(prior.agrees(1, &near) && prior.log_odds(1, &near) > 1.5);
        for (component, place) in [(0, near), (1, Pose2::new(8.0, 3.0, 3.1)), (1, Pose2::new(2.0, 3.0, 0.0))]
        {
            assert!(!prior.agrees(component, &place), "{place:?}");
            assert!(prior.log_odds(component, &place) < -4.0, "but it is not ruled out");
        }
    }

    #[test]
    fn what_is_no_covariance_is_refused() {
        let pose = Pose2::identity();
        assert!(PosePrior::new(0, pose, [[0.0; 3]; 3]).is_none());
        assert!(PosePrior::new(0, pose, [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).is_none());
        assert!(PosePrior::new(0, pose, [[f64::NAN; 3]; 3]).is_none());
        assert!(PosePrior::new(0, Pose2::new(f64::INFINITY, 0.0, 0.0), COVARIANCE).is_none());
    }
}
