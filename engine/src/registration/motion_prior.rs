//! What is expected of the next motion before the scan has its say: odometry, or a robot that goes on as it did.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Pose2, wrap_angle};

/// One witness of where the robot is, with how sure it is of itself and how far it is believed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Witness {
    /// Where it says the robot is.
    pub mean: Pose2,
    /// Information of its (x, y, θ) in the axes of the map.
    pub information: Matrix3<f64>,
    /// Logarithm of the belief in it times the height of its density.
    log_height: f64,
}

impl Witness {
    /// A witness with this covariance in the axes of the map, believed with this probability; none when the covariance
    /// is flat.
    pub fn new(mean: Pose2, covariance: &Matrix3<f64>, belief: f64) -> Option<Self> {
        let information = covariance.try_inverse()?;
        let log_height = belief.max(1e-12).ln() + 0.5 * information.determinant().max(1e-300).ln();
        Some(Self { mean, information, log_height })
    }

    /// A witness that knows.
    pub fn certain(mean: Pose2) -> Self {
        Self { mean, information: Matrix3::identity() * 1e8, log_height: 0.0 }
    }

    fn offset(&self, pose: &Pose2) -> Vector3<f64> {
        Vector3::new(pose.x - self.mean.x, pose.y - self.mean.y, wrap_angle(pose.theta - self.mean.theta))
    }

    /// Squared deviations of a pose from what it says.
    pub fn chi2(&self, pose: &Pose2) -> f64 {
        let offset = self.offset(pose);
        (offset.transpose() * self.information * offset)[0]
    }

    fn log_density(&self, pose: &Pose2) -> f64 {
        self.log_height - 0.5 * self.chi2(pose)
    }
}

/// A prior of the pose: the mixture of what the witnesses say, so that one that is far off stops to pull.
#[derive(Clone, Debug)]
pub(crate) struct MotionPrior {
    witnesses: Vec<Witness>,
}

impl MotionPrior {
    /// At least one witness.
    pub fn new(first: Witness, others: impl IntoIterator<Item = Witness>) -> Self {
        Self { witnesses: std::iter::once(first).chain(others).collect() }
    }

    /// Probability of each witness given that the robot is at a pose.
    pub fn responsibilities(&self, pose: &Pose2) -> Vec<f64> {
        let logs: Vec<f64> = self.witnesses.iter().map(|witness| witness.log_density(pose)).collect();
        let highest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logs.iter().map(|log| (log - highest).exp()).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter().map(|weight| weight / sum).collect()
    }

    /// Information and gradient that pull a pose to the witnesses that are near it.
    pub fn pull(&self, pose: &Pose2) -> (Matrix3<f64>, Vector3<f64>) {
        if let [witness] = self.witnesses.as_slice() {
            return (witness.information, witness.information * witness.offset(pose));
        }
        let mut sum = (Matrix3::zeros(), Vector3::zeros());
        for (witness, share) in self.witnesses.iter().zip(self.responsibilities(pose)) {
            let information = witness.information * share;
            sum.0 += information;
            sum.1 += information * witness.offset(pose);
        }
        sum
    }

    /// Negative logarithm of the density at a pose, up to a constant that all poses share.
    pub fn cost(&self, pose: &Pose2) -> f64 {
        let logs: Vec<f64> = self.witnesses.iter().map(|witness| witness.log_density(pose)).collect();
        let highest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        -(highest + logs.iter().map(|log| (log - highest).exp()).sum::<f64>().ln())
    }

    /// What each witness says.
    pub fn means(&self) -> impl Iterator<Item = Pose2> + '_ {
        self.witnesses.iter().map(|witness| witness.mean)
    }
}
