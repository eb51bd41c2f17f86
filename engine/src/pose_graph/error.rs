//! What can be wrong with a graph.

use thiserror::Error;

use super::InformationError;
use crate::config_error::ConfigError;

/// A graph that cannot be built or solved. Poses and constraints are named by their index.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PoseGraphError {
    /// There is nothing to optimise.
    #[error("the graph has no poses")]
    Empty,
    /// More poses or constraints than 32-bit indices can name.
    #[error("the graph is too large: more than {limit} poses or constraints")]
    TooLarge {
        /// The largest number allowed.
        limit: usize,
    },
    /// NaN or ∞ in a pose.
    #[error("pose {pose} is not finite")]
    PoseNotFinite {
        /// Index of the pose.
        pose: usize,
    },
    /// NaN or ∞ in a measured relative pose.
    #[error("the measurement of constraint {constraint} is not finite")]
    MeasurementNotFinite {
        /// Index of the constraint.
        constraint: usize,
    },
    /// A constraint or a caller names a pose that is not in the graph.
    #[error("pose {pose} is unknown: the graph has {num_poses} poses")]
    UnknownPose {
        /// Index as given.
        pose: usize,
        /// Poses in the graph.
        num_poses: usize,
    },
    /// A constraint joins a pose to itself.
    #[error("constraint {constraint} joins pose {pose} to itself")]
    SelfConstraint {
        /// Index of the constraint.
        constraint: usize,
        /// Index of the pose.
        pose: usize,
    },
    /// An information matrix that is none.
    #[error("the information of constraint {constraint} cannot be used")]
    Information {
        /// Index of the constraint.
        constraint: usize,
        /// What is wrong with it.
        #[source]
        source: InformationError,
    },
    /// The constraints leave some motion of a pose free, or the numbers are beyond double precision.
    #[error("the system is not positive definite near pose {pose}: its constraints leave some motion free")]
    NotPositiveDefinite {
        /// Index of the pose at which the factorisation failed.
        pose: usize,
    },
    /// Two poses that no chain of constraints joins have no relative pose.
    #[error("poses {first} and {second} are in different components")]
    NotConnected {
        /// Index of one pose.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// The χ² of the start is beyond double precision.
    #[error("the cost of the graph is not finite")]
    CostNotFinite,
    /// The factorisation ran out of memory.
    #[error("not enough memory for the factorisation")]
    OutOfMemory,
    /// A configuration that cannot work.
    #[error("the configuration cannot work")]
    Config(#[from] ConfigError),
}
