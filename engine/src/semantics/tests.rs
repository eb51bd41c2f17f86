//! Robots in drawn buildings: labels, places, routes and patterns from scans to sentences.

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;
use crate::geometry::{Point2, Pose2};
use crate::scan::ScanGeometry;

/// Free rectangles (left, bottom, right, top), metres; everything else is wall.
struct Building(Vec<(f64, f64, f64, f64)>);

impl Building {
    fn is_free(&self, x: f64, y: f64) -> bool {
        self.0
            .iter()
            .any(|&(left, bottom, right, top)| (left..right).contains(&x) && (bottom..top).contains(&y))
    }

    fn scan(&self, geometry: &ScanGeometry, pose: &Pose2) -> Vec<f32> {
        (0..geometry.num_ranges)
            .map(|beam_idx| {
                let (sin, cos) = (pose.theta + geometry.beam_angle_rad(beam_idx)).sin_cos();
                let steps = (1..).map(|step| f64::from(step) * 0.03);
                let is_over =
                    |&range: &f64| range > 30.0 || !self.is_free(pose.x + cos * range, pose.y + sin * range);
                steps.into_iter().find(is_over).unwrap_or(30.0) as f32
            })
            .collect()
    }
}

fn geometry() -> ScanGeometry {
    ScanGeometry {
        num_ranges: 181,
        angle_min_rad: -FRAC_PI_2,
        angle_increment_rad: PI / 180.0,
        range_max_m: 29.0,
        robot_from_laser: Pose2::identity(),
    }
}

/// Poses every 0.1 m along straight lines from corner to corner.
fn drive(corners: &[(f64, f64)]) -> Vec<Pose2> {
    let mut poses = Vec::new();
    for pair in corners.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let (length, heading) = ((x1 - x0).hypot(y1 - y0), (y1 - y0).atan2(x1 - x0));
        let num = (length / 0.1).round() as usize;
        poses.extend((0..num).map(|step| {
            let share = step as f64 / num as f64;
            Pose2::new(x0 + share * (x1 - x0), y0 + share * (y1 - y0), heading)
        }));
    }
    poses
}

struct Labeled {
    poses: Vec<Pose2>,
    runs: Vec<LabeledRun>,
    map: PlaceMap,
}

impl Labeled {
    /// By the rules.
    fn new(building: &Building, corners: &[(f64, f64)]) -> Self {
        Self::by(LabelModel::Tree, building, corners)
    }

    fn by(model: LabelModel, building: &Building, corners: &[(f64, f64)]) -> Self {
        let config = SemanticsConfig { model, ..SemanticsConfig::default() };
        let (geometry, poses) = (geometry(), drive(corners));
        let ranges: Vec<Vec<f32>> =
            poses.iter().step_by(2).map(|pose| building.scan(&geometry, pose)).collect();
        let scans = poses.iter().step_by(2).copied().zip(ranges.iter().map(Vec::as_slice)).collect();
        let runs = [DrivenRun { geometry: &geometry, scans, map_from_observations: poses.clone() }];
        let labeled = label_runs(&config, &runs);
        let map = PlaceMap::build(&config, &runs, &labeled);
        Self { poses, runs: labeled, map }
    }

    fn label_at(&self, x: f64, y: f64) -> PlaceLabel {
        let here = Point2::new(x, y);
        let distance = |idx: &usize| self.poses[*idx].position().distance(&here);
        let nearest = (0..self.poses.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        self.runs[0].labels[nearest.expect("a run has poses")]
    }
}

/// A corridor east, a right angle, and a corridor north; both 2 m wide.
fn angle() -> Labeled {
    let building = Building(vec![(0.0, 0.0, 22.0, 2.0), (20.0, 0.0, 22.0, 22.0)]);
    Labeled::new(&building, &[(1.0, 1.0), (21.0, 1.0), (21.0, 21.0)])
}

#[test]
fn an_angle_is_a_corner_between_corridors() {
    let angle = angle();
    assert_eq!(angle.label_at(10.0, 1.0), PlaceLabel::Corridor);
    assert_eq!(angle.label_at(21.0, 1.0), PlaceLabel::Corner);
    assert_eq!(angle.label_at(21.0, 12.0), PlaceLabel::Corridor);
    assert_eq!(angle.map.labels_of_run(0).len(), angle.poses.len());
}

#[test]
fn a_side_passage_makes_a_bifurcation_and_a_niche_does_not() {
    let building = Building(vec![(0.0, 0.0, 40.0, 2.0), (13.0, 0.0, 15.0, 16.0), (27.0, 0.0, 29.0, 4.0)]);
    let labeled = Labeled::new(&building, &[(1.0, 1.0), (39.0, 1.0)]);
    assert_eq!(labeled.label_at(14.0, 1.0), PlaceLabel::Bifurcation);
    assert_eq!(labeled.label_at(28.0, 1.0), PlaceLabel::Corridor);
    assert_eq!(labeled.label_at(21.0, 1.0), PlaceLabel::Corridor);
}

#[test]
fn a_visited_room_is_a_dead_end_and_a_large_one_on_the_way_a_hall() {
    let building = Building(vec![
        (0.0, 0.0, 20.0, 2.0),
        (9.5, 1.9, 10.5, 2.6),
        (8.0, 2.5, 12.0, 6.5),
        (19.9, -4.0, 29.9, 6.0),
        (29.8, 0.0, 45.0, 2.0),
    ]);
    let way = [(1.0, 1.0), (10.0, 1.0), (10.0, 5.0), (10.0, 1.0), (44.0, 1.0)];
    let labeled = Labeled::new(&building, &way);
    assert_eq!(labeled.label_at(10.0, 4.5), PlaceLabel::DeadEnd);
    assert_eq!(labeled.label_at(25.0, 1.0), PlaceLabel::Hall);
    assert_eq!(labeled.label_at(38.0, 1.0), PlaceLabel::Corridor);
}

#[test]
fn the_learned_labels_know_the_same_places() {
    let crossing = Building(vec![(0.0, 0.0, 40.0, 2.0), (19.0, 0.0, 21.0, 20.0)]);
    let labeled = Labeled::by(LabelModel::Learned, &crossing, &[(1.0, 1.0), (39.0, 1.0)]);
    assert_eq!(labeled.label_at(20.0, 1.0), PlaceLabel::Bifurcation);
    assert_eq!(labeled.label_at(10.0, 1.0), PlaceLabel::Corridor);
    let turn = Building(vec![(0.0, 0.0, 22.0, 2.0), (20.0, 0.0, 22.0, 22.0)]);
    let labeled = Labeled::by(LabelModel::Learned, &turn, &[(1.0, 1.0), (21.0, 1.0), (21.0, 21.0)]);
    assert_eq!(labeled.label_at(21.0, 1.0), PlaceLabel::Corner);
    assert_eq!(labeled.label_at(21.0, 12.0), PlaceLabel::Corridor);
    let rooms = Building(vec![(0.0, 0.0, 20.0, 2.0), (9.5, 1.9, 10.5, 2.6), (8.0, 2.5, 12.0, 6.5)]);
    let way = [(1.0, 1.0), (10.0, 1.0), (10.0, 5.0), (10.0, 1.0), (19.0, 1.0)];
    let labeled = Labeled::by(LabelModel::Learned, &rooms, &way);
    assert_eq!(labeled.label_at(10.0, 4.5), PlaceLabel::DeadEnd);
    assert_eq!(labeled.label_at(4.0, 1.0), PlaceLabel::Corridor);
    let hall = Building(vec![(0.0, 0.0, 24.0, 20.0)]);
    let labeled = Labeled::by(LabelModel::Learned, &hall, &[(4.0, 4.0), (20.0, 5.0), (18.0, 16.0)]);
    assert_eq!(labeled.label_at(15.0, 5.0), PlaceLabel::Hall);
}

#[test]
fn a_route_is_told_in_words_both_ways() {
    let angle = angle();
    let (west, north) = (Point2::new(8.0, 1.0), Point2::new(21.0, 14.0));
    let there =
        route(&angle.map, &NamedRooms::default(), &west, &north, 2.0).expect("both lie on the way driven");
    assert!((there.length_m - 26.0).abs() < 1.5, "{} m", there.length_m);
    let labels: Vec<PlaceLabel> = there.steps.iter().map(|step| step.label).collect();
    assert_eq!(labels, [PlaceLabel::Corridor, PlaceLabel::Corner, PlaceLabel::Corridor]);
    assert!(there.description.contains("left at the corner"), "{}", there.description);
    let back = route(&angle.map, &NamedRooms::default(), &north, &west, 2.0).expect("ways lead back");
    assert!(back.description.contains("right at the corner"), "{}", back.description);
    assert_eq!(route(&angle.map, &NamedRooms::default(), &west, &Point2::new(8.0, 9.0), 2.0), None);
}

#[test]
fn places_know_their_neighbors_and_their_ground() {
    let map = angle().map;
    let corner = map.places.iter().position(|place| place.label == PlaceLabel::Corner).expect("a corner");
    let place = &map.places[corner];
    assert_eq!(place.connections.len(), 2);
    assert!(place.confidence > 0.5 && place.outline.len() >= 4 && !place.visits.is_empty());
    assert!(place.center.distance(&Point2::new(21.0, 1.0)) < 2.0);
}

#[test]
fn nothing_driven_gives_nothing() {
    let geometry = geometry();
    let runs = [DrivenRun { geometry: &geometry, scans: Vec::new(), map_from_observations: Vec::new() }];
    let labeled = label_runs(&SemanticsConfig::default(), &runs);
    assert!(labeled[0].labels.is_empty());
    assert_eq!(PlaceMap::build(&SemanticsConfig::default(), &runs, &labeled).places.len(), 0);
}
