//! Submaps: what a few metres of driving saw, as points, surfaces and free space around one keyframe.

use std::collections::BTreeMap;

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

/// A thing is lasting when at least this share of the beams that came to its cell ended there.
const LASTING_SHARE: f64 = 0.15;

impl Submap {
    /// The submap of `scans` in the frame of a keyframe at `frame_from_anchor`.
    pub fn new(
        geometry: &ScanGeometry,
        scans: &[SubmapScan<'_>],
        frame_from_anchor: &Pose2,
        config: &SubmapConfig,
    ) -> Self {
        let (mut submap, points) = Self::gathered(geometry, scans, frame_from_anchor, config);
        submap.choose_points(&points, config);
        submap
    }

    /// The same without returns that the scans themselves saw through: people who walk by stand in no map, and would
    /// speak against every place.
    pub fn of_lasting_things(
        geometry: &ScanGeometry,
        scans: &[SubmapScan<'_>],
        frame_from_anchor: &Pose2,
        config: &SubmapConfig,
    ) -> Self {
        let (mut submap, mut points) = Self::gathered(geometry, scans, frame_from_anchor, config);
        let cell = |point: &Point2| {
            let index = |meters: f64| (meters / config.evidence_cell_m + 0.5).floor() as i32;
            (index(point.x), index(point.y))
        };
        let mut num_hits: BTreeMap<(i32, i32), u32> = BTreeMap::new();
        for point in &points {
            *num_hits.entry(cell(point)).or_default() += 1;
        }
        points.retain(|point| {
            let hits = f64::from(num_hits[&cell(point)]);
            hits >= LASTING_SHARE * (hits + f64::from(submap.evidence.num_passes(point)))
        });
        submap.choose_points(&points, config);
        submap
    }

    /// Surfaces and free space, without the points that are chosen from all returns.
    fn gathered(
        geometry: &ScanGeometry,
        scans: &[SubmapScan<'_>],
        frame_from_anchor: &Pose2,
        config: &SubmapConfig,
    ) -> (Self, Vec<Point2>) {
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
        let submap = Self { surfaces, evidence, pyramid, fine_points: Vec::new(), coarse_points: Vec::new() };
        (submap, all_points)
    }

    fn choose_points(&mut self, points: &[Point2], config: &SubmapConfig) {
        self.fine_points = spread(points, config.fine_spacing_m, f64::INFINITY);
        self.coarse_points = spread(points, config.coarse_spacing_m, config.radius_m);
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_walked_by_is_no_lasting_thing() {
        let geometry = ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -0.5,
            angle_increment_rad: 0.5,
            range_max_m: 20.0,
            robot_from_laser: Pose2::identity(),
        };
        let (wall, person) = ([5.0f32, 5.0, 5.0], [5.0f32, 2.0, 5.0]);
        let scans: Vec<SubmapScan<'_>> = (0..12)
            .map(|step| SubmapScan {
                frame_from_robot: Pose2::identity(),
                ranges_m: if step == 3 { &person } else { &wall },
            })
            .collect();
        let config = SubmapConfig::default();
        let is_person = |point: &Point2| point.distance(&Point2::new(2.0, 0.0)) < 0.1;
        let all = Submap::new(&geometry, &scans, &Pose2::identity(), &config);
        assert_eq!(
            all.fine_points.len(),
            4,
            "three places of the wall and the person: {:?}",
            all.fine_points
        );
        assert!(all.fine_points.iter().any(is_person));
        let lasting = Submap::of_lasting_things(&geometry, &scans, &Pose2::identity(), &config);
        assert_eq!(lasting.fine_points.len(), 3, "{:?}", lasting.fine_points);
        assert!(!lasting.fine_points.iter().any(is_person));
    }
}
