//! An area: everything that the scans of one map saw, as surfaces and free space, to register short recordings in.
//!
//! Submaps of single places would each repeat what their neighbours saw; here every cell is kept once, in tiles that
//! exist only where a beam has been, so that memory follows the ground that was seen and not the distance driven. A
//! registration cuts the few thousand cells around its start out of the tiles and searches there as between two
//! submaps; the alignment and the opinions that follow read the whole area.

use std::collections::BTreeMap;

use nalgebra::Matrix3;

use super::branch_and_bound::{SearchPyramid, SearchWindow};
use super::config::SubmapConfig;
use super::evidence_grid::{CellEvidence, EvidenceGrid};
use super::point_to_line::align;
use super::points::{thinned_points, transformed};
use super::register::{Tally, alignment_settings, window_prior};
use super::submap::Submap;
use super::surface_map::SurfaceMap;
use crate::geometry::{Point2, Pose2};
use crate::scan::ScanGeometry;

/// Cells along the edge of a tile.
const TILE: i32 = 64;
/// Points of a recording that are aligned; all are asked for their opinion afterwards.
const NUM_ALIGNED_MAX: usize = 500;
/// A cell is a surface when at least this share of the beams that came to it ended there.
const SURFACE_SHARE: f64 = 0.15;
/// A cell takes no more points into its surface than this, so that sums stay small.
const NUM_HITS_MAX: u8 = 200;

/// Every how many cells, along rows and columns, free space of a recording is compared.
const FREE_STRIDE: usize = 3;

const UNKNOWN: u8 = 0;
const FREE: u8 = 1;
const BESIDE_SURFACE: u8 = 2;
const SURFACE: u8 = 3;

type TileKey = (i32, i32);

/// Counts the beams of an area, scan by scan.
#[derive(Clone, Debug)]
pub struct AreaBuilder {
    config: SubmapConfig,
    surfaces: SurfaceMap,
    index: BTreeMap<TileKey, usize>,
    /// For each cell beams that ended there and beams that passed.
    tiles: Vec<Vec<(u8, u8)>>,
    latest: Option<(TileKey, usize)>,
}

impl AreaBuilder {
    /// An area that nobody has seen yet.
    pub fn new(config: &SubmapConfig) -> Self {
        Self {
            config: config.clone(),
            surfaces: SurfaceMap::new(config.cell_m),
            index: BTreeMap::new(),
            tiles: Vec::new(),
            latest: None,
        }
    }

    /// Adds a scan at its pose in the map; a pose that is not finite adds nothing.
    pub fn add_scan(&mut self, geometry: &ScanGeometry, map_from_robot: &Pose2, ranges_m: &[f32]) {
        if !map_from_robot.is_finite() {
            return;
        }
        let config = &self.config;
        let points = thinned_points(
            geometry,
            ranges_m,
            config.point_spacing_m,
            config.range_limit_m,
            config.max_points,
        );
        let laser = map_from_robot.compose(&geometry.robot_from_laser).position();
        for point in transformed(&points, map_from_robot) {
            self.add_beam(&laser, &point);
        }
    }

    fn add_beam(&mut self, from: &Point2, to: &Point2) {
        let cell_m = self.config.evidence_cell_m;
        let length_m = from.distance(to);
        // The last cell before the end is left out, as in a submap.
        let num_steps = (length_m / cell_m).floor().max(0.0) as usize;
        let step = Point2::new((to.x - from.x) / length_m * cell_m, (to.y - from.y) / length_m * cell_m);
        let (mut x, mut y) = (from.x, from.y);
        for _ in 0..num_steps {
            let passes = &mut self.cell_mut(cell_at(x, y, cell_m)).1;
            *passes = passes.saturating_add(1);
            x += step.x;
            y += step.y;
        }
        let hits = &mut self.cell_mut(cell_at(to.x, to.y, cell_m)).0;
        *hits = hits.saturating_add(1);
        if *hits <= NUM_HITS_MAX {
            self.surfaces.insert(to);
        }
    }

    fn cell_mut(&mut self, cell: (i32, i32)) -> &mut (u8, u8) {
        let key = tile_of(cell);
        let tile = match self.latest {
            Some((known, tile)) if known == key => tile,
            _ => {
                let next = self.tiles.len();
                let tile = *self.index.entry(key).or_insert(next);
                if tile == next {
                    self.tiles.push(vec![(0, 0); (TILE * TILE) as usize]);
                }
                self.latest = Some((key, tile));
                tile
            }
        };
        &mut self.tiles[tile][offset_of(cell)]
    }

    /// The area as it was seen.
    pub fn finish(self) -> Area {
        let num_tiles = self.tiles.len();
        let mut area = Area {
            cell_m: self.config.evidence_cell_m,
            surfaces: self.surfaces,
            index: self.index,
            tiles: vec![vec![UNKNOWN; (TILE * TILE) as usize]; num_tiles],
        };
        let is_surface = |hits: u8, passes: u8| {
            hits > 0 && f64::from(hits) >= SURFACE_SHARE * (f64::from(hits) + f64::from(passes))
        };
        let keys: Vec<(TileKey, usize)> = area.index.iter().map(|(key, tile)| (*key, *tile)).collect();
        for ((tile_x, tile_y), tile) in keys {
            for (offset, &(hits, passes)) in self.tiles[tile].iter().enumerate() {
                let cell = (tile_x * TILE + offset as i32 % TILE, tile_y * TILE + offset as i32 / TILE);
                if is_surface(hits, passes) {
                    area.raise(cell, SURFACE);
                    for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                        area.raise((cell.0 + dx, cell.1 + dy), BESIDE_SURFACE);
                    }
                } else if passes > 1 {
                    area.raise(cell, FREE);
                }
            }
        }
        area
    }
}

/// How points are searched for in an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSearch {
    /// How far from the recording's origin they lie at most, metres.
    pub reach_m: f64,
    /// Step of the heading, radians.
    pub turn_step_rad: f64,
    /// Poses worth no more than this share of the highest possible are not looked for.
    pub min_share: f64,
}

/// How a recording lies in an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaFit {
    /// Pose of the submap's frame in the map.
    pub map_from_submap: Pose2,
    /// Covariance of (x, y, θ) in the map's axes; long along a plain corridor.
    pub covariance: Matrix3<f64>,
    /// Share of the recording's returns about which the map has an opinion.
    pub coverage: f64,
    /// Of these the share that the map contradicts: it saw free space there.
    pub contradicted: f64,
    /// Share of the map's surfaces, where the recording has an opinion, that it contradicts.
    pub contradicts: f64,
    /// Of the returns that the map confirms, the share that ends in a surface and not just beside one.
    pub exact: f64,
    /// Share of the free space that the recording saw of which the map knows nothing.
    pub beyond: f64,
    /// Returns about which the map has an opinion.
    pub num_opinions: u32,
}

impl AreaFit {
    /// Share of all opinions, both ways, that agree.
    pub fn agreement(&self) -> f64 {
        1.0 - 0.5 * (self.contradicted + self.contradicts)
    }
}

/// Surfaces and free space of one map.
#[derive(Clone, Debug)]
pub struct Area {
    cell_m: f64,
    surfaces: SurfaceMap,
    index: BTreeMap<TileKey, usize>,
    tiles: Vec<Vec<u8>>,
}

impl Area {
    /// Bytes that the cells take, about.
    pub fn num_bytes(&self) -> usize {
        self.tiles.len() * (TILE * TILE) as usize + self.surfaces.num_bytes()
    }

    /// The pose at which some points of a recording, none farther than the reach from its origin, have the highest worth
    /// in a window, and that worth as a share of the highest possible; none when no pose exceeds `min_share` of it.
    pub fn search(
        &self,
        points: &[Point2],
        window: &SearchWindow,
        settings: &AreaSearch,
    ) -> Option<(Pose2, f64)> {
        let (corner, pyramid) = self.cut(&window.center, settings.reach_m + window.half_m);
        let center = Pose2::new(window.center.x - corner.x, window.center.y - corner.y, window.center.theta);
        let around = SearchWindow { center, ..*window };
        let (found, share) =
            pyramid.best_pose_above(settings.min_share, points, &around, settings.turn_step_rad)?;
        Some((Pose2::new(found.x + corner.x, found.y + corner.y, found.theta), share))
    }

    /// Moves a submap from a start that is close onto the surfaces, and says how the two agree there; none without any
    /// overlap.
    pub fn align(
        &self,
        submap: &Submap,
        start: &Pose2,
        window: &SearchWindow,
        config: &SubmapConfig,
    ) -> Option<AreaFit> {
        let prior = window_prior(start, window)?;
        let stride = submap.fine_points.len().div_ceil(NUM_ALIGNED_MAX).max(1);
        let points: Vec<Point2> = submap.fine_points.iter().step_by(stride).copied().collect();
        let surface_at = |point: &Point2| self.surfaces.surface_at(point, config.min_count);
        let found = align(surface_at, &points, &prior, start, &alignment_settings(config));
        let pose = found.map_from_points;
        let (corner, pyramid) = self.cut(&pose, config.radius_m + config.spread_half_m);
        let local = Pose2::new(pose.x - corner.x, pose.y - corner.y, pose.theta);
        let mut covariance = found.information.try_inverse()?;
        let mut place = covariance.fixed_view_mut::<2, 2>(0, 0);
        place +=
            pyramid.spread(&submap.coarse_points, &local, config.spread_half_m, config.spread_returns_per_e);
        let of_recording = self.opinions(&submap.fine_points, &pose);
        let of_area = Tally::count(&submap.evidence, &self.surface_points(&pose, config), &pose.inverse());
        let num_opinions = of_recording.num_confirmed + of_recording.num_contradicted;
        (num_opinions > 0).then(|| AreaFit {
            map_from_submap: pose,
            covariance,
            coverage: f64::from(num_opinions) / submap.fine_points.len() as f64,
            contradicted: of_recording.contradiction(),
            contradicts: of_area.contradiction(),
            exact: self.exact_share(&submap.fine_points, &pose, of_recording.num_confirmed),
            beyond: self.unknown_share(&submap.evidence.free_points(FREE_STRIDE), &pose),
            num_opinions,
        })
    }

    /// Share of the confirmed returns that end in a surface itself.
    fn exact_share(&self, points: &[Point2], map_from_points: &Pose2, num_confirmed: u32) -> f64 {
        let is_exact = |point: &Point2| self.state_at(point) == SURFACE;
        let num_exact = transformed(points, map_from_points).iter().filter(|point| is_exact(point)).count();
        num_exact as f64 / f64::from(num_confirmed.max(1))
    }

    /// Share of some points that nobody saw.
    fn unknown_share(&self, points: &[Point2], map_from_points: &Pose2) -> f64 {
        let is_unknown = |point: &Point2| self.state_at(point) == UNKNOWN;
        let num_unknown =
            transformed(points, map_from_points).iter().filter(|point| is_unknown(point)).count();
        num_unknown as f64 / points.len().max(1) as f64
    }

    /// What the area says of a recording's returns.
    fn opinions(&self, points: &[Point2], map_from_points: &Pose2) -> Tally {
        let mut tally = Tally::default();
        for point in transformed(points, map_from_points) {
            match self.at(&point) {
                CellEvidence::Surface => tally.num_confirmed += 1,
                CellEvidence::Free => tally.num_contradicted += 1,
                CellEvidence::Unknown => {}
            }
        }
        tally
    }

    /// Centres of the surface cells within the reach of a submap at a pose.
    fn surface_points(&self, center: &Pose2, config: &SubmapConfig) -> Vec<Point2> {
        let (column, row) = cell_at(center.x, center.y, self.cell_m);
        let half = (config.radius_m / self.cell_m) as i32;
        let mut points = Vec::new();
        self.for_rows((column - half, row - half), 2 * half + 1, |(first, row), states| {
            for (offset, _) in states.iter().enumerate().filter(|(_, state)| **state == SURFACE) {
                let x = f64::from(first + offset as i32) * self.cell_m;
                points.push(Point2::new(x, f64::from(row) * self.cell_m));
            }
        });
        points
    }

    /// The search pyramid of the cells around a pose, and where its origin lies in the map.
    fn cut(&self, center: &Pose2, radius_m: f64) -> (Point2, SearchPyramid) {
        let middle = cell_at(center.x, center.y, self.cell_m);
        let mut grid = EvidenceGrid::new(radius_m, self.cell_m);
        let (half, side) = (grid.half(), 2 * grid.half() + 1);
        let (left, bottom) = (middle.0 - half, middle.1 - half);
        let worth = grid.hit_worth_mut();
        self.for_rows((left, bottom), side, |(first, row), states| {
            let start = ((row - bottom) * side + first - left) as usize;
            for (worth, &state) in worth[start..].iter_mut().zip(states) {
                *worth = state.saturating_sub(FREE);
            }
        });
        let corner = Point2::new(f64::from(middle.0) * self.cell_m, f64::from(middle.1) * self.cell_m);
        (corner, SearchPyramid::new(&grid))
    }

    /// Visits the square of `side` cells from a lower left cell on, in pieces of rows that one tile holds.
    fn for_rows(&self, (left, bottom): (i32, i32), side: i32, mut visit: impl FnMut((i32, i32), &[u8])) {
        let (low, high) = (tile_of((left, bottom)), tile_of((left + side - 1, bottom + side - 1)));
        for tile_x in low.0..=high.0 {
            for (&(_, tile_y), &tile) in self.index.range((tile_x, low.1)..=(tile_x, high.1)) {
                let columns = (tile_x * TILE).max(left)..((tile_x + 1) * TILE).min(left + side);
                let rows = (tile_y * TILE).max(bottom)..((tile_y + 1) * TILE).min(bottom + side);
                for row in rows {
                    let start = offset_of((columns.start, row));
                    visit((columns.start, row), &self.tiles[tile][start..start + columns.len()]);
                }
            }
        }
    }

    /// What is known at a point.
    fn at(&self, point: &Point2) -> CellEvidence {
        match self.state_at(point) {
            UNKNOWN => CellEvidence::Unknown,
            FREE => CellEvidence::Free,
            _ => CellEvidence::Surface,
        }
    }

    fn state_at(&self, point: &Point2) -> u8 {
        let cell = cell_at(point.x, point.y, self.cell_m);
        self.index.get(&tile_of(cell)).map_or(UNKNOWN, |&tile| self.tiles[tile][offset_of(cell)])
    }

    /// Sets a cell to a state unless it has a higher one; cells of tiles that nobody saw stay unknown.
    fn raise(&mut self, cell: (i32, i32), state: u8) {
        if let Some(&tile) = self.index.get(&tile_of(cell)) {
            let known = &mut self.tiles[tile][offset_of(cell)];
            *known = state.max(*known);
        }
    }
}

/// The cell of a point; cells lie around whole multiples of their edge, as in a submap.
fn cell_at(x: f64, y: f64, cell_m: f64) -> (i32, i32) {
    ((x / cell_m + 0.5).floor() as i32, (y / cell_m + 0.5).floor() as i32)
}

fn tile_of(cell: (i32, i32)) -> TileKey {
    (cell.0.div_euclid(TILE), cell.1.div_euclid(TILE))
}

fn offset_of(cell: (i32, i32)) -> usize {
    (cell.1.rem_euclid(TILE) * TILE + cell.0.rem_euclid(TILE)) as usize
}
