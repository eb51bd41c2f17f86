//! Worlds drawn from corridors and rooms.

use crate::simulation::World;
use anyhow::Result;
use locution_engine::geometry::Point2;

const RESOLUTION_M: f64 = 0.05;

/// Solid rock out of which corridors and rooms are cut.
#[derive(Clone, Debug)]
pub(super) struct FloorPlan {
    width: usize,
    height: usize,
    origin: Point2,
    is_free: Vec<bool>,
}

impl FloorPlan {
    /// Rock that reaches `margin_m` around the rectangle from (0, 0) to `size_m`.
    pub(super) fn new(size_m: (f64, f64), margin_m: f64) -> Self {
        let cells = |length_m: f64| ((length_m + 2.0 * margin_m) / RESOLUTION_M).ceil() as usize;
        let (width, height) = (cells(size_m.0), cells(size_m.1));
        let origin = Point2::new(-margin_m, -margin_m);
        Self { width, height, origin, is_free: vec![false; width * height] }
    }

    /// Cuts a rectangle between two opposite corners.
    pub(super) fn cut(&mut self, from: Point2, to: Point2) {
        let cell = |value: f64, origin: f64, size: usize| {
            ((value - origin) / RESOLUTION_M).round().clamp(0.0, size as f64) as usize
        };
        let columns = cell(from.x.min(to.x), self.origin.x, self.width)
            ..cell(from.x.max(to.x), self.origin.x, self.width);
        let rows = cell(from.y.min(to.y), self.origin.y, self.height)
            ..cell(from.y.max(to.y), self.origin.y, self.height);
        for row in rows {
            self.is_free[row * self.width + columns.start..row * self.width + columns.end].fill(true);
        }
    }

    /// Cuts a corridor along a chain of points; each leg runs along an axis.
    pub(super) fn corridor(&mut self, points: &[Point2], width_m: f64) {
        let half = width_m / 2.0;
        for leg in points.windows(2) {
            let (low, high) = (
                Point2::new(leg[0].x.min(leg[1].x) - half, leg[0].y.min(leg[1].y) - half),
                Point2::new(leg[0].x.max(leg[1].x) + half, leg[0].y.max(leg[1].y) + half),
            );
            self.cut(low, high);
        }
    }

    /// The world.
    pub(super) fn world(self) -> Result<World> {
        Ok(World::new(self.width, self.height, RESOLUTION_M, self.origin, self.is_free)?)
    }
}
