//! Occupancy grids of map versions: drawn from the stored scans when first asked for, kept while there is room.

use std::sync::{Arc, PoisonError};

use locution_engine::occupancy::GridMap;
use locution_engine::occupancy::{OccupancyConfig, TiledOccupancy};

use crate::app::site::Site;
use crate::app::{App, AppError, on_blocking_thread};
use crate::records::{Map, PlacedRun};

/// Edge of a served cell, metres.
const RESOLUTION_M: f64 = 0.05;
/// Beams are followed no farther than this, metres: beyond, their ends are too far apart to draw walls.
const RANGE_LIMIT_M: f64 = 20.0;
/// Grids are drawn coarser rather than with more cells than this.
const NUM_CELLS_MAX: f64 = 6.4e7;
/// Keyframes read and drawn at once.
const NUM_KEYFRAMES_PER_STEP: usize = 500;

/// Names a grid in the cache: birth of the site, map version, component.
pub type GridKey = (u64, u64, u32);

impl App {
    /// The occupancy grid of one component of a version.
    ///
    /// # Errors
    /// [`AppError::NotFound`] for a component that is not in the map.
    pub async fn grid(&self, site: &Site, map: &Map, component: u32) -> Result<Arc<GridMap>, AppError> {
        let key = (site.birth(), map.record.version, component);
        if let Some(grid) = self.grids.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return Ok(Arc::clone(grid));
        }
        // One drawing at a time: two requests for the same grid must not draw it twice.
        let _turn = self.drawing.lock().await;
        if let Some(grid) = self.grids.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return Ok(Arc::clone(grid));
        }
        let runs = map.placed_runs(Some(component)).await?;
        let grid = draw(&runs).await?.ok_or_else(|| AppError::not_found("component", component))?;
        let grid = Arc::new(grid);
        self.grids.lock().unwrap_or_else(PoisonError::into_inner).put(key, Arc::clone(&grid));
        Ok(grid)
    }
}

async fn draw(runs: &[PlacedRun]) -> Result<Option<GridMap>, AppError> {
    let mut grid = TiledOccupancy::new(occupancy_config(extent(runs)))
        .map_err(|_| AppError::NotReady { detail: "the map is too wide to be drawn".to_owned() })?;
    for placed in runs {
        let geometry = placed.run.record.geometry.clone();
        for first in (0..placed.poses.len()).step_by(NUM_KEYFRAMES_PER_STEP) {
            let range = first..placed.poses.len().min(first + NUM_KEYFRAMES_PER_STEP);
            let scans = placed.keyframe_scans(range.clone()).await?;
            let poses = placed.poses[range].to_vec();
            let geometry = geometry.clone();
            grid = on_blocking_thread(move || {
                for (pose, scan) in poses.iter().zip(&scans) {
                    grid.add_scan(&geometry, &scan.ranges_m, &pose.map_from_robot);
                }
                grid
            })
            .await?;
        }
    }
    on_blocking_thread(move || GridMap::of_occupancy(&grid)).await
}

/// What the grid of an area of this width and height is drawn with.
fn occupancy_config((width_m, height_m): (f64, f64)) -> OccupancyConfig {
    let area_m2 = (width_m + 2.0 * RANGE_LIMIT_M) * (height_m + 2.0 * RANGE_LIMIT_M);
    OccupancyConfig {
        resolution_m: RESOLUTION_M.max((area_m2 / NUM_CELLS_MAX).sqrt()),
        range_limit_m: RANGE_LIMIT_M,
        no_return_clear_m: 0.0,
        ..OccupancyConfig::default()
    }
}

/// Width and height of the rectangle around all poses, metres.
fn extent(runs: &[PlacedRun]) -> (f64, f64) {
    let poses = || runs.iter().flat_map(|run| &run.poses).map(|pose| pose.map_from_robot);
    let span = |of: fn(&locution_engine::geometry::Pose2) -> f64| {
        let (min, max) = poses().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), pose| {
            (min.min(of(&pose)), max.max(of(&pose)))
        });
        (max - min).max(0.0)
    };
    (span(|pose| pose.x), span(|pose| pose.y))
}
