//! What changed at a place between two sets of runs: doors, furniture, pallets.
//!
//! Both sets are drawn as occupancy counts at their map poses. A cell that one set saw free and the other sees
//! occupied, with no obstacle nearby that a small error of the poses could have moved there, has changed; changed
//! cells that touch form an area. The density profiles of the two sets, averaged around the area, are evidence of
//! their own: where something appeared the free-space density falls, where it went it rises (thesis Fig 5.5).

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::run::Keyframe;
use crate::config_error::ConfigError;
use crate::geometry::{Point2, Pose2};
use crate::occupancy::{CellCounts, CellIndex, OccupancyConfig, TiledOccupancy};
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

/// Settings of the comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChangesConfig {
    /// How the runs are drawn.
    pub occupancy: OccupancyConfig,
    /// An obstacle within this distance of one in the other set has not changed: poses and walls are not sharper,
    /// metres.
    pub tolerance_m: f64,
    /// Scans that must agree on a cell: that saw a return in it in the one set, and judged it in the other. A person who
    /// walks by leaves fewer returns.
    pub num_scans_min: u16,
    /// A cell is surely free when at most this share of its scans saw a return in it.
    pub free_share_max: f64,
    /// Changed cells closer than this belong to one area, metres.
    pub join_m: f64,
    /// Areas with less than this surface of changed cells are noise, m².
    pub area_min_m2: f64,
    /// Densities sampled within this distance of an area speak for or against it, metres.
    pub profile_radius_m: f64,
}

impl Default for ChangesConfig {
    fn default() -> Self {
        Self {
            occupancy: OccupancyConfig { range_limit_m: 9.0, ..OccupancyConfig::default() },
            tolerance_m: 0.25,
            num_scans_min: 3,
            free_share_max: 0.05,
            join_m: 0.35,
            area_min_m2: 0.05,
            profile_radius_m: 1.5,
        }
    }
}

impl ChangesConfig {
    /// Checks every value; `path` is prefixed to the name of the offending field.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.occupancy.validate(&format!("{path}.occupancy"))?;
        let values = [
            ("tolerance_m", self.tolerance_m, 0.0, 2.0),
            ("free_share_max", self.free_share_max, 0.0, 0.5),
            ("join_m", self.join_m, 0.0, 5.0),
            ("area_min_m2", self.area_min_m2, 0.0, 100.0),
            ("profile_radius_m", self.profile_radius_m, 0.0, 20.0),
        ];
        for (name, value, low, high) in values {
            if !(low..=high).contains(&value) {
                return Err(ConfigError::new(
                    format!("{path}.{name}"),
                    format!("must be in [{low}, {high}]"),
                ));
            }
        }
        if self.num_scans_min == 0 {
            return Err(ConfigError::new(format!("{path}.num_scans_min"), "must be at least 1"));
        }
        Ok(())
    }
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
    let mut changes = Vec::new();
    for (kind, occupied, free) in [(ChangeKind::Appeared, &new, &old), (ChangeKind::Disappeared, &old, &new)]
    {
        let cells = changed_cells(occupied, free, config);
        for area in areas(&cells, config) {
            let mut change = describe(kind, &area, &cells, &new);
            if change.area_m2 < config.area_min_m2 {
                continue;
            }
            weigh_densities(&mut change, before, after, config);
            changes.push(change);
        }
    }
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
    Change { kind, center, low, high, area_m2, density_change: None, confidence }
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
mod tests {
    use super::*;

    /// A box in the world: low corner, high corner.
    type Block = ((f64, f64), (f64, f64));

    fn laser() -> ScanGeometry {
        ScanGeometry {
            num_ranges: 180,
            angle_min_rad: -std::f64::consts::FRAC_PI_2,
            angle_increment_rad: std::f64::consts::PI / 180.0,
            range_max_m: 30.0,
            robot_from_laser: Pose2::identity(),
        }
    }

    /// Distance along a ray to the room's walls or the nearest box.
    fn range_m(pose: &Pose2, angle_rad: f64, blocks: &[Block]) -> f32 {
        let (sin, cos) = (pose.theta + angle_rad).sin_cos();
        let slab = |from: f64, way: f64, low: f64, high: f64| {
            let (a, b) = ((low - from) / way, (high - from) / way);
            (a.min(b), a.max(b))
        };
        let room = {
            let (_, x) = slab(pose.x, cos, 0.0, 12.0);
            let (_, y) = slab(pose.y, sin, 0.0, 4.0);
            x.min(y)
        };
        let hit = |((x0, y0), (x1, y1)): &Block| {
            let (x, y) = (slab(pose.x, cos, *x0, *x1), slab(pose.y, sin, *y0, *y1));
            let (enter, leave) = (x.0.max(y.0), x.1.min(y.1));
            (enter <= leave && enter > 0.0).then_some(enter)
        };
        blocks.iter().filter_map(hit).fold(room, f64::min) as f32
    }

    /// A drive down the room and back, poses off by `error_m`.
    fn drive(blocks: &[Block], error_m: f64) -> (Vec<Keyframe>, Vec<Pose2>) {
        let there = (0..50).map(|k| Pose2::new(1.0 + 0.2 * f64::from(k), 2.0, 0.0));
        let back = (0..50).map(|k| Pose2::new(11.0 - 0.2 * f64::from(k), 2.0, std::f64::consts::PI));
        let poses: Vec<Pose2> = there.chain(back).collect();
        let keyframe = |pose: &Pose2| Keyframe {
            scan_seq: 0,
            timestamp_ns: 0,
            odom_from_robot: *pose,
            run_from_robot: *pose,
            motion_covariance: [[0.0; 3]; 3],
            ranges_m: (0..180).map(|k| range_m(pose, laser().beam_angle_rad(k), blocks)).collect(),
        };
        let keyframes = poses.iter().map(keyframe).collect();
        (
            keyframes,
            poses.iter().map(|pose| Pose2::new(pose.x + error_m, pose.y - error_m, pose.theta)).collect(),
        )
    }

    fn compare(before: &[Block], after: &[Block], error_m: f64, densities: [f32; 2]) -> Vec<Change> {
        let geometry = laser();
        let (old, new) = (drive(before, 0.0), drive(after, error_m));
        let samples = densities.map(|density| [(Point2::new(6.0, 2.0), density)]);
        let old = PlacedRun {
            geometry: &geometry,
            keyframes: &old.0,
            map_from_keyframes: &old.1,
            densities: &samples[0],
        };
        let new = PlacedRun { keyframes: &new.0, map_from_keyframes: &new.1, densities: &samples[1], ..old };
        find_changes(&[old], &[new], &ChangesConfig::default()).unwrap()
    }

    const SHELF: Block = ((5.5, 3.2), (6.5, 3.7));
    const PALLET: Block = ((8.0, 0.4), (8.8, 1.0));

    #[test]
    fn nothing_changed_where_nothing_changed() {
        assert!(compare(&[SHELF], &[SHELF], 0.0, [0.5, 0.5]).is_empty());
        assert!(compare(&[SHELF], &[SHELF], 0.08, [0.5, 0.5]).is_empty(), "poses are never exact");
    }

    #[test]
    fn furniture_that_came_and_went_is_found() {
        let changes = compare(&[SHELF], &[PALLET], 0.05, [0.5, 0.7]);
        let find = |kind, x: f64, y: f64| {
            changes.iter().find(|c| c.kind == kind && c.center.distance(&Point2::new(x, y)) < 0.6)
        };
        let came = find(ChangeKind::Appeared, 8.4, 0.9).unwrap();
        assert!(came.high.x - came.low.x > 0.5 && came.confidence > 0.5, "{came:?}");
        let went = find(ChangeKind::Disappeared, 6.0, 3.3).unwrap();
        assert!(went.density_change.is_some_and(|change| (change - 0.2).abs() < 1e-6));
        assert_eq!(changes.len(), 2, "{changes:?}");
    }

    #[test]
    fn densities_of_the_wrong_sign_lower_the_confidence() {
        let confidence = |densities| {
            let changes = compare(&[SHELF], &[], 0.0, densities);
            assert_eq!(changes.len(), 1);
            changes[0].confidence
        };
        assert!(confidence([0.7, 0.5]) < 0.6 * confidence([0.5, 0.7]));
    }

    #[test]
    fn impossible_settings_name_the_field() {
        let config = ChangesConfig { free_share_max: f64::NAN, ..ChangesConfig::default() };
        assert_eq!(find_changes(&[], &[], &config).unwrap_err().field, "changes.free_share_max");
    }
}
