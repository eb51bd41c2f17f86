//! Gauss-Newton alignment of points to the surfaces of a map (point-to-line), with a prior.

use nalgebra::{Matrix3, Vector3};

use super::surface_map::SurfaceMap;
use crate::geometry::{Point2, Pose2, wrap_angle};

/// How points are pulled onto surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlignmentSettings {
    /// Expected distance of a return from its surface, metres.
    pub noise_m: f64,
    /// Beyond about this distance a return counts as an outlier, metres.
    pub outlier_m: f64,
    /// The same at the first step, metres.
    pub first_outlier_m: f64,
    /// Points that a surface must rest on.
    pub min_count: i32,
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
}

/// Moves `points` from `start` onto the surfaces of `map`.
///
/// Minimises Σ ρ(nᵀ(T p − μ)) / noise² + (T ⊖ start)ᵀ `prior` (T ⊖ start) with the Geman-McClure ρ, whose weight
/// falls with the square of the distance, so that people and open doors stop to pull.
pub(crate) fn align(
    map: &SurfaceMap,
    points: &[Point2],
    prior_mean: &Pose2,
    prior: &Matrix3<f64>,
    start: &Pose2,
    settings: &AlignmentSettings,
) -> Alignment {
    let mut pose = *start;
    let mut result = Alignment { map_from_points: pose, information: *prior, inlier_share: 0.0 };
    for iteration in 0..=settings.max_iterations {
        let outlier_m = settings.outlier_at(iteration);
        let (hessian, gradient, num_inliers) = linearize(map, points, &pose, settings, outlier_m);
        let offset = Vector3::new(
            pose.x - prior_mean.x,
            pose.y - prior_mean.y,
            wrap_angle(pose.theta - prior_mean.theta),
        );
        let information = hessian + prior;
        result = Alignment {
            map_from_points: pose,
            information,
            inlier_share: f64::from(num_inliers) / points.len().max(1) as f64,
        };
        if iteration == settings.max_iterations {
            break;
        }
        let Some(factor) = information.cholesky() else { break };
        let step = factor.solve(&-(gradient + prior * offset));
        pose = Pose2::new(pose.x + step.x, pose.y + step.y, pose.theta + step.z);
        let is_annealed = outlier_m <= settings.outlier_m;
        if is_annealed && step.x.abs() < 2e-4 && step.y.abs() < 2e-4 && step.z.abs() < 2e-5 {
            result.map_from_points = pose;
            break;
        }
    }
    result
}

fn linearize(
    map: &SurfaceMap,
    points: &[Point2],
    pose: &Pose2,
    settings: &AlignmentSettings,
    outlier_m: f64,
) -> (Matrix3<f64>, Vector3<f64>, u32) {
    let (sin, cos) = pose.theta.sin_cos();
    let mut h = [0.0f64; 6];
    let mut g = [0.0f64; 3];
    let mut num_inliers = 0;
    let outlier2 = outlier_m * outlier_m;
    for point in points {
        let (rx, ry) = (cos * point.x - sin * point.y, sin * point.x + cos * point.y);
        let placed = Point2::new(pose.x + rx, pose.y + ry);
        let Some(surface) = map.surface_at(&placed, settings.min_count) else { continue };
        let n = surface.normal;
        let residual = n.x * (placed.x - surface.mean.x) + n.y * (placed.y - surface.mean.y);
        if residual.abs() < settings.outlier_m {
            num_inliers += 1;
        }
        let falloff = outlier2 / (outlier2 + residual * residual);
        let variance = settings.noise_m * settings.noise_m + surface.across_m2;
        let flatness = 1.0 - surface.across_m2 / surface.along_m2.max(1e-9);
        let weight = flatness * falloff * falloff / (variance * settings.correlated_returns);
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
    (
        Matrix3::new(h[0], h[1], h[2], h[1], h[3], h[4], h[2], h[4], h[5]),
        Vector3::new(g[0], g[1], g[2]),
        num_inliers,
    )
}
