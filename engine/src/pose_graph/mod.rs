//! Robust least squares over poses in the plane (thesis 2.1.3 and Appendix B).
//!
//! A [`PoseGraph`] holds poses x and constraints ⟨z, Ω⟩ between them. [`optimize`] finds the poses of least
//! χ² = Σ eᵀ Ω e, where e = z⁻¹ · (x_i⁻¹ x_j) as (x, y, wrapped θ):
//!
//! ```text
//! graph ─► start (as given, or chordal) ─► linearize ─► H Δ = −b ─► x + Δ ─► … ─► report
//!              chordal.rs                  residual.rs   normal_equations.rs
//!                                                        sparse_cholesky.rs (the only user of faer)
//! ```
//!
//! Only relative poses are measured, so one pose of every connected component is held where it stands: the limit
//! of the prior that Appendix B adds to the first node, without changing the cost. Constraints
//! that may be wrong altogether are weighed by [`optimize_robust`]. Nothing here knows of scans or
//! words, and no input can make it panic: a graph that cannot be solved is a [`PoseGraphError`].

mod chordal;
mod clique;
mod components;
mod config;
mod consistency;
mod covariance;
mod error;
mod graph;
mod information;
mod normal_equations;
mod optimizer;
mod paths;
mod residual;
mod robust;
mod selected_inverse;
mod spanning_tree;
mod sparse_cholesky;
mod support;
mod surest_first;
#[cfg(test)]
mod testing;

pub use components::Components;
pub use config::{Kernel, Method, PoseGraphConfig, RobustConfig, Start};
pub use consistency::{ConsistencyConfig, ConsistentSet, consistent_sets};
pub use covariance::CovarianceSolver;
pub use error::PoseGraphError;
pub use graph::{PoseConstraint, PoseGraph, Trust};
pub use information::{InformationError, InformationMatrix};
pub use optimizer::{OptimizeReport, StopReason, optimize};
pub use robust::{RobustReport, optimize_robust};
pub use spanning_tree::spanning_tree_start;
