//! Registration of two submaps: search, then alignment, then what the two say of each other.

use nalgebra::Matrix3;

use super::branch_and_bound::SearchWindow;
use super::config::SubmapConfig;
use super::evidence_grid::{CellEvidence, EvidenceGrid};
use super::point_to_line::{AlignmentSettings, align};
use super::submap::Submap;
use crate::geometry::{Point2, Pose2};

/// How two submaps fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubmapFit {
    /// Pose of the later submap seen from the earlier one.
    pub earlier_from_later: Pose2,
    /// Covariance of (x, y, θ) in the earlier submap's axes; long along a plain corridor.
    pub covariance: Matrix3<f64>,
    /// Of all returns of one that the other has an opinion about, the share that it confirms; both ways.
    pub agreement: f64,
    /// Share of the returns about which the other has an opinion; both ways.
    pub overlap: f64,
}

/// Finds the pose of `later` in `earlier` within a window; none when nothing fits at all.
///
/// The search tries every pose of the window on a grid; the alignment that follows minimises point-to-line distances
/// to the earlier submap's surfaces. The prior is only the window itself, weak enough to let the walls decide: a
/// direction that they leave open keeps the window's width as its deviation.
pub fn register(
    earlier: &Submap,
    later: &Submap,
    window: &SearchWindow,
    config: &SubmapConfig,
) -> Option<SubmapFit> {
    let (start, _) = earlier.pyramid.best_pose(&later.coarse_points, window, config.turn_step_rad)?;
    refine_from(earlier, later, &start, window, config)
}

/// Only the alignment of [`register`], from a start that is already close.
pub fn refine_from(
    earlier: &Submap,
    later: &Submap,
    start: &Pose2,
    window: &SearchWindow,
    config: &SubmapConfig,
) -> Option<SubmapFit> {
    let settings = AlignmentSettings {
        noise_m: config.noise_m,
        outlier_m: config.outlier_m,
        first_outlier_m: config.first_outlier_m,
        min_count: config.min_count,
        max_iterations: config.max_iterations,
        correlated_returns: config.correlated_returns,
    };
    let by_place = 1.0 / (window.half_m * window.half_m).max(0.01);
    let by_turn = 1.0 / (window.half_turn_rad * window.half_turn_rad).max(1e-4);
    let prior = Matrix3::from_diagonal(&nalgebra::Vector3::new(by_place, by_place, by_turn));
    let alignment = align(&earlier.surfaces, &later.fine_points, start, &prior, start, &settings);
    let pose = alignment.map_from_points;
    let forward = opinions(&earlier.evidence, &later.fine_points, &pose);
    let backward = opinions(&later.evidence, &earlier.fine_points, &pose.inverse());
    let num_points = (later.fine_points.len() + earlier.fine_points.len()) as f64;
    let confirmed = forward.0 + backward.0;
    let opinions = confirmed + forward.1 + backward.1;
    if opinions == 0 {
        return None;
    }
    let mut covariance = alignment.information.try_inverse()?;
    let spread = earlier.pyramid.spread(
        &later.coarse_points,
        &pose,
        config.spread_half_m,
        config.spread_returns_per_e,
    );
    let mut place = covariance.fixed_view_mut::<2, 2>(0, 0);
    place += spread;
    Some(SubmapFit {
        earlier_from_later: pose,
        covariance,
        agreement: f64::from(confirmed) / f64::from(opinions),
        overlap: f64::from(opinions) / num_points,
    })
}

/// How many of the points the grid confirms, and how many it contradicts because it saw free space there.
fn opinions(grid: &EvidenceGrid, points: &[Point2], grid_from_points: &Pose2) -> (u32, u32) {
    let (sin, cos) = grid_from_points.theta.sin_cos();
    let (mut confirmed, mut contradicted) = (0, 0);
    for point in points {
        let x = grid_from_points.x + cos * point.x - sin * point.y;
        let y = grid_from_points.y + sin * point.x + cos * point.y;
        match grid.at(&Point2::new(x, y)) {
            CellEvidence::Surface => confirmed += 1,
            CellEvidence::Free => contradicted += 1,
            CellEvidence::Unknown => {}
        }
    }
    (confirmed, contradicted)
}
