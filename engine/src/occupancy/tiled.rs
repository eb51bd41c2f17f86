//! The occupancy grid of a map, rendered from stored scans at optimised poses.
//!
//! Every cell counts the scans that saw a return in it and those that saw through it (Moravec and Elfes' counting
//! model). The counts live in tiles that exist only where a beam has been, so that memory follows what was seen and not
//! the rectangle around it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::geometry::{Point2, Pose2};
use crate::scan::ScanGeometry;

/// Settings of the rendered grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OccupancyConfig {
    /// Edge of a cell, metres.
    pub resolution_m: f64,
    /// Returns farther than this are not used, metres.
    pub range_limit_m: f64,
    /// A beam without return clears this far, metres; glass and black walls return nothing either.
    pub no_return_clear_m: f64,
    /// A cell is occupied when at least this share of the scans that judged it saw a return in it.
    pub occupied_share_min: f64,
    /// A cell is unknown until this many scans judged it.
    pub num_scans_min: u16,
}

impl Default for OccupancyConfig {
    fn default() -> Self {
        Self {
            resolution_m: 0.1,
            range_limit_m: 15.0,
            no_return_clear_m: 3.0,
            occupied_share_min: 0.25,
            num_scans_min: 1,
        }
    }
}

impl OccupancyConfig {
    /// Checks every value; `path` is prefixed to the name of the offending field.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let lengths = [
            ("resolution_m", self.resolution_m, 0.01, 1000.0),
            ("range_limit_m", self.range_limit_m, 0.01, 200.0),
            ("no_return_clear_m", self.no_return_clear_m, 0.0, 200.0),
            ("occupied_share_min", self.occupied_share_min, f64::MIN_POSITIVE, 1.0),
        ];
        for (name, value, low, high) in lengths {
            if !(low..=high).contains(&value) {
                return Err(ConfigError::new(
                    format!("{path}.{name}"),
                    format!("must be in [{low}, {high}]"),
                ));
            }
        }
        Ok(())
    }
}

/// Column and row of a cell; the cell (0, 0) has its lower left corner at the origin of the map.
pub type CellIndex = (i32, i32);

/// What the scans say of one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellCounts {
    /// Scans with a return in the cell.
    pub num_hits: u16,
    /// Scans that saw through the cell.
    pub num_misses: u16,
}

/// Cells per edge of a tile.
const TILE_SIZE: i32 = 64;
/// Farthest cell from the origin, so that no index overflows; beyond it nothing is drawn.
const CELL_LIMIT: f64 = 1e6;

/// Hit and miss counts in tiles.
#[derive(Clone, Debug)]
pub struct TiledOccupancy {
    config: OccupancyConfig,
    tile_of: BTreeMap<CellIndex, usize>,
    tiles: Vec<Vec<CountedCell>>,
    num_scans: u32,
}

/// Counts of a cell and the last scan that judged it, so that a scan judges it once.
#[derive(Clone, Copy, Debug, Default)]
struct CountedCell {
    counts: CellCounts,
    last_scan: u32,
}

/// Smallest rectangle of cells around all tiles' seen cells; both corners inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellBounds {
    /// Lower left cell.
    pub low: CellIndex,
    /// Upper right cell.
    pub high: CellIndex,
}

impl CellBounds {
    /// Cells per row.
    pub fn width(&self) -> usize {
        (self.high.0 - self.low.0 + 1) as usize
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        (self.high.1 - self.low.1 + 1) as usize
    }
}

impl TiledOccupancy {
    /// A grid in which nothing was seen yet.
    ///
    /// # Errors
    /// The first field of the configuration that cannot work.
    pub fn new(config: OccupancyConfig) -> Result<Self, ConfigError> {
        config.validate("occupancy")?;
        Ok(Self { config, tile_of: BTreeMap::new(), tiles: Vec::new(), num_scans: 0 })
    }

    /// Edge of a cell, metres.
    pub fn resolution_m(&self) -> f64 {
        self.config.resolution_m
    }

    /// Draws one scan. Within a scan a return outweighs the beams that pass through its cell. A pose that is not
    /// finite or out of all bounds draws nothing.
    pub fn add_scan(&mut self, geometry: &ScanGeometry, ranges_m: &[f32], map_from_robot: &Pose2) {
        let map_from_laser = map_from_robot.compose(&geometry.robot_from_laser);
        let start = self.scaled(&map_from_laser.position());
        if !is_drawable(start) {
            return;
        }
        self.num_scans += 1;
        let mut cursor = TileCursor::default();
        let mut rays = Vec::with_capacity(ranges_m.len());
        for (beam_idx, &range_m) in ranges_m.iter().enumerate() {
            let Some((length_m, is_hit)) = self.reach(geometry, range_m) else { continue };
            let (sin, cos) = (map_from_laser.theta + geometry.beam_angle_rad(beam_idx)).sin_cos();
            let length = length_m / self.config.resolution_m;
            let end = (start.0 + cos * length, start.1 + sin * length);
            if is_hit {
                self.judge(cell_of(end), &mut cursor, |counts| &mut counts.num_hits);
            }
            rays.push(end);
        }
        for end in rays {
            for cell in cells_before_end(start, end) {
                self.judge(cell, &mut cursor, |counts| &mut counts.num_misses);
            }
        }
    }

    /// Counts what the scan at hand says of a cell, unless it has said something already.
    fn judge(
        &mut self,
        cell: CellIndex,
        cursor: &mut TileCursor,
        count_of: impl Fn(&mut CellCounts) -> &mut u16,
    ) {
        let scan = self.num_scans;
        let counted = self.cell_mut(cell, cursor);
        if counted.last_scan != scan {
            counted.last_scan = scan;
            let count = count_of(&mut counted.counts);
            *count = count.saturating_add(1);
        }
    }

    /// How far a reading clears, metres, and whether it ends in an obstacle.
    fn reach(&self, geometry: &ScanGeometry, range_m: f32) -> Option<(f64, bool)> {
        if range_m.is_nan() || range_m <= 0.0 {
            return None;
        }
        if !geometry.is_return(range_m) {
            return Some((self.config.no_return_clear_m, false));
        }
        let range = f64::from(range_m);
        Some(if range <= self.config.range_limit_m {
            (range, true)
        } else {
            (self.config.range_limit_m, false)
        })
    }

    fn scaled(&self, point: &Point2) -> (f64, f64) {
        (point.x / self.config.resolution_m, point.y / self.config.resolution_m)
    }

    fn cell_mut(&mut self, cell: CellIndex, cursor: &mut TileCursor) -> &mut CountedCell {
        let key = tile_key(cell);
        if cursor.key != Some(key) {
            let tiles = &mut self.tiles;
            let tile = *self.tile_of.entry(key).or_insert_with(|| {
                tiles.push(vec![CountedCell::default(); (TILE_SIZE * TILE_SIZE) as usize]);
                tiles.len() - 1
            });
            *cursor = TileCursor { key: Some(key), tile };
        }
        &mut self.tiles[cursor.tile][offset_in_tile(cell)]
    }

    /// What the scans say of a cell.
    pub fn counts(&self, cell: CellIndex) -> CellCounts {
        self.tile_of
            .get(&tile_key(cell))
            .map(|&tile| self.tiles[tile][offset_in_tile(cell)].counts)
            .unwrap_or_default()
    }

    /// All cells that were seen, tile by tile in a fixed order.
    pub fn seen_cells(&self) -> impl Iterator<Item = (CellIndex, CellCounts)> + '_ {
        self.tile_of.iter().flat_map(move |(&(tile_x, tile_y), &tile)| {
            let seen = self.tiles[tile].iter().enumerate().filter(|(_, cell)| cell.last_scan != 0);
            seen.map(move |(offset, cell)| {
                let (row, column) = (offset as i32 / TILE_SIZE, offset as i32 % TILE_SIZE);
                ((tile_x * TILE_SIZE + column, tile_y * TILE_SIZE + row), cell.counts)
            })
        })
    }

    /// The rectangle of seen cells; `None` when nothing was seen.
    pub fn bounds(&self) -> Option<CellBounds> {
        self.seen_cells().fold(None, |bounds: Option<CellBounds>, (cell, _)| {
            let Some(CellBounds { low, high }) = bounds else {
                return Some(CellBounds { low: cell, high: cell });
            };
            Some(CellBounds {
                low: (low.0.min(cell.0), low.1.min(cell.1)),
                high: (high.0.max(cell.0), high.1.max(cell.1)),
            })
        })
    }

    /// Centre of a cell in the map, metres.
    pub fn center_of(&self, cell: CellIndex) -> Point2 {
        let middle = |index: i32| (f64::from(index) + 0.5) * self.config.resolution_m;
        Point2::new(middle(cell.0), middle(cell.1))
    }

    /// Whether a cell with these counts is occupied; `None` while too few scans have judged it.
    pub fn is_occupied(&self, CellCounts { num_hits, num_misses }: CellCounts) -> Option<bool> {
        let num_scans = u32::from(num_hits) + u32::from(num_misses);
        (num_scans >= u32::from(self.config.num_scans_min.max(1)))
            .then(|| f64::from(num_hits) >= self.config.occupied_share_min * f64::from(num_scans))
    }
}

/// The tile of the previous cell; consecutive cells of a ray mostly share it.
#[derive(Default)]
struct TileCursor {
    key: Option<CellIndex>,
    tile: usize,
}

fn tile_key(cell: CellIndex) -> CellIndex {
    (cell.0.div_euclid(TILE_SIZE), cell.1.div_euclid(TILE_SIZE))
}

fn offset_in_tile(cell: CellIndex) -> usize {
    (cell.1.rem_euclid(TILE_SIZE) * TILE_SIZE + cell.0.rem_euclid(TILE_SIZE)) as usize
}

fn is_drawable((x, y): (f64, f64)) -> bool {
    x.abs() < CELL_LIMIT && y.abs() < CELL_LIMIT
}

fn cell_of((x, y): (f64, f64)) -> CellIndex {
    (x.floor() as i32, y.floor() as i32)
}

/// The cells a segment crosses from its start up to, but without, the cell of its end (Amanatides and Woo 1987).
fn cells_before_end(start: (f64, f64), end: (f64, f64)) -> impl Iterator<Item = CellIndex> {
    let (mut cell, last) = (cell_of(start), cell_of(end));
    let mut num_left = cell.0.abs_diff(last.0) + cell.1.abs_diff(last.1);
    let axis = |from: f64, to: f64, index: i32| {
        let delta = to - from;
        let step = if delta >= 0.0 { 1 } else { -1 };
        let border = if delta >= 0.0 { f64::from(index) + 1.0 } else { f64::from(index) };
        let first = if delta == 0.0 { f64::INFINITY } else { (border - from) / delta };
        (step, first, delta.abs().recip())
    };
    let (step_x, mut next_x, stride_x) = axis(start.0, end.0, cell.0);
    let (step_y, mut next_y, stride_y) = axis(start.1, end.1, cell.1);
    std::iter::from_fn(move || {
        if num_left == 0 {
            return None;
        }
        num_left -= 1;
        let current = cell;
        // The borders left to cross decide the axis once the other one has arrived.
        if cell.1 == last.1 || (cell.0 != last.0 && next_x < next_y) {
            cell.0 += step_x;
            next_x += stride_x;
        } else {
            cell.1 += step_y;
            next_y += stride_y;
        }
        Some(current)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four beams: ahead, left, behind, right.
    fn cross() -> ScanGeometry {
        ScanGeometry {
            num_ranges: 4,
            angle_min_rad: 0.0,
            angle_increment_rad: std::f64::consts::FRAC_PI_2,
            range_max_m: 50.0,
            robot_from_laser: Pose2::identity(),
        }
    }

    fn drawn(ranges_m: [f32; 4]) -> TiledOccupancy {
        let mut grid =
            TiledOccupancy::new(OccupancyConfig { resolution_m: 1.0, ..OccupancyConfig::default() }).unwrap();
        grid.add_scan(&cross(), &ranges_m, &Pose2::new(0.5, 0.5, 0.0));
        grid
    }

    #[test]
    fn beams_clear_up_to_their_return() {
        let grid = drawn([3.0, f32::NAN, f32::INFINITY, 20.0]);
        let is_occupied = |column, row| grid.is_occupied(grid.counts((column, row)));
        let row: Vec<Option<bool>> = (0..=4).map(|column| is_occupied(column, 0)).collect();
        assert_eq!(row, [Some(false), Some(false), Some(false), Some(true), None]);
        assert_eq!(is_occupied(0, 1), None, "NaN clears nothing");
        assert_eq!(is_occupied(-2, 0), Some(false), "no return clears a little");
        assert_eq!(is_occupied(-3, 0), None);
        assert_eq!(is_occupied(0, -14), Some(false), "a far return clears up to the limit");
        assert_eq!(grid.counts((0, -15)), CellCounts::default());
    }

    #[test]
    fn a_return_outweighs_beams_through_the_same_cell() {
        let mut geometry = cross();
        geometry.angle_increment_rad = 0.01;
        let mut grid =
            TiledOccupancy::new(OccupancyConfig { resolution_m: 1.0, ..OccupancyConfig::default() }).unwrap();
        grid.add_scan(&geometry, &[3.0, 8.0, 8.0, 8.0], &Pose2::new(0.5, 0.5, 0.0));
        assert_eq!(grid.counts((3, 0)), CellCounts { num_hits: 1, num_misses: 0 });
    }

    #[test]
    fn tiles_join_seamlessly_across_negative_indices() {
        let mut grid =
            TiledOccupancy::new(OccupancyConfig { resolution_m: 0.1, ..OccupancyConfig::default() }).unwrap();
        grid.add_scan(&cross(), &[14.0, 14.0, 14.0, 14.0], &Pose2::new(0.05, 0.05, 0.0));
        let bounds = grid.bounds().unwrap();
        assert_eq!((bounds.low, bounds.high), ((-140, -140), (140, 140)));
        assert!((-139..=139).all(|column| grid.is_occupied(grid.counts((column, 0))) == Some(false)));
    }

    #[test]
    fn poses_out_of_bounds_draw_nothing() {
        let mut grid = TiledOccupancy::new(OccupancyConfig::default()).unwrap();
        grid.add_scan(&cross(), &[1.0; 4], &Pose2 { x: f64::NAN, y: 0.0, theta: 0.0 });
        grid.add_scan(&cross(), &[1.0; 4], &Pose2 { x: 1e12, y: 0.0, theta: 0.0 });
        assert_eq!(grid.bounds(), None);
        assert!(
            TiledOccupancy::new(OccupancyConfig { resolution_m: 0.0, ..OccupancyConfig::default() }).is_err()
        );
    }
}
