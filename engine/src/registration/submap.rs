//! Submaps: what a few metres of driving saw, as points, surfaces and free space around one keyframe.

use super::branch_and_bound::SearchPyramid;
use super::config::SubmapConfig;
use super::evidence_grid::EvidenceGrid;
use super::points::{thinned_points, transformed};
use super::surface_map::SurfaceMap;
use crate::geometry::{Point2, Pose2};
use crate::scan::ScanGeometry;

/// One scan that goes into a submap.
#[derive(Clone, Copy, Debug)]
pub struct SubmapScan<'a> {
    /// Pose of the robot in any frame that all scans of the submap share.
    pub frame_from_robot: Pose2,
    /// Readings in metres.
    pub ranges_m: &'a [f32],
}

/// The neighbourhood of one keyframe, in that keyframe's frame.
#[derive(Clone, Debug)]
pub struct Submap {
    pub(super) surfaces: SurfaceMap,
    pub(super) evidence: EvidenceGrid,
    pub(super) pyramid: SearchPyramid,
    /// Points about evenly spread over all surfaces, finer ones for the alignment.
    pub(super) fine_points: Vec<Point2>,
    /// Fewer points for the search.
    pub(super) coarse_points: Vec<Point2>,
}

impl Submap {
    /// The submap of `scans` in the frame of a keyframe at `frame_from_anchor`.
    pub fn new(
        geometry: &ScanGeometry,
        scans: &[SubmapScan<'_>],
        frame_from_anchor: &Pose2,
        config: &SubmapConfig,
    ) -> Self {
        let mut surfaces = SurfaceMap::new(config.cell_m);
        let mut evidence = EvidenceGrid::new(config.radius_m, config.evidence_cell_m);
        let mut all_points = Vec::new();
        for scan in scans {
            let anchor_from_robot = frame_from_anchor.between(&scan.frame_from_robot);
            let laser = anchor_from_robot.compose(&geometry.robot_from_laser).position();
            let points = thinned_points(
                geometry,
                scan.ranges_m,
                config.point_spacing_m,
                config.range_limit_m,
                config.max_points,
            );
            for point in transformed(&points, &anchor_from_robot) {
                surfaces.insert(&point);
                evidence.add_beam(&laser, &point);
                all_points.push(point);
            }
        }
        let pyramid = SearchPyramid::new(&evidence);
        let fine_points = spread(&all_points, config.fine_spacing_m, f64::INFINITY);
        let coarse_points = spread(&all_points, config.coarse_spacing_m, config.radius_m);
        Self { surfaces, evidence, pyramid, fine_points, coarse_points }
    }
}

impl Submap {
    /// At most `num_max` points for a search, evenly chosen among those within `reach_m` of the origin.
    pub fn search_points(&self, reach_m: f64, num_max: usize) -> Vec<Point2> {
        let near: Vec<Point2> =
            self.coarse_points.iter().filter(|point| point.x.hypot(point.y) <= reach_m).copied().collect();
        let count = near.len().min(num_max);
        (0..count).map(|k| near[k * near.len() / count]).collect()
    }
}

/// One point for every square of `spacing_m` that holds any, within `radius_m`, in order of their first appearance.
fn spread(points: &[Point2], spacing_m: f64, radius_m: f64) -> Vec<Point2> {
    let mut seen = std::collections::BTreeSet::new();
    points
        .iter()
        .filter(|point| point.x.hypot(point.y) <= radius_m)
        .filter(|point| {
            seen.insert(((point.x / spacing_m).floor() as i32, (point.y / spacing_m).floor() as i32))
        })
        .copied()
        .collect()
}
