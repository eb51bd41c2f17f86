//! What changed at a place between two sets of runs: doors, furniture, pallets.
//!
//! Both sets are drawn as occupancy counts at their map poses. A cell that one set saw free and the other sees
//! occupied, with no obstacle nearby that a small error of the poses could have moved there, has changed; changed
//! cells that touch form an area. The density profiles of the two sets, averaged around the area, are evidence of
//! their own: where something appeared the free-space density falls, where it went it rises (thesis Fig 5.5).
//!
//! What merely was not seen is no change: a cell must have been judged in both sets. Each run by itself then says whether
//! it saw an area as it was or as it is, which dates the change between two visits.

mod config;
mod history;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

pub use config::ChangesConfig;
use history::date;

use super::run::Keyframe;
use crate::config_error::ConfigError;
use crate::geometry::{Point2, Pose2};
use crate::occupancy::{CellCounts, CellIndex, TiledOccupancy};
use crate::scan::ScanGeometry;

/// One run placed in the map.
#[derive(Clone, Copy, Debug)]
pub struct PlacedRun<'a> {
    /// The laser.
    pub geometry: &'a ScanGeometry,
    /// Registered scans in order of travel.
    pub keyframes: &'a [Keyframe],
    /// Pose of every keyframe in the map; both sets of runs must be in one frame.
    pub map_from_keyframes: &'a [Pose2],
    /// Where the density was sampled and what it was, first kernel.
    pub densities: &'a [(Point2, f32)],
}

/// Whether something came or went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChangeKind {
    /// Free before, occupied after.
    Appeared,
    /// Occupied before, free after.
    Disappeared,
}

/// An area that changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Whether something came or went.
    pub kind: ChangeKind,
    /// Mean position of the changed cells, metres.
    pub center: Point2,
    /// Lower left corner of the changed cells, metres.
    pub low: Point2,
    /// Upper right corner, metres.
    pub high: Point2,
    /// Surface of the changed cells, m².
    pub area_m2: f64,
    /// Mean density sampled around the area after, minus before; `None` where one set did not pass.
    pub density_change: Option<f64>,
    /// In [0, 1]: how clearly the scans of both sets tell, and whether the densities agree.
    pub confidence: f64,
    /// Where in the runs of both sets, those before first, somebody last saw it as it was; `None` when no single run saw
    /// enough of it.
    pub last_as_before: Option<usize>,
    /// Where in those runs somebody first saw it as it is, behind the former.
    pub first_as_after: Option<usize>,
}

/// A changed area with its cells.
struct Found {
    change: Change,
    cells: Vec<CellIndex>,
}

/// Lists what changed from `before` to `after`, largest surface first.
///
/// Cost: linear in the beams drawn, then in the seen cells. Moving people leave counts in few scans and are not
/// listed; a change that no run of one set could see is not either.
///
/// # Errors
/// A configuration that cannot work.
pub fn find_changes(
    before: &[PlacedRun<'_>],
    after: &[PlacedRun<'_>],
    config: &ChangesConfig,
) -> Result<Vec<Change>, ConfigError> {
    config.validate("changes")?;
    let (old, new) = (draw(before, config)?, draw(after, config)?);
    let mut found = Vec::new();
    for (kind, occupied, free) in [(ChangeKind::Appeared, &new, &old), (ChangeKind::Disappeared, &old, &new)]
    {
        let cells = changed_cells(occupied, free, config);
        for area in areas(&cells, config) {
            let mut change = describe(kind, &area, &cells, &new);
            if change.area_m2 < config.area_min_m2 {
                continue;
            }
            weigh_densities(&mut change, before, after, config);
            found.push(Found { change, cells: area });
        }
    }
    drop((old, new));
    date(&mut found, before, after, config)?;
    let mut changes: Vec<Change> = found.into_iter().map(|found| found.change).collect();
    changes.sort_by(|a, b| {
        b.area_m2
            .total_cmp(&a.area_m2)
            .then(a.kind.cmp(&b.kind))
            .then(a.center.x.total_cmp(&b.center.x))
            .then(a.center.y.total_cmp(&b.center.y))
    });
    Ok(changes)
}

fn draw(runs: &[PlacedRun<'_>], config: &ChangesConfig) -> Result<TiledOccupancy, ConfigError> {
    let mut grid = TiledOccupancy::new(config.occupancy.clone())?;
    for run in runs {
        for (keyframe, map_from_robot) in run.keyframes.iter().zip(run.map_from_keyframes) {
            grid.add_scan(run.geometry, &keyframe.ranges_m, map_from_robot);
        }
    }
    Ok(grid)
}

/// Cells that `occupied` sees occupied and `free` surely free, with no obstacle of `free` near, and how clearly.
fn changed_cells(
    occupied: &TiledOccupancy,
    free: &TiledOccupancy,
    config: &ChangesConfig,
) -> BTreeMap<CellIndex, f64> {
    let radius = (config.tolerance_m / config.occupancy.resolution_m).floor() as i32;
    let is_near_obstacle = |cell: CellIndex| {
        (-radius..=radius).any(|dy| {
            (-radius..=radius).any(|dx| {
                dx * dx + dy * dy <= radius * radius
                    && is_occupied(free.counts((cell.0 + dx, cell.1 + dy)), config)
            })
        })
    };
    occupied
        .seen_cells()
        .filter(|(_, counts)| counts.num_hits >= config.num_scans_min && is_occupied(*counts, config))
        .filter_map(|(cell, counts)| {
            let other = free.counts(cell);
            let is_free = num_scans(other) >= u32::from(config.num_scans_min)
                && f64::from(other.num_hits) <= config.free_share_max * f64::from(num_scans(other));
            (is_free && !is_near_obstacle(cell)).then(|| (cell, clearness(counts) * clearness(other)))
        })
        .collect()
}

fn num_scans(counts: CellCounts) -> u32 {
    u32::from(counts.num_hits) + u32::from(counts.num_misses)
}

fn is_occupied(counts: CellCounts, config: &ChangesConfig) -> bool {
    counts.num_hits > 0
        && f64::from(counts.num_hits) >= config.occupancy.occupied_share_min * f64::from(num_scans(counts))
}

/// Share of the scans of some cells that saw a return in them.
fn hit_share(grid: &TiledOccupancy, cells: &[CellIndex]) -> f64 {
    let add = |(hits, scans), cell: &CellIndex| {
        let counts = grid.counts(*cell);
        (hits + u32::from(counts.num_hits), scans + num_scans(counts))
    };
    let (num_hits, num_scans) = cells.iter().fold((0, 0), add);
    f64::from(num_hits) / f64::from(num_scans.max(1))
}

/// Rises from 0 to 1 with the scans that agree on a cell: n of them leave 1/(n + 1) of doubt (Laplace's rule).
fn clearness(counts: CellCounts) -> f64 {
    let agreeing = f64::from(counts.num_hits.max(counts.num_misses));
    agreeing / (agreeing + 1.0)
}

/// Groups of changed cells that are within `join_m` of one another.
fn areas(cells: &BTreeMap<CellIndex, f64>, config: &ChangesConfig) -> Vec<Vec<CellIndex>> {
    let radius = ((config.join_m / config.occupancy.resolution_m).round() as i32).max(1);
    let mut left: BTreeSet<CellIndex> = cells.keys().copied().collect();
    let mut areas = Vec::new();
    while let Some(seed) = left.pop_first() {
        let mut area = vec![seed];
        let mut next = 0;
        while next < area.len() {
            let (x, y) = area[next];
            next += 1;
            for column in x - radius..=x + radius {
                let near: Vec<CellIndex> =
                    left.range((column, y - radius)..=(column, y + radius)).copied().collect();
                for cell in near {
                    left.remove(&cell);
                    area.push(cell);
                }
            }
        }
        areas.push(area);
    }
    areas
}

fn describe(
    kind: ChangeKind,
    area: &[CellIndex],
    clearness: &BTreeMap<CellIndex, f64>,
    grid: &TiledOccupancy,
) -> Change {
    let half = 0.5 * grid.resolution_m();
    let count = area.len() as f64;
    let (mut center, mut confidence) = (Point2::new(0.0, 0.0), 0.0);
    let (mut low, mut high) = (Point2::new(f64::MAX, f64::MAX), Point2::new(f64::MIN, f64::MIN));
    for cell in area {
        let middle = grid.center_of(*cell);
        center = Point2::new(center.x + middle.x / count, center.y + middle.y / count);
        low = Point2::new(low.x.min(middle.x - half), low.y.min(middle.y - half));
        high = Point2::new(high.x.max(middle.x + half), high.y.max(middle.y + half));
        confidence += clearness[cell] / count;
    }
    let area_m2 = count * grid.resolution_m() * grid.resolution_m();
    Change {
        kind,
        center,
        low,
        high,
        area_m2,
        density_change: None,
        confidence,
        last_as_before: None,
        first_as_after: None,
    }
}

/// Share of the confidence that densities of the wrong sign take away.
const DENSITY_WEIGHT: f64 = 0.5;

/// Adds what the density profiles say, and lowers the confidence where they say the opposite.
fn weigh_densities(
    change: &mut Change,
    before: &[PlacedRun<'_>],
    after: &[PlacedRun<'_>],
    config: &ChangesConfig,
) {
    let (Some(old), Some(new)) = (mean_density(before, change, config), mean_density(after, change, config))
    else {
        return;
    };
    let difference = new - old;
    change.density_change = Some(difference);
    let agrees = match change.kind {
        ChangeKind::Appeared => difference <= 0.0,
        ChangeKind::Disappeared => difference >= 0.0,
    };
    if !agrees {
        change.confidence *= 1.0 - DENSITY_WEIGHT;
    }
}

/// Mean density sampled within the profile's radius of the area; `None` without samples.
fn mean_density(runs: &[PlacedRun<'_>], change: &Change, config: &ChangesConfig) -> Option<f64> {
    let distance = |point: &Point2| {
        let outside = |value: f64, low: f64, high: f64| (low - value).max(value - high).max(0.0);
        let dx = outside(point.x, change.low.x, change.high.x);
        dx.hypot(outside(point.y, change.low.y, change.high.y))
    };
    let samples = runs.iter().flat_map(|run| run.densities);
    let near = samples.filter(|(point, _)| distance(point) <= config.profile_radius_m);
    let (sum, count) =
        near.fold((0.0, 0u32), |(sum, count), (_, density)| (sum + f64::from(*density), count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

#[cfg(test)]
mod tests;
