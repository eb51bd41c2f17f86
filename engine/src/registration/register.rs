//! Registration of two submaps: search, then alignment, then what the two say of each other.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::branch_and_bound::SearchWindow;
use super::config::SubmapConfig;
use super::evidence_grid::{CellEvidence, EvidenceGrid};
use super::motion_prior::{MotionPrior, Witness};
use super::point_to_line::{AlignmentSettings, align};
use super::submap::Submap;
use crate::geometry::{Point2, Pose2};

/// How two submaps fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SubmapFit {
    /// Pose of the later submap seen from the earlier one.
    pub earlier_from_later: Pose2,
    /// Covariance of (x, y, θ) in the earlier submap's axes; long along a plain corridor.
    pub covariance: Matrix3<f64>,
    /// Of all returns of one that the other has an opinion about, the share that it confirms; both ways.
    pub agreement: f64,
    /// The same of the returns of one of them alone, whichever is confirmed more: furniture that came or went and people
    /// on one of two visits are contradicted in one direction only.
    pub one_way_agreement: f64,
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
    let settings = alignment_settings(config);
    let prior = window_prior(start, window)?;
    let surface_at = |point: &Point2| earlier.surfaces.surface_at(point, config.min_count);
    let alignment = align(surface_at, &later.fine_points, &prior, start, &settings);
    let pose = alignment.map_from_points;
    let both = Opinions::of(earlier, later, &pose);
    let opinions = both.all();
    let num_opinions = opinions.num_confirmed + opinions.num_contradicted;
    let num_points = (later.fine_points.len() + earlier.fine_points.len()) as f64;
    if num_opinions == 0 {
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
        agreement: f64::from(opinions.num_confirmed) / f64::from(num_opinions),
        one_way_agreement: 1.0 - both.one_sided_contradiction(),
        overlap: f64::from(num_opinions) / num_points,
    })
}

/// A pose is somewhere in the window around the start.
pub(super) fn window_prior(start: &Pose2, window: &SearchWindow) -> Option<MotionPrior> {
    let place = (window.half_m * window.half_m).max(0.01);
    let turn = (window.half_turn_rad * window.half_turn_rad).max(1e-4);
    let covariance = Matrix3::from_diagonal(&nalgebra::Vector3::new(place, place, turn));
    Some(MotionPrior::new(Witness::new(*start, &covariance, 1.0)?, []))
}

/// How returns are pulled onto surfaces.
pub(super) fn alignment_settings(config: &SubmapConfig) -> AlignmentSettings {
    AlignmentSettings {
        noise_m: config.noise_m,
        outlier_m: config.outlier_m,
        first_outlier_m: config.first_outlier_m,
        max_iterations: config.max_iterations,
        correlated_returns: config.correlated_returns,
    }
}

/// What one submap says of the returns of another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Tally {
    /// Returns that lie on a surface.
    pub num_confirmed: u32,
    /// Returns where there is free space.
    pub num_contradicted: u32,
}

impl Tally {
    /// Share of the returns with an opinion that are contradicted; 0 without opinions.
    pub fn contradiction(&self) -> f64 {
        f64::from(self.num_contradicted) / f64::from((self.num_confirmed + self.num_contradicted).max(1))
    }

    /// Asks a grid about points.
    pub fn count(grid: &EvidenceGrid, points: &[Point2], grid_from_points: &Pose2) -> Self {
        let mut tally = Self::default();
        let (sin, cos) = grid_from_points.theta.sin_cos();
        for point in points {
            let x = grid_from_points.x + cos * point.x - sin * point.y;
            let y = grid_from_points.y + sin * point.x + cos * point.y;
            match grid.at(&Point2::new(x, y)) {
                CellEvidence::Surface => tally.num_confirmed += 1,
                CellEvidence::Free => tally.num_contradicted += 1,
                CellEvidence::Unknown => {}
            }
        }
        tally
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            num_confirmed: self.num_confirmed + other.num_confirmed,
            num_contradicted: self.num_contradicted + other.num_contradicted,
        }
    }
}

/// What two submaps at a given relative pose say of each other's returns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Opinions {
    /// What the earlier says of the later.
    pub of_later: Tally,
    /// What the later says of the earlier.
    pub of_earlier: Tally,
}

impl Opinions {
    /// Compares two submaps as they lie, without moving them.
    pub fn of(earlier: &Submap, later: &Submap, earlier_from_later: &Pose2) -> Self {
        Self {
            of_later: Tally::count(&earlier.evidence, &later.fine_points, earlier_from_later),
            of_earlier: Tally::count(&later.evidence, &earlier.fine_points, &earlier_from_later.inverse()),
        }
    }

    /// The share of the returns of one of them that the other contradicts, whichever way is less.
    /// A direction without opinions bears nothing out.
    pub fn one_sided_contradiction(&self) -> f64 {
        let has_opinions = |tally: &&Tally| tally.num_confirmed + tally.num_contradicted > 0;
        let directions = [self.of_later, self.of_earlier];
        directions.iter().filter(has_opinions).map(Tally::contradiction).fold(1.0, f64::min)
    }

    /// The same shares from fewer opinions where there are very many, so that sums never end.
    #[must_use]
    pub fn faded(&self) -> Self {
        const NUM_MAX: u32 = 1 << 24;
        let fade = |tally: &Tally| match tally.num_confirmed.max(tally.num_contradicted) > NUM_MAX {
            true => {
                Tally { num_confirmed: tally.num_confirmed / 2, num_contradicted: tally.num_contradicted / 2 }
            }
            false => *tally,
        };
        Self { of_later: fade(&self.of_later), of_earlier: fade(&self.of_earlier) }
    }

    /// Both ways together.
    pub fn all(&self) -> Tally {
        self.of_later.plus(&self.of_earlier)
    }
}

impl std::ops::AddAssign for Opinions {
    fn add_assign(&mut self, other: Self) {
        self.of_later = self.of_later.plus(&other.of_later);
        self.of_earlier = self.of_earlier.plus(&other.of_earlier);
    }
}
