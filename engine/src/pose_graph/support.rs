//! Which doubtful constraints are backed by another one close by.
//!
//! Two right closures (i, j) and (k, l) with k near i and l near j close a short cycle over the odometry between
//! them, and it must close within their covariances. Wrong ones hardly ever agree with a neighbour, so the backed
//! constraints are a nearly clean set to begin with, whatever the odometry has drifted since.

use nalgebra::Matrix3;

use super::{PoseConstraint, PoseGraph, RobustConfig, Trust};
use crate::geometry::Pose2;

/// Doubtful constraints that hold together with a neighbour, and what they say about the stated covariances.
pub(super) struct Backing {
    /// For every constraint whether it is trusted or backed.
    pub is_backed: Vec<bool>,
    /// How much larger the covariances really are than stated, by the cycles that close: the median of their χ²
    /// against that of three degrees of freedom; 1 where there are too few cycles to tell.
    pub covariance_scale: f64,
}

/// Median of χ² with three degrees of freedom.
const MEDIAN_CHI2: f64 = 2.366;
/// Fewer closed cycles than this say too little about the covariances.
const CYCLES_FOR_SCALE: usize = 20;
/// Stated covariances are believed within these factors.
const SCALE_RANGE: (f64, f64) = (0.01, 10.0);

/// Finds the constraints whose ends are within `support_steps_max` consecutive poses of those of another one with
/// which they close a cycle. Cost: the number of such pairs times the steps between them.
pub(super) fn find_backing(graph: &PoseGraph, robust: &RobustConfig) -> Backing {
    let mut cycles = closed_cycles(graph, robust);
    let covariance_scale = if cycles.len() < CYCLES_FOR_SCALE {
        1.0
    } else {
        cycles.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        (cycles[cycles.len() / 2].chi2 / MEDIAN_CHI2).clamp(SCALE_RANGE.0, SCALE_RANGE.1)
    };
    let mut is_backed: Vec<bool> = graph.trusts().iter().map(|&trust| trust == Trust::Trusted).collect();
    let bound = robust.inlier_chi2_max * covariance_scale;
    for cycle in cycles.iter().filter(|cycle| cycle.chi2 <= bound) {
        is_backed[cycle.a] = true;
        is_backed[cycle.b] = true;
    }
    Backing { is_backed, covariance_scale }
}

/// Two constraints and how well the cycle over both closes.
struct Cycle {
    a: usize,
    b: usize,
    chi2: f64,
}

/// All cycles of two close doubtful constraints that close within the stated covariances.
fn closed_cycles(graph: &PoseGraph, robust: &RobustConfig) -> Vec<Cycle> {
    let chain = Chain::of(graph);
    let mut closures: Vec<(usize, Closure)> = graph
        .constraints()
        .iter()
        .enumerate()
        .filter(|&(index, _)| graph.trusts()[index] == Trust::Doubtful)
        .filter_map(|(index, constraint)| Some((index, Closure::new(constraint)?)))
        .collect();
    closures.sort_by_key(|(index, closure)| (closure.first, *index));
    let reach = robust.support_steps_max;
    let mut cycles = Vec::new();
    for (position, (a, closure)) in closures.iter().enumerate() {
        let near =
            closures[position + 1..].iter().take_while(|(_, other)| other.first - closure.first <= reach);
        for (b, other) in near.filter(|(_, other)| other.second.abs_diff(closure.second) <= reach) {
            if let Some(chi2) = chain.closes(closure, other).filter(|&chi2| chi2 <= robust.inlier_chi2_max) {
                cycles.push(Cycle { a: *a, b: *b, chi2 });
            }
        }
    }
    cycles
}

/// A doubtful constraint, turned so that it leads from the earlier pose to the later.
struct Closure {
    first: u32,
    second: u32,
    measured: Uncertain,
}

impl Closure {
    fn new(constraint: &PoseConstraint) -> Option<Self> {
        let forward = Uncertain::of(constraint)?;
        Some(if constraint.i < constraint.j {
            Self { first: constraint.i, second: constraint.j, measured: forward }
        } else {
            Self { first: constraint.j, second: constraint.i, measured: forward.inverse() }
        })
    }
}

/// A relative pose with the covariance of its (x, y, θ) in the axes of the first frame.
#[derive(Clone, Copy)]
pub(super) struct Uncertain {
    pub pose: Pose2,
    pub covariance: Matrix3<f64>,
}

impl Uncertain {
    pub const EXACT: Self =
        Self { pose: Pose2::identity(), covariance: Matrix3::new(0., 0., 0., 0., 0., 0., 0., 0., 0.) };

    /// `None` when the constraint does not determine all of the relative pose.
    pub fn of(constraint: &PoseConstraint) -> Option<Self> {
        let pose = constraint.i_from_j;
        // Ω stands in the axes of z, turned against those of pose i by z's own heading.
        let (sin, cos) = pose.theta.sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let covariance = constraint.information.as_matrix().try_inverse()?;
        Some(Self { pose, covariance: turn * covariance * turn.transpose() })
    }

    pub fn compose(&self, next: &Self) -> Self {
        let covariance = self.pose.compose_covariance(&self.covariance, &next.pose, &next.covariance);
        Self { pose: self.pose.compose(&next.pose), covariance }
    }

    pub fn inverse(&self) -> Self {
        let pose = self.pose.inverse();
        let (sin, cos) = pose.theta.sin_cos();
        let jacobian = -Matrix3::new(cos, -sin, -pose.y, sin, cos, pose.x, 0.0, 0.0, 1.0);
        Self { pose, covariance: jacobian * self.covariance * jacobian.transpose() }
    }

    /// χ² of the claim that this and `other`, measured independently, are the same relative pose.
    pub fn chi2_against(&self, other: &Self) -> Option<f64> {
        let mut difference = other.pose.to_vector() - self.pose.to_vector();
        difference.z = crate::geometry::wrap_angle(difference.z);
        let covariance = self.covariance + other.covariance;
        Some((covariance.try_inverse()? * difference).dot(&difference))
    }
}

/// Odometry between consecutive poses.
struct Chain {
    /// `steps[k]`: pose k + 1 seen from pose k.
    steps: Vec<Option<Uncertain>>,
}

impl Chain {
    fn of(graph: &PoseGraph) -> Self {
        let mut steps = vec![None; graph.poses().len()];
        let trusted =
            graph.constraints().iter().zip(graph.trusts()).filter(|(_, trust)| **trust == Trust::Trusted);
        for (constraint, _) in trusted {
            let Some(forward) = Uncertain::of(constraint) else { continue };
            if constraint.j == constraint.i + 1 {
                steps[constraint.i as usize] = Some(forward);
            } else if constraint.i == constraint.j + 1 {
                steps[constraint.j as usize] = Some(forward.inverse());
            }
        }
        Self { steps }
    }

    /// Pose `to` seen from pose `from` along the chain; `None` where it is broken.
    fn between(&self, from: u32, to: u32) -> Option<Uncertain> {
        let mut traveled = Uncertain::EXACT;
        for step in &self.steps[from.min(to) as usize..from.max(to) as usize] {
            traveled = traveled.compose(step.as_ref()?);
        }
        Some(if from <= to { traveled } else { traveled.inverse() })
    }

    /// χ² of the cycle over both closures and the odometry between their ends.
    fn closes(&self, a: &Closure, b: &Closure) -> Option<f64> {
        let to_a = self.between(b.first, a.first)?;
        let from_a = self.between(a.second, b.second)?;
        to_a.compose(&a.measured).compose(&from_a).chi2_against(&b.measured)
    }
}
