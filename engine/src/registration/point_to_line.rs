//! Gauss-Newton alignment of points to the surfaces of a map (point-to-line), with a prior.

use nalgebra::{Matrix3, Vector3};

use super::motion_prior::MotionPrior;
use super::surface_map::Surface;
use crate::geometry::{Point2, Pose2};

/// How points are pulled onto surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlignmentSettings {
    /// Expected distance of a return from its surface, metres.
    pub noise_m: f64,
    /// Beyond about this distance a return counts as an outlier, metres.
    pub outlier_m: f64,
    /// The same at the first step, metres.
    pub first_outlier_m: f64,
    /// Steps at most.
    pub max_iterations: usize,
    /// Neighbouring returns err together: this many count as one independent measurement.
    pub correlated_returns: f64,
}

impl AlignmentSettings {
    /// The distance beyond which returns stop to pull: wide at first, so that a poor start still finds its way,
    /// then narrower step by step.
    fn outlier_at(&self, iteration: usize) -> f64 {
        (self.first_outlier_m * 0.6f64.powi(iteration as i32)).max(self.outlier_m)
    }
}

/// Where the points came to rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Alignment {
    /// The pose.
    pub map_from_points: Pose2,
    /// Information of (x, y, θ) in the map's axes about the pose, including the prior.
    pub information: Matrix3<f64>,
    /// Share of all points that lie on a surface.
    pub inlier_share: f64,
    /// Negative logarithm of the probability of points and prior together, up to a constant that all poses share.
    pub cost: f64,
}

/// Moves `points` from `start` onto the surfaces of a map; `surface_at` looks them up.
///
/// Minimises Σ ρ(nᵀ(T p − μ)) / noise² − 2 log prior(T) with the Geman-McClure ρ, whose weight falls with the square of
/// the distance, so that people and open doors stop to pull.
pub(crate) fn align(
    mut surface_at: impl FnMut(&Point2) -> Option<Surface>,
    points: &[Point2],
    prior: &MotionPrior,
    start: &Pose2,
    settings: &AlignmentSettings,
) -> Alignment {
    let mut pose = *start;
    let mut iteration = 0;
    loop {
        let outlier_m = settings.outlier_at(iteration);
        let fit = linearize(&mut surface_at, points, &pose, settings, outlier_m);
        let (prior_information, prior_gradient) = prior.pull(&pose);
        let information = fit.hessian + prior_information;
        let mut result = Alignment {
            map_from_points: pose,
            information,
            inlier_share: f64::from(fit.num_inliers) / points.len().max(1) as f64,
            cost: fit.cost + prior.cost(&pose),
        };
        let factor = information.cholesky().filter(|_| iteration < settings.max_iterations);
        let Some(factor) = factor else { return result };
        let step = factor.solve(&-(fit.gradient + prior_gradient));
        pose = Pose2::new(pose.x + step.x, pose.y + step.y, pose.theta + step.z);
        let is_annealed = outlier_m <= settings.outlier_m;
        if is_annealed && step.x.abs() < 2e-4 && step.y.abs() < 2e-4 && step.z.abs() < 2e-5 {
            result.map_from_points = pose;
            return result;
        }
        iteration += 1;
    }
}

/// Points against surfaces at one pose.
pub(crate) struct Linearization {
    /// Information of the points about (x, y, θ).
    pub hessian: Matrix3<f64>,
    /// Gradient of the cost.
    pub gradient: Vector3<f64>,
    /// Points that lie on a surface.
    pub num_inliers: u32,
    /// Half the sum of the weighed squares; a point without a surface costs half of what a far one does.
    pub cost: f64,
}

/// What points say of a pose, to first order.
pub(crate) fn linearize(
    mut surface_at: impl FnMut(&Point2) -> Option<Surface>,
    points: &[Point2],
    pose: &Pose2,
    settings: &AlignmentSettings,
    outlier_m: f64,
) -> Linearization {
    let (sin, cos) = pose.theta.sin_cos();
    let mut h = [0.0f64; 6];
    let mut g = [0.0f64; 3];
    let mut num_inliers = 0;
    let mut cost = 0.0;
    let outlier2 = outlier_m * outlier_m;
    let noise2 = settings.noise_m * settings.noise_m;
    let unseen_cost = 0.25 * outlier2 / (noise2 * settings.correlated_returns);
    for point in points {
        let (rx, ry) = (cos * point.x - sin * point.y, sin * point.x + cos * point.y);
        let placed = Point2::new(pose.x + rx, pose.y + ry);
        let Some(surface) = surface_at(&placed) else {
            cost += unseen_cost;
            continue;
        };
        let n = surface.normal;
        let residual = n.x * (placed.x - surface.mean.x) + n.y * (placed.y - surface.mean.y);
        if residual.abs() < settings.outlier_m {
            num_inliers += 1;
        }
        let falloff = outlier2 / (outlier2 + residual * residual);
        let strength = surface.flatness / ((noise2 + surface.across_m2) * settings.correlated_returns);
        cost += 0.5 * strength * residual * residual * falloff;
        let weight = strength * falloff * falloff;
        let turn = -n.x * ry + n.y * rx;
        h[0] += weight * n.x * n.x;
        h[1] += weight * n.x * n.y;
        h[2] += weight * n.x * turn;
        h[3] += weight * n.y * n.y;
        h[4] += weight * n.y * turn;
        h[5] += weight * turn * turn;
        g[0] += weight * n.x * residual;
        g[1] += weight * n.y * residual;
        g[2] += weight * turn * residual;
    }
    Linearization {
        hessian: Matrix3::new(h[0], h[1], h[2], h[1], h[3], h[4], h[2], h[4], h[5]),
        gradient: Vector3::new(g[0], g[1], g[2]),
        num_inliers,
        cost,
    }
}
