//! A scan that still belongs to the refiner's window.

use serde::{Deserialize, Serialize};

use super::points::transformed;
use crate::geometry::{Point2, Pose2};

/// Grain of the points of the window: with 16 bits a coordinate they reach 65 m from the robot, beyond any range limit.
const POINT_GRAIN_M: f64 = 0.002;

/// A scan that still belongs to the window: points in the axes of the start, in grains from where the robot was.
///
/// Everything that is computed from a point uses it as rounded here, so that what is added to the surfaces can be taken
/// away again exactly, by this process or the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RecentScan {
    /// Travel at which it was taken, millimetres.
    pub(super) travel_mm: u64,
    robot_grains: (i32, i32),
    offsets: Box<[(i16, i16)]>,
}

impl RecentScan {
    /// A scan's points in the robot's frame, taken at a pose.
    pub(super) fn new(travel_mm: u64, run_from_robot: &Pose2, points: &[Point2]) -> Self {
        let grains = |meters: f64| (meters / POINT_GRAIN_M).round() as i32;
        let robot_grains = (grains(run_from_robot.x), grains(run_from_robot.y));
        let offset = |point: Point2| {
            let along =
                |meters: f64, robot: i32| grains(meters).saturating_sub(robot).clamp(-32_768, 32_767) as i16;
            (along(point.x, robot_grains.0), along(point.y, robot_grains.1))
        };
        let offsets = transformed(points, run_from_robot).into_iter().map(offset).collect();
        Self { travel_mm, robot_grains, offsets }
    }

    /// The points in the run's frame, metres.
    pub(super) fn points(&self) -> impl Iterator<Item = Point2> + '_ {
        let meters = |robot: i32, offset: i16| f64::from(robot.saturating_add(offset.into())) * POINT_GRAIN_M;
        let (x, y) = self.robot_grains;
        self.offsets.iter().map(move |&(dx, dy)| Point2::new(meters(x, dx), meters(y, dy)))
    }
}
